"""A family against its rivals: as likely as all of its forms that will do, and only where it is itself.

Red when the form that fits best speaks for its family alone, when an effect is weighed without another one
that came back from a bad fit, or when a name stands for what it does not mean.
"""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from focgen.diagnosis.belief.standing import any_of
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.hypotheses.rivals import at_its_least, left_out
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict import summary
from focgen.diagnosis.verdict.cautions import the_rest
from focgen.diagnosis.verdict.improvement import Improvement
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of, library
from focgen.rig.rig import LinearActuator, Rig, Signals
from tests.diagnosis_rig import RIG, session

H = 0.02


def test_a_family_is_as_likely_as_its_forms_together():
    assert any_of([7.0]) == 7.0
    assert any_of([7.0, 7.0 - np.log(2.0)]) == pytest.approx(7.0 + np.log(1.5))
    assert any_of([3.0, 40.0, -5.0]) == pytest.approx(40.0)
    assert any_of([7.0, 7.0, 7.0 - 1e-6]) == 7.0  # a limit of one sign and of both are one


def test_an_effect_is_left_out_of_the_best_that_is_known_without_it():
    """A fit that set out from a hopeless place is no measure of what the other effect adds."""
    logs = session(4, noise=0.004)
    forms = [("valve_stiction", "stick"), ("leak", "laminar")]
    first, second = (CandidateEffect(e, form_of(e, f), "regulator") for e, f in forms)
    problem = problem_of(RIG, make(logs, "command", "pressure"), logs)
    alone, both = problem.with_candidates([first]), problem.with_candidates([first, second])
    far = np.r_[problem.nominal(), 0.5, 0.1]  # it jumps from sample to sample: no slope leads to a small band
    stuck = fit(both, far, WHITE, 0)
    known = fit(alone, np.r_[problem.nominal(), 0.003], WHITE)
    lost, found = (left_out(stuck, [second], WHITE, k) for k in ((), (known,)))
    assert lost.sse > 10.0 * known.sse
    assert found.sse == pytest.approx(known.sse, rel=1e-3) and found.problem.candidates == (first,)


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 4))])
def test_what_stays_is_fitted_to_its_least_wherever_the_effect_had_taken_it(seed):
    """A fit that is stopped on its way leaves more, and what was left out seems to explain that."""
    logs = session(4, noise=0.004)
    forms = [("creep", "power", "actuator"), ("gain_drift", "linear", "actuator")]
    first, second = (CandidateEffect(e, form_of(e, f), stage) for e, f, stage in forms)
    both = problem_of(RIG, make(logs, "pressure", "curvature"), logs).with_candidates([first, second])
    low, high = both.bounds()
    anywhere = np.nan_to_num(low + (high - low) * np.random.default_rng(seed).uniform(size=len(low)))
    alone = at_its_least(left_out(fit(both, anywhere, WHITE, 0), [second], WHITE), WHITE)
    assert alone.problem.candidates == (first,)
    assert fit(alone.problem, alone.vector, WHITE, 200).sse > 0.999 * alone.sse


def test_a_mass_that_does_not_swing_is_no_resonance():
    itself, turn = form_of("resonance", "mass").itself, 2.0 * np.pi
    lag = [SimpleNamespace(coefficient=c, order=o) for c, o in ((2.0, 1.0), (1.0, 0.0))]
    damped = [SimpleNamespace(coefficient=c, order=o) for c, o in ((1.0, 2.0), (2.0, 1.0), (1.0, 0.0))]
    # damping 2/(2 sqrt(mass)): 1.0, 0.89 and 0.67; of the second order, beside its own mass of 1
    assert [itself((turn * np.sqrt(m),), lag) for m in (1.0, 1.27, 2.25)] == [False, False, True]
    assert [itself((turn * np.sqrt(m),), damped) for m in (0.27, 1.25)] == [False, True]


def test_a_creep_is_slow_beside_the_response_whichever_its_form():
    pole, two = (form_of("creep", name) for name in ("pole", "two_poles"))
    assert two.parameters[-1].lower / 5.0 >= pole.parameters[-1].lower


MOTOR = Rig(
    "motor",
    H,
    Signals("t", "w", "u"),
    LinearActuator(TransferFunction([(1.9, 0.0)], [(0.63, 1.0), (1.0, 0.0)])),
)


def spun(command: np.ndarray, friction: float) -> np.ndarray:
    """The speed of 0.6 w' + w + friction sign(w) = 2 u, held at 0 below it, in steps of a tenth of a
    sample."""
    speed, found = 0.0, []
    for u in command:
        for _ in range(10):
            drive = 2.0 * u - speed
            way = np.sign(speed) if speed else np.sign(drive)
            force = friction * way if speed else np.clip(drive, -friction, friction)
            then = speed + H / 10.0 / 0.6 * (drive - force)
            speed = 0.0 if then * speed < 0.0 else then
        found.append(speed)
    return np.array(found)


def turned(friction: float) -> list[Experiment]:
    rng, t = np.random.default_rng(2), np.arange(1500) * H
    steps = np.repeat([0.0, 3.0, -2.0, 1.0, 5.0, -5.0, 0.5, -1.0, 4.0, 0.0], 150)
    logs = []
    for i, command in enumerate((steps, 5.0 * np.sin(0.8 * t), 2.0 * np.sin(0.3 * t))):
        speed = spun(command, friction) + 0.05 * rng.normal(size=len(command))
        logs.append(Experiment(str(i), H, {"command": command, "output": speed}, start=60.0 * i))
    return logs


