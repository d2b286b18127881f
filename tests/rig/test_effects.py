"""Every effect of the library is complete, and nested in the nominal chain.

Red when an effect is incomplete, does not vanish at zero, or is named outside of its file.
"""

import ast
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.fractional.transfer import TransferFunction
from focgen.rig import plant
from focgen.rig.dynamics import UNCHANGED
from focgen.rig.effects import EQUATIONS, SLOTS, Excitation, Run, form_of, library
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed, slot_in
from focgen.rig.plant import Plant
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.rig.stages import STAGES

NAMES = sorted(library())
RICH = Excitation(10, 0.1, 20, 20, 100.0, 0.01, 8, 5, 5, 500.0, 100.0)
POOR = Excitation(1, 1.0, 0, 0, 0.5, 10.0, 1, 0, 0, 2.0, 100.0)
CONTRACT = """transport_delay slow_regulator valve_asymmetry valve_stiction flow_limit supply_saturation
leak hysteresis friction creep unloading_asymmetry softening gain_nonlinearity dead_zone contact resonance
gain_drift sensor_nonlinearity sensor_hysteresis sensor_relaxation sensor_lag sensor_drift sensor_quantization
sensor_saturation""".split()


def forms():
    return [pytest.param(e, f, id=f"{e.name}-{f.name}") for e in library().values() for f in e.forms]


def session(seed: int = 0):
    rng = np.random.default_rng(seed)
    lengths = (400, 300)
    x = np.concatenate([np.abs(np.cumsum(rng.normal(0, 0.05, n))) for n in lengths])
    return x / np.max(x), Run.of(lengths, [0.0, 30.0], 0.05)


def test_the_vocabulary_is_all_there():
    assert set(CONTRACT) <= set(NAMES)  # which others rely on; a further one is no line here


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_says_what_it_is(name):
    effect = library()[name]
    assert effect.stage in STAGES
    assert len(effect.meaning) > 10 and len(effect.reveals) > 10
    assert effect.confused_with and set(effect.confused_with) <= set(NAMES) - {name}
    exact = effect.delays  # nature has one form of these, and none quite of any other
    assert len(effect.forms) == 1 if exact else len(effect.forms) >= 2
    assert len({f.name for f in effect.forms}) == len(effect.forms)


def test_only_a_lightly_damped_mode_rings_with_one_tone():
    assert [name for name in NAMES if library()[name].tonal] == ["resonance"]


def test_what_an_effect_is_follows_from_its_parameters():
    assert [name for name in NAMES if library()[name].delays] == ["transport_delay"]
    assert [name for name in NAMES if library()[name].rounds] == ["sensor_quantization"]
    begun = {name for name in NAMES for form in library()[name].forms if form.begun}
    assert begun == {"valve_stiction"}


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_knows_what_shows_it(name):
    check = library()[name].needs
    assert check(RICH) is None
    told = check(POOR)
    assert told is None if library()[name].rounds else isinstance(told, str) and len(told) > 10


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_is_one_documented_file(name):
    path = Path(focgen.__file__).parent / "rig" / "effects" / f"{name}.py"
    text = path.read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text))
    assert len(text.splitlines()) < 110


def test_nothing_else_names_an_effect():
    root = Path(focgen.__file__).parent
    for path in root.rglob("*.py"):
        inside = path.relative_to(root).parts
        if inside[:2] == ("rig", "effects") or inside[0] in ("trials", "demonstration.py"):
            continue
        found = {
            n
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Constant) and isinstance(n := node.value, str)
        } & set(NAMES)
        assert not found, f"{path} names {found}"


@pytest.mark.parametrize("effect, form", forms())
def test_a_form_stands_where_it_may(effect, form):
    assert form.slot in SLOTS[effect.stage]
    for stage in STAGES:
        assert slot_in(form, stage) in SLOTS[stage]
    for p in form.parameters:
        assert all(p.lower <= s <= p.upper for s in p.starts)
        assert not p.log or p.lower > 0


LAG = Rig(
    "lag",
    0.02,
    Signals("c", "y"),
    Actuator(0.3, 0.7, (1.0,)),
    TransferFunction([(1.0, 0.0)], [(0.03, 1.0), (1.0, 0.0)]),
    TransferFunction([(1.0, 0.0)], [(0.05, 1.0), (1.0, 0.0)]),
)


def _answers(form, stage, x, run, start=0):
    """What a lag, or a mass on a spring where the form is of a plant's, answers: nominal, as the form's zero
    leaves it, and changed."""

    starts = tuple(p.starts[start] for p in form.parameters)
    zero = tuple(s if p.zero is None else p.zero for s, p in zip(starts, form.parameters))
    if not any(p.zero is not None for p in form.parameters):
        zero = (form.parameters[0].lower,)  # a mode far above the samples
    of_plant = "spring" in form.act(UNCHANGED, starts, None).changed

    def made(*values):
        if of_plant:
            dynamics = form.act(UNCHANGED, *values, None) if values else UNCHANGED
            return plant.respond(Plant(2, 0.2, 0.3, 1.0), x, run.rest, run.h, dynamics)
        placed = tuple(Placed("effect", form, stage, v) for v in values)
        return Chain(LAG, placed).run(x, stage, stage, run)

    return made(), made(zero), made(starts)


