"""Own parameters of every stage: what is a little off is no effect, what is far off is one, or is said.

Red when a parameter within its uncertainty is called a fault, or one far beyond it is not.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.factors import factors
from focgen.diagnosis.problem.nominal_parameters import NominalParameters
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict import compose, conclude
from focgen.diagnosis.verdict.moves import at_the_end, far_moves
from focgen.fractional.transfer import TransferFunction
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Delays, LinearActuator, Relative, Uncertainty
from tests.diagnosis_rig import RIG, session

TAU, LATE = 0.8, 0.5  # s: regulator and sensor slow enough beside the sample time for a tenth to show
SLOW = replace(
    RIG,
    regulator=TransferFunction([(0.1, 0.0)], [(TAU, 1.0), (1.0, 0.0)]),
    sensor=TransferFunction([(1.0, 0.0)], [(LATE, 1.0), (1.0, 0.0)]),
)
ROLES = ("pressure", "curvature", "output")
BOTH, PRESSURE, NEITHER = ("pressure", "curvature"), ("pressure",), ()


def logs(regulator=(1.0, 1.0), sensor=(1.0, 1.0), **more):
    """A session whose regulator and sensor have these times the gain and the time constant of ``SLOW``."""
    r, s = (regulator[0], regulator[1] * TAU), (sensor[0], sensor[1] * LATE)
    return session(1, regulator=r, sensor=s, **more)


def named(diagnosis):
    return [[c.effect for c in f.candidates] for f in diagnosis.causes]


@pytest.mark.parametrize(
    "off, roles",
    [
        ({"sensor": (1.03, 1.0)}, BOTH),
        pytest.param({"regulator": (0.97, 1.0)}, BOTH, marks=pytest.mark.long),
        pytest.param({"regulator": (1.0, 1.1)}, BOTH, marks=pytest.mark.long),
        pytest.param({"sensor": (1.0, 0.8)}, BOTH, marks=pytest.mark.long),
        pytest.param({"regulator": (1.02, 1.15), "sensor": (0.98, 0.85)}, PRESSURE, marks=pytest.mark.long),
        ({"regulator": (1.02, 1.15), "sensor": (0.98, 0.85)}, NEITHER),
    ],
    ids=str,
)
def test_what_was_given_a_little_off_is_no_fault(off, roles):
    found = diagnose(SLOW, logs(**off, roles=roles, noise=0.003))
    assert found.verdict == "parameters" and not found.causes and not found.notes
    assert found.gap.refitted < found.gap.as_given


@pytest.mark.parametrize(
    "roles",
    [pytest.param(BOTH, marks=pytest.mark.long), pytest.param(PRESSURE, marks=pytest.mark.long), NEITHER],
)
def test_an_exact_rig_has_no_gap(roles):
    assert diagnose(SLOW, logs(roles=roles)).verdict == "none"


@pytest.mark.parametrize(
    "off, effect",
    [
        pytest.param({"regulator": (1.0, 1.6)}, "slow_regulator", marks=pytest.mark.long),
        pytest.param({"sensor": (1.0, 2.5)}, "sensor_lag", marks=pytest.mark.long),
        ({"regulator": (0.88, 1.0)}, "leak"),
    ],
    ids=str,
)
def test_what_is_slower_or_lower_than_is_usual_is_named(off, effect):
    found = diagnose(SLOW, logs(**off, noise=0.003))
    assert found.verdict == "named" and named(found) == [[effect]]


@pytest.mark.parametrize(
    "off, words",
    [
        ({"regulator": (1.0, 0.5)}, "regulator's times"),
        pytest.param({"regulator": (1.15, 1.0)}, "regulator's gain", marks=pytest.mark.long),
        pytest.param({"sensor": (0.85, 1.0)}, "sensor's gain", marks=pytest.mark.long),
    ],
    ids=str,
)
def test_what_no_effect_stands_for_is_a_parameter_and_said(off, words):
    found = diagnose(SLOW, logs(**off))
    assert found.verdict == "parameters" and len(found.notes) == 1
    assert words in found.notes[0] and "three times its uncertainty" in found.notes[0]


def test_the_note_tells_an_actuator_far_from_what_was_given():
    found = diagnose(RIG, session(1, T=2.4))
    assert found.verdict == "parameters"
    assert any("actuator's T by +8" in note for note in found.notes)
    sure = Uncertainty(actuator=Relative(0.2, 0.3, 0.1))
    found = diagnose(replace(RIG, uncertainty=sure), session(1, T=2.4))
    assert found.verdict == "parameters" and not any("actuator's T" in note for note in found.notes)


def test_the_note_tells_a_coefficient_far_from_what_was_given():
    """One of s² may move by a factor of 1.6², one of s by 1.6, a gain by 1.6; down by 0.4 each."""
    dynamics = TransferFunction([(2.0, 0.0)], [(0.01, 2.0), (0.5, 1.0), (1.0, 0.0)])
    given = replace(RIG, actuator=LinearActuator(dynamics, 0.0, 0.0))

    def notes(num, second, first):
        moved = TransferFunction([(2.0 * num, 0.0)], [(0.01 * second, 2.0), (0.5 * first, 1.0), (1.0, 0.0)])
        return far_moves(given, replace(given, actuator=LinearActuator(moved, 0.0, 0.0)))

    assert notes(1.59, 2.55, 0.41) == ()
    (note,) = notes(1.0, 45.0, 1.0)
    assert "den coefficient of s^2 by +4.4e+03 %" in note
    assert ["num" in n for n in notes(1.61, 1.0, 0.39)] == [True, False]


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_gain_or_a_time_off_as_a_whole_counts_once_whatever_the_order(order):
    """A coefficient of s^k has the time in it k times: a third order's counted six times over."""
    dynamics = TransferFunction([(2.0, 0.0)], [(0.3**k, float(k)) for k in range(order, -1, -1)])
    given = replace(RIG, actuator=LinearActuator(dynamics, 0.0, 0.0))
    nominals = NominalParameters(given, ("actuator",), "actuator", 1.0, 1.0)
    orders = np.arange(order, 0, -1.0)
    time, gain = np.r_[0.0, 0.2 * orders, 0.0], np.r_[0.2, np.zeros(order + 1)]
    once = np.log(2.0)  # of Cauchy's tails, one usual deviation off
    assert nominals.prior_penalty(nominals.start() + time) == pytest.approx(once)
    assert nominals.prior_penalty(nominals.start() + gain) == pytest.approx(once)
    assert nominals.prior_penalty(nominals.start() + time + gain) == pytest.approx(2.0 * once)
    if order > 1:
        one = np.r_[0.0, 0.4 * order, np.zeros(order)]
        assert nominals.prior_penalty(nominals.start() + one) > 2.0 * once


