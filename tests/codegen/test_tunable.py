"""``generate --tunable``: gains and output limits in RAM, against the reference, against controllers that
were generated with the tuned values, and against C that is wrong on purpose.

Red when a tuned controller differs from one that was generated so, or a value outside the box is taken.
"""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.control.controller import GainSchedule, Tunable
from focgen.control.files import controller_text, read_controller, write_controller
from focgen.errors import ControllerError, InputError, PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import FLAG_INVALID
from focgen.plan.scenario import Params
from focgen.targets.driver import lane_of
from focgen.testing import assert_equivalent, from_c
from focgen.verification.compare import cases_of
from tests.c_code import STRICT, compiler, run
from tests.codegen.test_golden import CONTROLLER, GOLDEN, without_digests
from tests.verification.test_mutations import filter_controller

ARITHMETICS = ("f64", "f32", "q31", "q15")
BOX = Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0))
FINGER = replace(read_controller(CONTROLLER), tunable=BOX)
"""A schedule, an integrator, a recursion and a term of negative order."""
FILTER = replace(filter_controller(), tunable=Tunable((0.25, 1.5), (-3.0, -1.0), (1.0, 3.0)))
"""None of the first two."""
FINE = replace(FINGER, tunable=Tunable((0.5, 2.0), (0.0, 1e-16), (5.0, 10.0)))
"""Lower limits that are no whole number of the counts in which f32 adds up."""
CONTROLLERS = {"finger": FINGER, "filter": FILTER}


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("tunable")
    for name, controller in CONTROLLERS.items():
        for a in ARITHMETICS:
            generate(controller, root / f"{name}_{a}", a, name=f"{name}_{a}", tunable=True, selftest=True)
    generate(FINE, root / "fine_f32", "f32", name="fine_f32", tunable=True)
    for a in ("f32", "q31"):
        options = dict(memory="exponential", tolerance=1e-3, horizon=100_000)
        generate(FINGER, root / f"modes_{a}", a, name=f"modes_{a}", tunable=True, **options)
    return root


FOLDERS = [f"{name}_{a}" for name in CONTROLLERS for a in ARITHMETICS] + ["modes_f32", "modes_q31"]
FOLDERS += ["fine_f32"]
QUICK = ("finger_f64", "finger_q15", "filter_f32", "modes_q31", "fine_f32")


# --------------------------------------------------------------------------------------------------- the bits


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.long) for n in FOLDERS]
)
def test_every_bit_is_the_references(folders, name):
    """With parameters inside and outside the box at random moments; and the errors within their bounds."""
    result = focgen.verify(folders / name, samples=2000).targets["host"]
    assert result.first is None and result.sound and result.samples > 2000
    assert result.selftest == (None if name.startswith(("modes", "fine")) else 0)


WRONG = {
    "finger_q31": [
        ("        s->integral = foc_clamp", "        (void)foc_clamp"),
        ("(int64_t)s->gains[i + 1u] -", "(int64_t)s->gains[i] -"),
        ("p->u_min = FINGER_Q31_U_MIN;", "p->u_min = FINGER_Q31_U_MIN + 1;"),
        ("    if (refused == 0u) {", "    if (refused < 2u) {"),
        ("refused |= FINGER_Q31_REFUSED_U_MIN", "refused |= FINGER_Q31_REFUSED_GAIN"),
        ("    finger_q31_untune(s);\n    finger_q31_settle", "    finger_q31_settle"),
        ("s->slopes[i] = (int32_t)foc_get(from, &at, 4)", "(void)foc_get(from, &at, 4)"),
        ("s->u_max = (int32_t)foc_get(from, &at, 4)", "(void)foc_get(from, &at, 4)"),
    ],
    "finger_f32": [
        ("    finger_f32_mend(s);\n", ""),
        ("|| !finger_f32_limits_known(s)", ""),
        ("|| !foc_within_f32(gain", "|| s->starting > 1u || 0.0f * foc_within_f32(gain"),
        ("    if (!known) {\n", "    if (known < 2u) {\n"),
    ],
    "filter_f32": [("        s->output = foc_clamp_f32(", "        (void)foc_clamp_f32(")],
}