def test_friction_of_what_turns_is_in_the_set():
    """It stands against the speed that is read: no log tells it from a seat that a spring is pressed to."""
    found = diagnose(MOTOR, turned(1.0))
    (cause,) = found.causes
    assert {c.effect for c in cause.candidates} == {"friction", "dead_zone"}
    assert all(c.confidence < 0.6 for c in cause.candidates)


@pytest.mark.parametrize("shift, there", [(0.0, True), (6.0, False)])
def test_what_asks_for_both_ways_is_tried_where_the_input_goes_both(shift, there):
    logs = [replace(log, signals={k: v + shift for k, v in log.signals.items()}) for log in turned(0.0)]
    tried = {c.form for c in candidates_for(make(logs, "command", "output"), MOTOR)}
    asking = [f for e in library().values() for f in e.forms if f.both_ways]
    assert len(asking) == 6 and [f in tried for f in asking] == [there] * 6


def passed(num: float, den: tuple[float, ...], x: np.ndarray) -> np.ndarray:
    """What num/den makes of a signal held from sample to sample."""
    up, down, _ = cont2discrete(([num], den), H, "zoh")
    return lfilter(up.ravel(), down, x)


def powered(lags: tuple[float, ...], limit: float = np.inf) -> list[Experiment]:
    """The motor behind a drive whose current is logged, and ends softly either way."""
    rng, logs = np.random.default_rng(7), []
    for log in turned(0.0):
        current = passed(0.5, lags, log["command"])
        current = current / (1.0 + np.abs(current / limit) ** 7) ** (1.0 / 7.0)
        made = {"pressure": current, "output": passed(1.9, (0.63, 1.0), current)}
        noisy = {k: v + 0.004 * np.ptp(v) * rng.normal(size=len(v)) for k, v in made.items()}
        logs.append(replace(log, signals={"command": log["command"], **noisy}))
    return logs


def driven(*den: tuple[float, float]) -> Rig:
    drive = TransferFunction([(0.5, 0.0)], [*den, (1.0, 0.0)])
    return replace(MOTOR, regulator=drive, signals=Signals("t", "w", "u", pressure="p"))


@pytest.mark.long
def test_a_limit_that_is_rounded_either_way_is_no_bent_gain():
    (cause,) = diagnose(driven((0.12, 1.0)), powered((0.12, 1.0), 1.8), pictures=False).causes
    first = cause.candidates[0]
    assert (first.effect, first.form) == ("supply_saturation", "soft_both_ways") and first.confidence > 0.9


@pytest.mark.parametrize(
    "damping", [0.85, pytest.param(0.9, marks=pytest.mark.long), pytest.param(1.1, marks=pytest.mark.long)]
)
def test_a_damping_a_tenth_off_is_no_effect(damping):
    """What gives a regulator's bandwidth gives its damping no better."""
    rig = driven((0.01, 2.0), (0.12 * damping, 1.0))
    assert diagnose(rig, powered((0.01, 0.12, 1.0))).verdict in ("none", "parameters")


@pytest.mark.parametrize("rounded", [False, True])
@pytest.mark.parametrize("explained, more", [(0.5, False), (0.8, True)])
def test_effects_that_leave_more_than_they_close_stand_for_something_else(
    explained, more, rounded, monkeypatch
):
    """Steps of a rounding leave what they leave: no model has them where they fall."""
    monkeypatch.setattr(summary, "is_rounded", lambda causes: rounded)
    squares = {"refitted": np.array([1.0]), "explained": np.array([explained])}
    made = summary.Summary(None, [(SimpleNamespace(causes=(), beside={}), None)], {}, squares, 0.1, None)
    assert made.more_is_left == more
    assert made.stands_for_more == (more and not rounded)
    assert ["2.8 times the noise" in note for note in the_rest(made)] == [True] * (more and not rounded)


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("foretold, follows", [(0.8, False), (0.5, True), (-0.5, True)])
def test_effects_that_foretell_little_of_what_they_close_follow_the_logs(
    foretold, follows, goes_on, monkeypatch
):
    """Nothing foretells how a drift goes on."""
    monkeypatch.setattr(summary, "drifting", lambda e: goes_on)
    made = closing(1.1, 0.1, lost=1.0 - foretold)
    assert made.follows_these_logs == (follows and not goes_on)
    closed = {0.5: "closes 100% .* 50% in", -0.5: "closes 100% .* nothing in"}.get(foretold, "closes")
    assert [bool(re.search(closed, note)) for note in the_rest(made)] == [True] * made.follows_these_logs


@pytest.mark.parametrize("refitted, explained", [(0.14, 0.1), (1.0, 1.1), (0.05, 0.1), (0.1, 0.1)])
def test_what_is_lost_of_little_is_the_noises(refitted, explained, monkeypatch):
    """In a gap as small as noise, or of what closes nothing."""
    monkeypatch.setattr(summary, "drifting", lambda e: False)
    assert not closing(refitted, explained, lost=0.9).follows_these_logs


@pytest.mark.parametrize("pace", [0.0, 30.0])
def test_where_errors_add_up_parts_foretell_nothing(pace, monkeypatch):
    monkeypatch.setattr(summary, "drifting", lambda e: False)
    assert closing(1.1, 0.1, lost=0.9, pace=pace).follows_these_logs == (pace == 0.0)


def closing(refitted, explained, lost, pace=0.0):
    """One cause that closes so much of a gap above a noise of 0.1."""
    squares = {"refitted": np.array([refitted]), "explained": np.array([explained])}
    total = Improvement(0.7, (0.0, 1.0), lost)
    found = SimpleNamespace(causes=(), beside={}, segment=SimpleNamespace(pace=pace))
    return summary.Summary(None, [(found, None)], {}, squares, 0.1, total)