def test_a_refit_never_leaves_the_output_worse():
    """The pressure's gauge reads 4 % low: the regulator's refit follows it, and alone would spoil the output
    of the chain, which was right."""
    gauged = [replace(log, signals={**log.signals, "pressure": 0.96 * log["pressure"]}) for log in logs()]
    found = explain_all(SLOW, gauged, NUMBERS.nats)
    alone = compose.compose(SLOW, found[:1], gauged)
    assert found[0].nominal.vector[0] == pytest.approx(np.log(0.96), abs=0.01)
    assert alone.refitted.regulator == alone.fitted.regulator == SLOW.regulator
    whole = compose.compose(SLOW, found, gauged)
    assert compose.gap(whole.refitted, (), gauged) <= compose.gap(SLOW, (), gauged)


def test_what_the_data_do_not_show_stays_where_it_was():
    """Under noise that hides everything a time factor is known as well as before, and no better."""
    slow = [log for log in session(1, roles=()) if log.name == "stairs"]
    problem = problem_of(RIG, make(slow, "command", "output"), slow)
    noise = np.random.default_rng(0).normal(0, 1.0, len(slow[0]))
    loud = replace(problem.segment, y=problem.segment.y + noise)
    found = fit(replace(problem, segment=loud), problem.nominal(), WHITE)
    first = len(problem.nominal_start) - 2
    assert [(f.stage, f.kind) for f in problem.nominals.factors] == [
        ("regulator", "time"),
        ("sensor", "time"),
    ]
    assert np.all(np.abs(found.vector[first : first + 2]) < 0.02)
    variance = np.diag(np.linalg.pinv(found.information)) * found.sse / len(found.innovations)
    np.testing.assert_allclose(np.sqrt(variance[first : first + 2]), 0.1, rtol=0.05)