_FEW = 2


@pytest.mark.parametrize(
    "name", ["finger_q31", pytest.param("finger_f32", marks=pytest.mark.long), "filter_f32"]
)
def test_wrong_c_is_found(folders, name, tmp_path):
    _found(folders, name, WRONG[name][:_FEW], tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("name", WRONG)
def test_all_wrong_c_is_found(folders, name, tmp_path):
    _found(folders, name, WRONG[name][_FEW:], tmp_path)


def _found(folders, name, wrongs, tmp_path):
    for i, (right, wrong) in enumerate(wrongs):
        folder = tmp_path / str(i)
        shutil.copytree(folders / name, folder)
        source = folder / f"{name}.c"
        assert right in source.read_text(), right
        source.write_text(source.read_text().replace(right, wrong, 1))
        assert not focgen.verify(folder, samples=4000, edited=True).agrees, right


def test_without_the_option_the_c_is_as_without_the_box(tmp_path):
    """But for the digest of the file that it was made from, and what that digest names."""

    def text(controller, folder):
        generate(controller, folder, "q15")
        found = {p.name: p.read_text() for p in folder.glob("*.[ch]")}
        return {name: re.sub(r"0x[0-9a-f]{16}u|[0-9a-f]{64}", "", content) for name, content in found.items()}

    with_box, without = text(FINGER, tmp_path / "a"), text(replace(FINGER, tunable=None), tmp_path / "b")
    assert with_box == without and len(with_box) == 4
    manifests = [json.loads((tmp_path / name / "manifest.json").read_text()) for name in "ab"]
    assert manifests[0]["proofs"] == manifests[1]["proofs"] and "tunable" not in manifests[0]


@pytest.mark.parametrize("form", ["q15", "f32"])
def test_the_text_is_the_golden_one(form, tmp_path, request):
    """Update with ``pytest --update-golden``; read the difference."""
    made = tmp_path / "finger.toml"
    write_controller(FINGER, made)
    options = ["--arithmetic", form, "--name", f"finger_{form}", "--tunable"]
    assert main(["generate", str(made), "--out", str(tmp_path / "out"), *options]) == 0
    files = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir() if p.is_file()}
    kept = ("README.md", f"finger_{form}.c", f"finger_{form}.h")
    found = {name: files[name] for name in kept}
    found["manifest.json"] = without_digests(files)
    folder = GOLDEN / f"finger_tunable_{form}"
    if request.config.getoption("--update-golden"):
        write_files(folder, found)
    assert {p.name: p.read_text() for p in folder.iterdir()} == {n: c.decode() for n, c in found.items()}
    assert files["foc_tune.h"] == (GOLDEN.parents[1] / "c_runtime" / "foc_tune.h").read_bytes()


@pytest.mark.parametrize("name", ["gcc", pytest.param("clang", marks=pytest.mark.long)])
def test_it_compiles_without_a_warning(folders, name, tmp_path):
    command = compiler(name)
    for folder in ("finger_q15", "modes_f32", "filter_q31", "filter_f64"):
        source = folders / folder / f"{folder}.c"
        run(*command, *STRICT, "-O2", "-c", source, "-o", tmp_path / "x.o")
        test = source.with_name(f"{folder}_selftest.c")
        if test.exists():
            run(*command, *STRICT, "-O2", "-c", test, "-o", tmp_path / "x.o")


# ----------------------------------------------------------------------------------------------- what it does


