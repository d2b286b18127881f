"""The bodies that the physics engine moves do what they are called, by statics and equations of motion.

Red when a body moves otherwise than statics or its equation say.
"""

import sys
from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import InputError
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.engine.bodies import Body
from focgen.trials.engine.forms import ADDED, BODY, GOVERNED, HANDS, Angles
from focgen.trials.engine.nominal import believed, fitted
from focgen.trials.judging import judge
from focgen.trials.machine import Setting
from focgen.trials.make import make
from focgen.trials.vocabulary import VOCABULARY

H, TIME = 0.0025, 0.4
RIG = Rig("joint", 0.02, Signals("t", "y", command="u", pressure="p"), Actuator(TIME, 1.0, (1.0,)))
HINGE, CHAIN = Body(1, TIME, 0.01), Body(5, TIME, 0.01)
HOLD = np.repeat([0.4, 0.8, 0.4, 0.0], 1600)  # 4 s each: ten times the body's
ENDS = [1599, 3199, 4799, 6399]


def test_without_the_engine_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match="pip install 'focgen\\[engine\\]'"):
        make(tmp_path / "cases", cases=1, suite="engine")
    assert not (tmp_path / "cases").exists()


def test_every_form_is_made_by_somebody_and_every_stage_has_its_effects():
    forms = {form.name for group in (BODY, HANDS) for row in group.values() for form in row}
    assert forms == {*ADDED, *GOVERNED}
    assert {e for e, (stage, _) in VOCABULARY.items() if stage == "actuator"} <= set(BODY)


def test_amplitudes_keep_springs_that_can_hold_the_load():
    rng, angles = np.random.default_rng(0), Angles(0.8, TIME, 300.0)
    for _ in range(20):
        for form in BODY["gain_nonlinearity"]:
            first, second = form.draw(rng, angles)(form.high)
            y = np.linspace(0.0, 2.0, 400)
            held = {"polynomial_spring": y * (1 + first * y + second * y**2)}
            held["heavy_tip"] = y + first * (np.sin(y + second) - np.sin(second))
            assert held[form.name].max() > 0.8


def test_the_owner_finds_the_line_that_is_there_and_trusts_data_sheets_that_are_off():
    rng = np.random.default_rng(1)
    pressure = np.repeat(rng.uniform(0, 1, 20), 100)
    y = np.zeros(2000)
    for k in range(1, 2000):
        y[k] = y[k - 1] + 0.005 / 0.3 * (2.0 * pressure[k - 1] - y[k - 1])
    found = fitted([pressure], [y], 0.005, 1, 0.5)
    assert found.T == pytest.approx(0.3, rel=0.03) and found.gain[0] == pytest.approx(2.0, rel=1e-3)
    rig = replace(RIG, sensor=TransferFunction([(10.0, 0.0)], [(1.0, 1.0), (10.0, 0.0)]))
    off = believed(rig, rng).sensor.den[0].coefficient / believed(rig, rng).sensor.den[-1].coefficient
    assert 0.02 < abs(off * 10.0 - 1.0) < 0.12


def moved(body, *settings):
    pytest.importorskip("mujoco")
    from focgen.trials.engine.machine import EngineRig, Moved

    return Moved(EngineRig(RIG, body, 1.0, 1.0), [Setting(*s) for s in settings], H)


@pytest.mark.parametrize("body", [HINGE, CHAIN])
def test_a_healthy_body_is_a_lag_of_its_own_time(body):
    made = moved(body).run(HOLD, 0.0)
    np.testing.assert_allclose(made[ENDS], [0.4, 0.8, 0.4, 0.0], atol=2e-3)
    t = np.arange(1600) * H
    np.testing.assert_allclose(made[:1600], 0.4 * (1 - np.exp(-t / TIME)), atol=0.01)