def test_the_factors_move_gain_times_and_delay_as_a_whole():
    rig = replace(SLOW, delays=Delays(0.2, 0.0, 0.1))
    own = NominalParameters(rig, ("regulator", "actuator", "sensor"), None, 1.0, 1.0)
    kinds = [(f.stage, f.kind) for f in own.factors]
    assert kinds == [(s, k) for s in ("regulator", "sensor") for k in ("gain", "time", "delay")]
    w = np.array([0.3, 2.0, 30.0])
    moved = own.put(rig, np.log([1.1, 1.5, 2.0, 0.9, 0.5, 3.0]))
    expected = 1.1 * rig.regulator.frequency_response(1.5 * w)
    np.testing.assert_allclose(moved.regulator.frequency_response(w), expected, rtol=1e-12)
    expected = 0.9 * rig.sensor.frequency_response(0.5 * w)
    np.testing.assert_allclose(moved.sensor.frequency_response(w), expected, rtol=1e-12)
    assert (moved.delays.regulator, moved.delays.sensor) == pytest.approx((0.4, 0.3))


def test_the_note_of_a_factor_is_the_factor():
    terms = [(2.0, 0.0)], [(1.0, 2.0), (3.0, 1.2), (4.0, 0.0)]
    rig = replace(RIG, regulator=TransferFunction(*terms))
    own = NominalParameters(rig, ("regulator",), None, 1.0, 1.0, wide=True)
    (gain, time) = far_moves(rig, own.put(rig, np.log([1.25, 0.4])))
    assert "regulator's gain by +25 %" in gain and "regulator's times by -60 %" in time
    assert far_moves(rig, own.put(rig, np.log([1.05, 0.8]))) == ()


@pytest.mark.long
def test_beside_a_number_that_was_moved_far_no_name_is_sure(monkeypatch):
    """Either that number or the name is wrong; what is taken for granted is there all the same."""
    logs, line = session(11, vent=0.5), "the refit moves the sensor's gain"

    def confidence(**how):
        found = diagnose(RIG, logs, pictures=False, **how)
        (first, *_) = (c for cause in found.causes for c in cause.candidates)
        return first.confidence, line in found.notes

    sure, said = confidence(only=["valve_asymmetry"])
    assert sure > 0.9 and not said
    monkeypatch.setattr(conclude, "far_moves", lambda given, refitted: (line,))
    assert confidence(only=["valve_asymmetry"]) == (sure, True)
    unsure, said = confidence()
    assert unsure <= 0.9 * 0.96 and said


@pytest.mark.parametrize("moved, said", [(0.4, "T by -60 %"), (1.6, "T by +60 %"), (0.45, "a number of")])
def test_a_number_at_the_end_of_its_range_is_said(moved, said):
    rig = replace(RIG, uncertainty=Uncertainty(actuator=Relative(0.2, 0.2, 0.1)))
    (line,) = at_the_end(rig, replace(rig, actuator=replace(rig.actuator, T=moved * rig.actuator.T)))
    assert said in line and line.endswith("or what is named beside it")


def test_beside_a_number_at_the_end_of_its_range_no_name_is_sure(monkeypatch):
    """A tip on a spring was a slow sensor at 0.95, beside a T that would have gone on below 40 %."""
    logs = session(11, vent=0.5)
    monkeypatch.setattr(Explanation, "strained", property(lambda e: True))
    found = diagnose(RIG, logs, pictures=False)
    assert found.causes[0].candidates[0].confidence < 0.7
    assert any("as far as it lets one go" in note for note in found.notes)


@pytest.mark.parametrize(
    "known, kinds",
    [((0.02, 0.1), ["gain", "time"]), ((0.0, 0.1), ["time"]), ((0.02, 0.0), ["gain"]), ((0.0, 0.0), [])],
)
def test_what_is_known_exactly_does_not_move(known, kinds):
    rig = replace(RIG, uncertainty=Uncertainty(regulator=Relative(*known)))
    assert [f.kind for f in factors(rig, ("regulator",), None)] == kinds


def test_beside_an_actuator_that_has_a_gain_there_is_no_other():
    found = factors(RIG, ("actuator", "sensor"), "actuator")
    assert [(f.stage, f.kind) for f in found] == [("sensor", "time")]


@pytest.mark.parametrize(
    "stage",
    [
        "regulator",
        pytest.param("actuator", marks=pytest.mark.long),
        pytest.param("sensor", marks=pytest.mark.long),
    ],
)
def test_a_dead_time_is_found_in_every_stage_and_as_long_as_it_is(stage):
    rig = replace(SLOW, delays=Delays(**{stage: 0.35}))
    found = diagnose(SLOW, delayed(rig))
    (cause,) = found.causes
    first, *others = [c.effect for c in cause.candidates]
    assert first == "transport_delay" and cause.stage == stage
    assert set(others) <= (
        {"sensor_lag"} if stage == "sensor" else set()
    )  # a chain of lags is nearly a delay
    fitted = cause.candidates[0].parameters["delay"]
    assert fitted.ci95[0] < 0.35 < fitted.ci95[1] and fitted.value == pytest.approx(0.35, rel=0.05)