def _signals(seed: int, count: int = 600) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors that drive the output from limit to limit."""
    rng = np.random.default_rng(seed)
    slow = 0.008 * np.sign(np.sin(np.arange(count) / 40.0))
    meas = np.clip(0.01 + slow + rng.normal(0.0, 0.001, count), 0.0, 0.02)
    return np.full(count, 0.01), meas, rng.uniform(0.0, 0.25, count)


@pytest.mark.parametrize(
    "name", ["finger_f64", "finger_q31", pytest.param("modes_q31", marks=pytest.mark.long)]
)
def test_tuned_it_is_the_controller_that_has_these_gains_and_limits(folders, name, tmp_path):
    """Another one, generated without any tuning: the integral's clamp of the terms of negative order, which
    the box widens, is not reached here.
    """
    factors = (0.7, 1.9, 1.2)
    gains = tuple(f * g for f, g in zip(factors, FINGER.gain.gains))
    ranges = replace(FINGER.ranges, output=(0.5, 7.0))
    fixed = replace(
        FINGER, tunable=None, gain=GainSchedule(FINGER.gain.breakpoints, gains), ranges=ranges, name="other"
    )
    options = dict(memory="exponential", tolerance=1e-3, horizon=100_000) if "modes" in name else {}
    generate(fixed, tmp_path / "fixed", "f64", **options)
    tuned, other = focgen.load(folders / name), focgen.load(tmp_path / "fixed")
    tuned.tune(Params(factors, 0.5, 7.0))
    for one in (tuned, other):
        one.reset(0.01, 0.0095, 3.0)
    signals = _signals(1)
    seen, expected = tuned.run(*signals), other.run(*signals)
    assert expected.min() == 0.5 and expected.max() == 7.0 and np.std(expected) > 1.0
    assert np.abs(seen - expected).max() < (1e-11 if "f64" in name else 2e-4)


@pytest.mark.parametrize(
    "arithmetic", ["f32", "q15", *(pytest.param(a, marks=pytest.mark.long) for a in ("f64", "q31"))]
)
def test_a_gain_changes_without_a_bump_and_a_narrower_limit_moves_the_output_at_once(folders, arithmetic):
    """At rest the output stays where it is whatever the gain becomes; with an error its rate follows."""
    one = focgen.load(folders / f"finger_{arithmetic}")
    count = one.plan.output.lsb if arithmetic[0] == "q" else 1e-6
    default = one.default()
    assert default == Params((1.0, 1.0, 1.0), 0.0, 10.0) and one.check(default) == 0
    one.reset(0.01, 0.01, 8.0)
    before = one.step(0.01, 0.01, 0.1)
    one.tune(replace(default, gain=(2.0, 2.0, 2.0)))
    assert one.step(0.01, 0.01, 0.1) == before
    rates = []
    for factor in (0.5, 1.0, 2.0):
        one.reset(0.01, 0.0099, 5.0)
        one.tune(replace(default, gain=(factor,) * 3))
        outputs = one.run(np.full(50, 0.01), np.full(50, 0.0099), np.full(50, 0.1))
        rates.append(outputs[-1] - 5.0)
        assert np.abs(np.diff([5.0, *outputs])).max() < 0.05
    assert rates[0] > 20 * count and np.allclose(np.array(rates) / rates[1], [0.5, 1.0, 2.0], rtol=0.1)
    one.reset(0.01, 0.01, 8.0)
    one.tune(replace(default, u_max=6.0))
    u, flags = one.run(np.full(2, 0.01), np.full(2, 0.01), np.full(2, 0.1), with_flags=True)
    assert np.abs(u - 6.0).max() <= count and all(flags & 1)
    one.reset(0.01, 0.01, 9.0)  # keeps the parameters, and so does track
    assert abs(one.step(0.01, 0.01, 0.1) - 6.0) <= count
    one.track(9.0)
    assert abs(one.step(0.01, 0.01, 0.1) - 6.0) <= count
    one.init()  # brings the default ones back
    one.track(9.0)
    assert abs(one.step(0.01, 0.01, 0.1) - 9.0) <= count


@pytest.mark.parametrize("arithmetic", ["f32", "f64"])
def test_a_damaged_gain_leaves_one_step_out(folders, arithmetic):
    """It is within the box, and the slope from it is one of parameters; where that leads to is not."""
    one = focgen.load(folders / f"finger_{arithmetic}")
    gains = np.array(one.plan.tuning.nominal, np.float32 if arithmetic == "f32" else np.float64)
    content = one._machine.content(one._state)
    assert content.count(gains.tobytes()) == 1
    damaged = gains.copy()
    damaged[1] = 0.9
    one._state = one._machine.state(content.replace(gains.tobytes(), damaged.tobytes()))
    one.reset(0.01, 0.0099, 3.0)
    u, flags = one.run(np.full(20, 0.01), np.full(20, 0.0099), np.full(20, 0.199), with_flags=True)
    assert flags.tolist() == [FLAG_INVALID] + [0] * 19
    again = one.new()
    again.reset(0.01, 0.0099, 3.0)
    assert u[1:].tolist() == again.run(np.full(19, 0.01), np.full(19, 0.0099), np.full(19, 0.199)).tolist()


@pytest.mark.parametrize(
    "name", ["finger_q15", "finger_f32", pytest.param("filter_f64", marks=pytest.mark.long)]
)
def test_what_is_refused_changes_nothing(folders, name):
    one = focgen.load(folders / name)
    box, output = one.plan.controller.tunable, one.plan.controller.ranges.output
    one.tune(replace(one.default(), u_max=box.output_high[0]))
    state = one._machine.content(one._state)
    n = len(one.default().gain)
    for bits, params in (
        (1, Params((1.0,) * (n - 1) + (box.gain[1] * 1.01,), *output)),
        (1, Params((box.gain[0] * 0.98,) * n, *output)),
        (2, Params((1.0,) * n, box.output_low[1] + 0.1, output[1])),
        (4, Params((1.0,) * n, output[0], box.output_high[0] - 0.1)),
        (7, Params((9.0 * box.gain[1],) * n, output[1], output[0])),
    ):
        assert one.check(params) == bits
        with pytest.raises(InputError, match="outside the box"):
            one.tune(params)
    if name != "finger_q15":
        assert one.check(Params((float("nan"),) * n, float("inf"), float("nan"))) == 7
    assert one._machine.content(one._state) == state
    with pytest.raises(InputError, match="one for each gain"):
        one.check(Params((1.0,) * (n + 1), *output))


@pytest.mark.long
def test_a_candidate_is_tuned_too(folders, tmp_path):
    folder = folders / "finger_q15"
    own = from_c([folder / "finger_q15.c"], prefix="finger_q15")
    assert assert_equivalent(folder, own, samples=1000).flags
    assert assert_equivalent(folder, own, within="bound", samples=1000).share < 1.0
    shutil.copytree(folder, tmp_path / "edited")
    source = tmp_path / "edited" / "finger_q15.c"
    source.write_text(source.read_text().replace("s->u_max = p->u_max;", ""))
    with pytest.raises(AssertionError, match=r"(?s)edited is not .*reference u"):
        assert_equivalent(folder, tmp_path / "edited", samples=2000)


def test_a_controller_without_parameters_says_so(tmp_path):
    generate(FINGER, tmp_path, "q31")
    one = focgen.load(tmp_path)
    assert not one.tunable
    for call in (one.default, lambda: one.tune(Params((1.0,), 0.0, 1.0))):
        with pytest.raises(InputError, match="generate it with --tunable"):
            call()


# --------------------------------------------------------------------------------------------------- the file


def test_the_box_is_read_back(tmp_path):
    write_controller(FINGER, tmp_path / "c.toml")
    assert read_controller(tmp_path / "c.toml") == FINGER
    part = replace(FINGER, tunable=Tunable((1.0, 1.0), (0.0, 0.0), (4.0, 10.0)))
    assert "output_low" not in controller_text(part)
    (tmp_path / "part.toml").write_text(controller_text(part))
    assert read_controller(tmp_path / "part.toml") == part
    assert build_plan(part, "q31", tunable=True).tuning.low == (0, 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gain = [1.5, 2.0]", "with 1 among them"),
        ("gain = [0.0, 2.0]", "with 1 among them"),
        ("gain = 2.0", "list of finite numbers"),
        ("output_high = [5.0, 9.0]", "end at 10"),
        ("output_low = [1.0, 2.0]", "begin at 0"),
        ("output_low = [0.0, 6.0]\noutput_high = [5.0, 10.0]", "cannot cross"),
        ("", "names nothing"),
        ("gains = [0.5, 2.0]", "unknown key 'gains'"),
    ],
)
def test_a_box_that_cannot_be_is_named(text, said, tmp_path):
    base = controller_text(replace(FINGER, tunable=None))
    (tmp_path / "c.toml").write_text(f"{base}\n[tunable]\n{text}\n")
    with pytest.raises(ControllerError, match=re.escape(said)) as raised:
        read_controller(tmp_path / "c.toml")
    assert "[tunable]" in str(raised.value)


def test_a_breakpoint_that_is_never_reached_has_no_factor(tmp_path):
    far = replace(FINGER, gain=GainSchedule((0.05, 0.1, 0.3), FINGER.gain.gains))
    (tmp_path / "c.toml").write_text(controller_text(far))
    with pytest.raises(ControllerError, match="breakpoint 0.3, beyond ranges.schedule"):
        read_controller(tmp_path / "c.toml")


def test_one_that_is_built_in_python_has_a_factor_to_each_breakpoint_in_the_range():
    """In integers, which hold no others: the scenarios of ``verify`` bring as many as the C takes."""
    far = replace(FINGER, gain=GainSchedule((0.05, 0.1, 0.3, 0.4), (*FINGER.gain.gains, 1.0)))
    plan = build_plan(far, "q31", tunable=True)
    high = far.ranges.schedule[1]
    assert plan.controller.gain.breakpoints == (0.05, 0.1, high) and len(plan.tuning.nominal) == 3
    assert plan.controller.gain(high) == pytest.approx(far.gain(high), rel=1e-12)
    for case in cases_of(plan, 80, 0).cases:
        assert {len(tune.params.gain) for tune in case.scenario.tunes} <= {3}
        assert lane_of(plan, case.scenario, 0).given.shape[1] == 4 + 3 + 3


def test_what_cannot_be_planned_is_refused(tmp_path, capsys):
    with pytest.raises(PlanError, match="no \\[tunable\\], which --tunable needs"):
        build_plan(replace(FINGER, tunable=None), "q31", tunable=True)
    wide = replace(FINGER, tunable=replace(BOX, gain=(1e-3, 900.0)))
    with pytest.raises(PlanError, match="more than 16 bits can hold"):
        build_plan(wide, "q15", tunable=True)
    write_controller(replace(FINGER, tunable=None), tmp_path / "c.toml")
    assert main(["generate", str(tmp_path / "c.toml"), "--out", str(tmp_path / "out"), "--tunable"]) == 2
    assert "--tunable needs" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_no_bit_of_a_tuned_state_that_flips_holds_the_output_for_ever(tmp_path):
    """Red where a part of the state stands beside another that says something else, and neither gives way."""
    focgen.generate(FINGER, tmp_path, "f32", name="finger", tunable=True)
    one, rng = focgen.load(tmp_path), np.random.default_rng(11)
    inputs = [rng.uniform(0.0, FINGER.ranges.reference[1], 40) for _ in range(2)]
    inputs += [rng.uniform(0.05, 0.2, 40)] if one.scheduled else []
    low, high = FINGER.ranges.output
    one.tune(replace(one.default(), u_max=0.5 * sum(FINGER.tunable.output_high)))
    one.run(*inputs)
    good = one._machine.content(one._state)
    for bit in range(8 * len(good)):
        flipped = bytearray(good)
        flipped[bit // 8] ^= 1 << bit % 8
        damaged = one.copy()
        damaged._state = damaged._machine.state(bytes(flipped))
        u, flags = damaged.run(*inputs, with_flags=True)
        assert np.all((u >= low) & (u <= high)) and not flags[-1] & FLAG_INVALID, bit
