"""How large an effect is, read off the stage on the bench, beside what its form says in closed form.

Red when a size is another than one would measure, or a family says none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.bench import Bench
from focgen.rig.effects import form_of, library
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, Rig, Signals

H, RESPONSE, SESSION = 0.01, 1.0, 200.0
LAG = TransferFunction([(1.0, 0.0)], [(0.2, 1.0), (1.0, 0.0)])
RIG = Rig("finger", H, Signals("t", "y", "u", "p", "k"), Actuator(0.5, 1.0, (2.0,)), regulator=LAG)
TOP = 3.0  # of the input
T1, T2 = 5.0, 50.0  # s of a hold


def bench_of(effect, form, *values, stage=None, rig=RIG):
    placed = Placed(effect, form_of(effect, form), stage or library()[effect].stage, values)
    inputs = TOP * np.abs(np.sin(np.linspace(0.0, 9.0, 2000)))
    inputs *= TOP / inputs.max()
    return Bench(rig, (placed,), inputs, H, 0.0, SESSION, RESPONSE * 5.0 / 3.0)


def sizes(bench):
    """By what they are, those that are read."""
    effect = library()[bench.placed[0].effect]
    return {s.what: s.read(bench) for s in effect.sizes if s.read}


def bow(curve):
    """The farthest of a curve (n,) from the line between its ends."""
    off = curve - np.linspace(curve[0], curve[-1], len(curve))
    return off[np.argmax(np.abs(off))]


# what of a pole of 30 s is left behind a lag of 0.5 s
GONE = [30.0 / 29.5 * np.exp(-t / 30.0) for t in (T1, T2)]
CREPT = 0.2 * (GONE[0] - GONE[1]) / (1.0 + 0.2 * (1.0 - GONE[0]))
LEVELS = np.linspace(0.0, TOP, 25)
CASES = [
    ("slow_regulator", "one_lag", (0.3,), {"further lag": 0.3}),
    ("slow_regulator", "two_lags", (0.3,), {"further lag": 0.6}),
    ("flow_limit", "hard", (1.5,), {"highest rate": 1.5}),
    ("leak", "laminar", (0.1,), {"share lost at the highest input": 10.0}),
    ("valve_asymmetry", "speed", (0.4,), {"time to unload over time to load": 2.5}),
    ("unloading_asymmetry", "speed", (0.5,), {"time to unload over time to load": 2.0}),
    ("valve_stiction", "play", (0.1,), {"command lost at each reversal": 0.2}),
    ("valve_stiction", "stick_slip", (0.1, 0.5), {"command lost at each reversal": 0.15}),
    ("hysteresis", "play", (0.3,), {"widest loop": 0.6}),
    ("sensor_hysteresis", "play", (0.3,), {"widest loop": 0.6}),
    ("resonance", "series", (0.5, 0.05), {"frequency": 2.0}),
    ("gain_drift", "linear", (1e-3,), {"change of the gain over the session": 20.0}),
    ("sensor_drift", "linear", (1e-3,), {"change of the zero over the session": 0.2}),
    ("creep", "pole", (0.2, 30.0), {"more from {early:g} s to {late:g} s of a hold": 100.0 * CREPT}),
    (
        "sensor_relaxation",
        "one_time",
        (0.3, 4.0),
        {"overshoot of a step": 30.0, "overshoot half gone after": 4.0 * np.log(2.0)},
    ),
]


@pytest.mark.parametrize(
    "effect, form, values, wanted", [pytest.param(*c, id=f"{c[0]}-{c[1]}") for c in CASES]
)
def test_a_size_is_what_one_would_measure(effect, form, values, wanted):
    found = sizes(bench_of(effect, form, *values))
    for what, value in wanted.items():
        assert found[what] == pytest.approx(value, rel=0.02), what


def test_a_lag_of_one_way_is_told_on_that_way():
    found = sizes(bench_of("sensor_lag", "one_way", 0.4))
    assert found["further lag"] == pytest.approx(0.0, abs=0.01)
    assert found["further lag on the way back"] == pytest.approx(0.4, rel=0.02)
    alike = sizes(bench_of("sensor_lag", "one_lag", 0.4))
    assert alike["further lag"] == pytest.approx(0.4, rel=0.02)
    assert np.isnan(alike["further lag on the way back"])


@pytest.mark.parametrize("form, values", [("quadratic", (0.05,)), ("exponential", (0.1,))])
def test_a_bow_is_the_farthest_from_the_line_between_the_ends(form, values):
    bench = bench_of("sensor_nonlinearity", form, *values)
    curve = bench.placed[0].act(LEVELS, bench._run_of(len(LEVELS), H))
    assert abs(bow(curve)) > 0.02
    assert sizes(bench)["bend of the static curve"] == pytest.approx(bow(curve), rel=0.01)


def test_softening_is_told_of_a_load_that_softens_nothing_itself():
    found = sizes(bench_of("softening", "saturating", 0.3, 2.0))
    # what bends by 6 under the largest load has grown by 0.3 (1 - exp(-3)), and by a small one by little
    grown = [1 + 0.3 * -np.expm1(-largest / 2.0) for largest in (2.0 * TOP, 0.03 * 2.0 * TOP)]
    assert found["change over the session of the gain for small loads"] == pytest.approx(
        100.0 * (grown[0] / grown[1] - 1.0), rel=0.05
    )


@pytest.mark.parametrize("input_of", [lambda x: x, lambda x: TOP + 0.0 * x, lambda x: 2.0 + x / TOP])
def test_a_drift_of_the_gain_is_told_of_any_input(input_of):
    bench = bench_of("gain_drift", "linear", 1e-3)
    bench = replace(bench, inputs=input_of(bench.inputs))
    assert sizes(bench)["change of the gain over the session"] == pytest.approx(20.0, rel=1e-6)


@pytest.mark.parametrize(
    "effect, form, values", [("leak", "turbulent", (0.1,)), ("softening", "largest", (0.2, 3.0))]
)
def test_loads_below_0_are_told_as_their_like_above(effect, form, values):
    bench = bench_of(effect, form, *values)
    ((what, told),) = sizes(bench).items()
    assert told > 1.0
    for inputs in (-bench.inputs, np.r_[0.01, -bench.inputs]):
        assert sizes(replace(bench, inputs=inputs))[what] == pytest.approx(told, rel=0.02)


def test_every_form_of_every_family_has_a_size():
    missing = []
    for effect in library().values():
        for form in effect.forms:
            values = [p.starts[-1] if not p.level else 0.3 for p in form.parameters]
            placed = bench_of(effect.name, form.name, *values, rig=replace(RIG, sensor=LAG))
            own = [s for s in effect.sizes if any(form.has(name) for name in s.own)]
            with np.errstate(all="ignore"):
                read = [s for s in effect.sizes if s.read and np.isfinite(s.read(placed))]
            if not own and not read:
                missing.append(f"{effect.name}/{form.name}")
    assert missing == []


def test_the_hold_that_creep_is_told_of_is_round_and_behind_the_response():
    for response in (0.013, 0.4, 7.0, 90.0, 2000.0):
        early, late = Bench(RIG, (), np.zeros(1), H, 0.0, 1.0, response).hold
        assert late == pytest.approx(10.0 * early)
        assert 1.5 * response < early < 6.0 * response
        assert f"{early:.0e}"[0] in "125"
