"""``--operator continuous``: from the plan to the C and back, in every arithmetic, against s^α itself.

Red when the option is lost on the way, or the C is further from s^α than it says.
"""

import json
import math

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.control.controller import ControllerRanges
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.gains import largest_gain
from focgen.plan.response import filtered_response
from focgen.plan.truncation import largest_error
from focgen.verification.verify import compare
from tests.codegen.test_golden import CONTROLLER
from tests.controllers import simple
from tests.verification.test_random import compiled

ARITHMETICS = ("f64", "f32", "q31", "q15")
ASKED = dict(memory="exponential", operator="continuous", tolerance=5e-3)
BAND = ["--band", "0.3", "30"]
OPTIONS = ["--memory", "exponential", "--operator", "continuous", "--tolerance", "1e-2", *BAND]
RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-60.0, 60.0))
LEAD = TransferFunction([(1.32, 0.6), (1.0, 0.0)])
LAG = TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)])
BOTH = TransferFunction([(0.02, 1.4), (0.3, 0.5), (1.0, 0.0)], [(0.1, 0.9), (1.0, 0.0)])


def planned(transfer, arithmetic, **more):
    h = 0.01
    controller = simple(transfer, name=f"c_{arithmetic}", ranges=RANGES, sample_time=h)
    return build_plan(controller, arithmetic, **{**ASKED, "band": (0.3, 0.1 * math.pi / h), **more})


@pytest.mark.parametrize(
    "transfer, arithmetics",
    [
        pytest.param(LEAD, ARITHMETICS, id="lead"),
        pytest.param(BOTH, ("q15",), id="both"),
        pytest.param(BOTH, ("f64", "f32", "q31"), id="both, the others", marks=pytest.mark.long),
    ],
)
def test_c_and_reference_agree_in_every_bit(transfer, arithmetics, tmp_path):
    plans = [planned(transfer, arithmetic) for arithmetic in arithmetics]
    library = compiled(plans, tmp_path)
    for plan in plans:
        result = compare(plan, library, 3000, seed=5)
        assert result.mismatches == 0, f"{plan.name}: {result.first}"
        assert result.within, f"{plan.name}: {result.max_error} against {result.error_bound}"


@pytest.mark.parametrize("arithmetic, rounding", [("f64", 1e-9), ("f32", 1e-4), ("q31", 1e-6), ("q15", 2e-2)])
def test_the_power_as_it_is_quantised_follows_s_to_the_alpha(arithmetic, rounding):
    plan = planned(TransferFunction([(1.0, 0.6)]), arithmetic)
    omega = np.geomspace(*plan.band, 500)
    error = np.abs(filtered_response(plan, omega) / (1j * omega) ** 0.6 - 1.0).max()
    assert error <= plan.memories[0].tolerance + rounding <= ASKED["tolerance"] + rounding
    assert plan.direct.total.lsb and abs(sum(plan.direct.values)) < 1e-12 * sum(map(abs, plan.direct.values))


def test_without_a_fractional_power_nothing_is_left_out():
    plan = planned(TransferFunction([(0.1, 1.0), (1.0, 0.0)]), "f64")
    assert plan.states == 0 and plan.error_bound.truncation == 0.0


@pytest.mark.parametrize("transfer", [LEAD, BOTH, LAG], ids=["lead", "both", "lag"])
def test_no_sine_in_the_band_is_off_by_more_than_the_truncation(transfer):
    plan = planned(transfer, "f64")
    omega = np.geomspace(*plan.band, 2000)
    s, parts = 1j * omega, (transfer.num, transfer.den)
    num, den = (sum(t.coefficient * s**t.order for t in part) for part in parts)
    off = np.abs(filtered_response(plan, omega) - num / den).max()
    seen = largest_gain(plan.controller) * largest_error(plan.controller) * off
    assert seen <= plan.error_bound.truncation <= 5.0 * seen
    assert plan.error_bound.within_horizon is None


def test_by_default_the_band_is_four_decades_up_to_a_tenth_of_nyquist():
    controller = simple(LEAD, ranges=RANGES, sample_time=0.01)
    plan = build_plan(controller, "f64", **{**ASKED, "tolerance": 1.2e-2})
    np.testing.assert_allclose(plan.band, (1e-3 * math.pi, 10.0 * math.pi), rtol=1e-12)
    assert plan.states <= 8


def test_the_tolerance_of_weights_is_not_taken_for_one_of_the_response():
    controller = simple(LEAD, ranges=RANGES, sample_time=0.01, tolerance=1e-7)
    plan = build_plan(controller, "f64", memory="exponential", operator="continuous", band=(1.0, 30.0))
    assert plan.tolerance == 1e-3 and 1e-5 < plan.memories[0].tolerance <= 1e-3


@pytest.mark.parametrize(
    "more, said",
    [
        (dict(operator="tustin"), "tustin"),
        (dict(operator="gl", band=(0.3, 30.0)), "belongs to the operator continuous"),
        (dict(memory="short"), "exponential"),
        (dict(band=(-1.0, 3.0)), "does not rise"),
        (dict(band=(1.0, 1e9)), "half of the Nyquist"),
        pytest.param(dict(tolerance=2e-6), "allow a larger tolerance", marks=pytest.mark.long),
    ],
)
def test_a_plan_that_cannot_be_is_refused(more, said):
    with pytest.raises(PlanError, match=said):
        planned(TransferFunction([(1.0, 1.9)]), "f64", **more)


@pytest.mark.parametrize(
    "options, said",
    [
        (["--operator", "continuous", "--memory", "short"], "--memory exponential"),
        (["--band", "1", "20"], "--operator continuous"),
        ([*OPTIONS, "--horizon", "1000"], "--operator gl"),
        ([*OPTIONS[:-2], "30", "0.3"], "rad/s"),
        ([*OPTIONS[:-2], "1", "1e9"], "half of the Nyquist"),
        ([*OPTIONS[:-2], "nan", "30"], "rad/s"),
        ([*OPTIONS[:-2], "20", "30"], "a factor of 10"),
    ],
)
def test_the_command_refuses_what_it_cannot_use(options, said, tmp_path, capsys):
    assert main(["generate", str(CONTROLLER), "--out", str(tmp_path / "out"), *options]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1 and not (tmp_path / "out").exists()


def test_the_folder_says_what_it_follows_and_is_rendered_anew_from_that(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["generate", str(CONTROLLER), "--out", str(out), "--arithmetic", "q31", *OPTIONS]) == 0
    assert "% of s^α from 0.3 to 30 rad/s" in capsys.readouterr().out
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert (manifest["operator"], manifest["band"]) == ("continuous", [0.3, 30.0])
    assert "horizon" not in manifest and all(o["tolerance"] <= 1e-2 for o in manifest["orders"])
    assert list(manifest["error_bound"]["truncation"]) == ["operator"]
    assert "against s^α itself" in (out / "README.md").read_text(encoding="utf-8")
    assert "fitted to (jw)^b itself" in (out / "finger.c").read_text(encoding="utf-8")
    assert main(["verify", str(out), "--samples", "2000"]) == 0
    other = {"operator": "gl", "horizon": 1000}
    for edit in ({"band": [0.4, 30.0]}, other, {"band": "all"}, {"operator": 1}):
        (out / "manifest.json").write_text(json.dumps({**manifest, **edit}), encoding="utf-8")
        assert main(["verify", str(out)]) != 0