@pytest.mark.parametrize("effect, form", forms())
def test_a_form_is_nested_in_the_nominal_chain(effect, form):
    if form.slot in EQUATIONS.values():
        x, run = session()
        nominal, zero, _ = _answers(form, effect.stage, x, run)
        np.testing.assert_allclose(zero, nominal, rtol=0.0, atol=2e-5 if form.name == "mass" else 1e-9)
        return
    assert any(p.zero is not None for p in form.parameters) or effect.name == "resonance"
    x, run = session()
    values = tuple(p.starts[0] if p.zero is None else p.zero for p in form.parameters)
    if effect.name == "resonance" and form.name == "series":
        values = (form.parameters[0].lower, 0.5)  # a mode far above the samples
    np.testing.assert_allclose(form.act(x, values, run), x, atol=2e-2 if form.name == "soft" else 2e-3)


@pytest.mark.parametrize("effect, form", forms())
def test_a_form_changes_something_and_stays_finite(effect, form):
    if form.slot in EQUATIONS.values():
        x, run = session(1)
        answers = [_answers(form, effect.stage, x, run, start) for start in (0, -1)]
        assert max(np.max(np.abs(changed - nominal)) for nominal, _, changed in answers) > 1e-3
        return
    x, run = session(1)
    x = np.where(np.arange(len(x)) > 550, -x, x)
    rows = [
        tuple(p.starts[min(i, len(p.starts) - 1)] for p in form.parameters)
        for i in range(max(len(p.starts) for p in form.parameters))
    ]
    found = [form.act(x.copy(), values, run) for values in rows]
    assert all(y.shape == x.shape and np.all(np.isfinite(y)) for y in found)
    assert max(np.max(np.abs(y - x)) for y in found) > 1e-6


@pytest.mark.parametrize("levels", [2, 3, 5, 40])
def test_the_steps_of_a_converter_are_read_off_its_levels(levels):
    rng, step = np.random.default_rng(levels), 0.37
    fine = step * np.interp(np.arange(4000), [0, 1500, 2500, 4000], [0.1, levels - 0.6, levels - 0.9, 0.2])
    fine += 0.01 * step * rng.standard_normal(4000)
    seen = form_of("sensor_quantization", "rounding").seen
    found, phase = seen(step * np.floor(fine / step))
    assert found == pytest.approx(step, rel=1e-3) and abs(phase) < 1e-2 * step
    assert seen(fine) is None
    assert seen(np.repeat(fine[::500], 500) + np.interp(np.arange(4000) % 500, [0, 60], [-step, 0.0])) is None


@pytest.mark.parametrize("name", ["hysteresis", "sensor_hysteresis"])
def test_the_widest_loop_of_bouc_and_wen_comes_round_within_the_range(name):
    """One that does not is a curve, and another one each way."""
    form = next(f for f in library()[name].forms if f.name == "bouc_wen")
    width = next(p for p in form.parameters if p.name == "width").upper  # of a range of 1
    x = np.r_[np.linspace(0.0, 1.0, 500), np.linspace(1.0, 0.0, 500)]
    lost = x - form.act(x, (1.0, width), Run.of((1000,), [0.0], 0.05))
    assert lost[499] > 0.95 and lost[-1] < -0.9


def test_a_reading_relaxes_from_what_is_there_or_to_it():
    """Right at once and low at rest, or high at once and right at rest: a data sheet may give either gain."""
    x, run = np.ones(4000), Run.of((4000,), [0.0], 0.05)
    read = {f.name: f.act(x, (0.3, 5.0), run) for f in library()["sensor_relaxation"].forms}
    for name in ("one_time", "spread"):
        assert read[name][0] == pytest.approx(1.3, abs=0.01) and read[name][-1] == pytest.approx(
            1.0, abs=1e-3
        )
    for name in ("fading", "fading_spread"):
        assert read[name][0] == pytest.approx(1.0, abs=0.01) and read[name][-1] == pytest.approx(
            0.7, abs=1e-3
        )


def test_a_reading_that_is_but_flat_is_no_fold():
    """A dead zone ahead of the dynamics makes it as flat."""
    folded = form_of("sensor_nonlinearity", "folded")
    flat, back = (0.5, 2.0), (0.7, 2.0)
    x = np.linspace(0.0, 2.0, 5)
    run = Run.of([5], [0.0], 0.1)
    assert np.ptp(folded.act(x, flat, run)) < 1e-12 and not folded.itself(flat, ())
    assert np.all(np.diff(folded.act(x, back, run)) < 0.0) and folded.itself(back, ())


@pytest.mark.parametrize("damping, rings", [(0.05, True), (0.25, True), (0.3, False)])
def test_a_mode_as_damped_as_it_may_be_does_not_ring(damping, rings):
    """A gauge that feels the acceleration is one of 0.3, with 20 times the motion, and no resonance."""
    den = TransferFunction([(1.0, 0.0)], [(0.4, 0.8), (1.0, 0.0)]).den
    assert form_of("resonance", "series").itself((0.2, damping), den) == rings
    assert form_of("resonance", "beside").itself((-19.5, -12.2, 0.1, damping), den) == rings