@pytest.mark.parametrize("body", [HINGE, CHAIN])
def test_what_is_added_holds_the_load_where_statics_says(body):
    assert moved(body, ("polynomial_spring", (0.5, 1.0))).run(HOLD, 0.0)[ENDS[1]] == pytest.approx(
        np.real(next(r for r in np.roots([1.0, 0.5, 1.0, -0.8]) if abs(r.imag) < 1e-9)), rel=5e-3
    )
    assert moved(body, ("joint_limit", (0.5,))).run(HOLD, 0.0)[ENDS[1]] == pytest.approx(0.5, abs=0.02)
    assert moved(body, ("bumper", (0.5, 2.0))).run(HOLD, 0.0)[ENDS[1]] == pytest.approx(0.6, abs=5e-3)
    low, high, down, rest = moved(body, ("friction_loss", (0.1,))).run(HOLD, 0.0)[ENDS]
    assert (low, high, down, rest) == pytest.approx((0.3, 0.7, 0.5, 0.1), abs=0.02)
    low, high, down, rest = moved(body, ("backlash", (0.1,))).run(HOLD, 0.0)[ENDS]
    assert (low, high, down, rest) == pytest.approx((0.3, 0.7, 0.5, 0.1), abs=0.02)


def test_a_heavy_tip_hangs_at_rest_and_pulls_with_the_sine():
    made = moved(HINGE, ("heavy_tip", (0.5, 0.3))).run(HOLD, 0.0)
    y = made[ENDS[1]]
    assert made[0] == pytest.approx(0.0, abs=1e-4)
    assert y + 0.5 * (np.sin(y + 0.3) - np.sin(0.3)) == pytest.approx(0.8, abs=5e-3)


def test_a_preload_leaves_a_dead_zone_and_a_check_damper_slows_one_way():
    made = moved(HINGE, ("preloaded_stop", (0.2,))).run(HOLD, 0.0)
    assert made[ENDS[:2]] == pytest.approx([0.2, 0.6], abs=0.01)
    slow, plain = moved(HINGE, ("check_damper", (2.0, 0.01))).run(HOLD, 0.0), moved(HINGE).run(HOLD, 0.0)
    np.testing.assert_allclose(slow[:3200], plain[:3200], atol=2e-3)
    assert slow[3200 + 240] - 0.4 > 1.5 * (plain[3200 + 240] - 0.4)


def test_wear_outlives_an_experiment_and_a_soaking_link_creeps():
    worn = moved(HINGE, ("worn_by_angle", (0.3, 0.5)))
    first, again = worn.run(HOLD, 0.0), worn.run(HOLD, 60.0)
    assert again[ENDS[0]] > first[ENDS[0]] + 0.01
    assert again[ENDS[1]] == pytest.approx(first[ENDS[1]], abs=5e-3)
    made = moved(HINGE, ("soaking_link", (0.2, 10.0))).run(np.full(8000, 0.5), 0.0)
    t = 7999 * H
    assert made[-1] == pytest.approx(0.5 + 0.1 * (1 - np.exp(-t / 10.0)), abs=5e-3)


def test_a_body_that_no_spring_holds_is_seen_to_be_lost(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert np.all(np.isinf(moved(HINGE, ("polynomial_spring", (0.0, -2.0))).run(np.full(4000, 1.0), 0.0)))
    assert not list(tmp_path.iterdir())  # where the engine would leave a file of warnings


def test_dry_friction_may_be_called_a_play_but_a_play_is_no_friction():
    def judged(truth: str, said: list[str]):
        label = {"kind": "single", "truth": [{"effect": truth, "stage": "actuator", "form": "f"}]}
        label["truth"][0] |= {"visible": True, "severity": "mid"}
        candidates = [{"effect": name, "confidence": 0.9 / (i + 1)} for i, name in enumerate(said)]
        return judge("0001", label, {}, {"verdict": "set", "causes": [{"candidates": candidates}]})

    assert judged("friction", ["hysteresis"]).top_right and judged("friction", ["hysteresis"]).in_set
    assert judged("friction", ["friction", "hysteresis"]).top_right
    assert not judged("friction", ["hysteresis", "friction"]).top_right
    assert not judged("hysteresis", ["friction"]).in_set