def delayed(rig):
    """A session of ``rig``, simulated by the library, for what is late is all that matters here."""
    rng, bare = np.random.default_rng(3), session(1, roles=())
    made = simulate_session(rig, bare, (), continues=False)
    return [
        replace(log, signals={"command": log["command"], **{r: _noisy(rng, m[r]) for r in ROLES}})
        for log, m in zip(bare, made, strict=True)
    ]


def _noisy(rng, signal):
    return signal + 0.004 * np.ptp(signal) * rng.normal(size=len(signal))


@pytest.mark.parametrize("order", [1, 2])
def test_a_linear_actuator_moves_by_three_times_its_uncertainty(order):
    den = [(0.02, 2.0), (0.4, 1.0), (1.0, 0.0)][2 - order :]
    rig = replace(RIG, actuator=LinearActuator(TransferFunction([(3.0, 0.0)], den)))
    own = NominalParameters(rig, ("actuator",), "actuator", 1.0, 1.0)
    low, high = (own.put(rig, v).actuator.dynamics for v in own.bounds())
    assert high.num[0].coefficient == pytest.approx(1.6 * 3.0) and low.num[0].coefficient == pytest.approx(
        1.2
    )
    for k, given in enumerate(den[:-1]):
        power = order - k
        assert high.den[k].coefficient == pytest.approx(1.6**power * given[0])
        assert low.den[k].coefficient == pytest.approx(0.4**power * given[0])


def test_an_actuator_is_strained_three_times_its_uncertainty_off_and_may_go_further_only_if_freed():
    own = NominalParameters(RIG, ("actuator",), "actuator", 1.0, 1.0)
    (low, high), start = own.bounds(), own.start()
    given, most = RIG.actuator, own.put(RIG, np.where(np.isfinite(high), high, start)).actuator
    assert most.alpha == pytest.approx(min(1.3 * given.alpha, 1.9))
    assert most.T == pytest.approx(1.6 * given.T_at(most.alpha))
    assert not own.strained(start) and not own.strained(0.5 * (start + np.clip(low, start - 0.3, None)))
    assert own.strained(np.where(np.arange(len(start)) == 1, high, start))
    freed = replace(own, far=True)
    assert np.all(freed.bounds()[1] >= high) and freed.bounds()[1][1] > high[1]


def test_what_is_known_exactly_of_an_actuator_is_held_and_strains_nothing():
    known = replace(RIG, uncertainty=Uncertainty(actuator=Relative(0.2, 0.0, 0.0)))
    for far in (False, True):
        own = NominalParameters(known, ("actuator",), "actuator", 1.0, 1.0, far=far)
        (low, high), start = own.bounds(), own.start()
        assert np.all(low[:2] == start[:2]) and np.all(high[:2] == start[:2]) and np.all(low[2:] < high[2:])
        assert not own.strained(start)


@pytest.mark.long
def test_a_gauge_far_off_beside_an_effect_is_said_and_left_to_no_effect():
    """The sensor's filter is three times as slow, and its gain a tenth low: no effect stands for that."""
    logs = [log.between(0.0, 40.0) for log in session(7, sensor=(0.9, 0.5))[:3]]
    found = diagnose(RIG, logs, only=("sensor_lag",))
    assert [[c.effect for c in f.candidates] for f in found.causes] == [["sensor_lag"]]
    assert any("sensor's gain by -" in note for note in found.notes)
    assert found.shrink > 0.9


@pytest.mark.long
@pytest.mark.parametrize(
    "bend, sure, said",
    [(12.0, (0.5, 0.9), True), (18.0, (0.9, 1.0), False)],
)
def test_a_bend_as_large_as_the_noise_may_be_the_nominal_curves_own(bend, sure, said):
    """Both are seen clearly in these samples; the smaller is as much as an identified curve may be off by."""
    found = diagnose(RIG, session(3, bend=bend))
    first = found.causes[0].candidates[0]
    assert first.effect == "sensor_nonlinearity" and sure[0] < first.confidence < sure[1]
    assert any("identify the rig from logs of it as it should be" in note for note in found.notes) == said
