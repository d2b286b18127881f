"""Proposed experiments: what they do to the rig, and which of them is chosen.

Red when an experiment is proposed that leaves the rig's ranges, or that would not tell the rivals apart.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lsim

from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.proposals import next_experiment
from focgen.diagnosis.proposals.candidate_rigs import CandidateRig, Part
from focgen.diagnosis.proposals.limits import Bounds, InputLimits, bounds_of, limits_of
from focgen.diagnosis.proposals.menu import Choice, menu
from focgen.diagnosis.proposals.next_experiment import (
    _all_told,
    _allowed,
    _best,
    _in_a_row,
    _Option,
    _Question,
    _showing,
    _with_a_further_signal,
)
from focgen.diagnosis.proposals.separation import alone, in_session
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.response import integrations, response_time
from focgen.rig.rig import LinearActuator, Ranges, Rig, Signals
from tests.diagnosis_rig import RIG, session

AXIS = Rig(
    "axis",
    0.01,
    Signals("t_s", "q_m", "F_N"),
    LinearActuator(TransferFunction([(1.0, 0.0)], [(95.0, 2.0), (203.0, 1.0)])),
)


def axis_log(force, seconds=25.0, low=0.0, high=0.25):
    """A carriage that was moved between ``low`` and ``high`` m, by at most ``force`` N."""
    t = np.arange(0.0, seconds, 0.01)
    place = low + (high - low) * (0.5 - 0.5 * np.cos(2.0 * np.pi * t / seconds * 3))
    return Experiment("there and back", 0.01, {"command": force * np.sin(2.0 * np.pi * t), "output": place})


def test_an_axis_is_as_fast_as_its_speed_and_integrates_once():
    assert integrations(AXIS) == 1 and integrations(RIG) == 0
    assert response_time(AXIS, 0.01, 25.0) == pytest.approx(95.0 / 203.0, abs=0.02)


def test_the_input_stays_where_the_logs_and_the_ranges_have_it():
    logs = session(2)
    assert limits_of(RIG, logs, "command").high == pytest.approx(1.8)
    tight = replace(RIG, ranges=Ranges((0.0, 1.5), None, None))
    assert (limits_of(tight, logs, "command").low, limits_of(tight, logs, "command").high) == (0.0, 1.5)


@pytest.mark.parametrize("change", [0.09, 0.11])
def test_steps_are_proposed_where_there_were_steps(change):
    ramp, steps = np.clip(np.arange(2000) * change / 10.0, 0.0, 1.0), np.repeat([0.0, change, 1.0], 700)
    u = ramp if change < 0.1 else steps
    log = Experiment("up", 0.05, {"command": u, "pressure": u, "output": u})
    limits = limits_of(RIG, [log], "command")
    assert np.isinf(limits.rate) == (change > 0.1)
    fastest = max(np.max(np.abs(np.diff(c.input))) for c in menu(limits))
    assert fastest == pytest.approx(change / 10.0 if change < 0.1 else 1.0, rel=1e-6)


@pytest.mark.parametrize("seconds", [600.0, 45.0, 22.0])
@pytest.mark.parametrize("low", [0.0, -1.0])
def test_no_experiment_is_longer_than_the_session_was(seconds, low):
    limits = InputLimits(low, 2.0, 0.0, np.inf, seconds, 1.5, 0.01)
    found = menu(limits)
    assert found and all(c.seconds <= seconds and c.input[0] == 0.0 for c in found)
    assert all(low <= c.input.min() and c.input.max() <= 2.0 for c in found)
    assert any(c.input.min() < 0.5 * low for c in found) if low else all(c.input.min() == 0.0 for c in found)


def candidate_rigs(rig, log, effect="friction"):
    """The rig as given, a candidate for whatever effect."""
    problem = problem_of(rig, make([log], "command", "output"), [log])
    found = fit(problem, problem.nominal(), WHITE, 0)
    return CandidateRig(SimpleNamespace(effect=effect, fit=found), Part.of(found), (), ())


@pytest.mark.parametrize("force, share", [(2.0, 1.0), (150.0, None)])
def test_an_axis_is_pushed_no_further_than_its_stroke(force, share):
    log = axis_log(force)
    limits, bounds = limits_of(AXIS, [log], "command"), bounds_of(AXIS, [log])
    assert bounds.stands == pytest.approx(0.125, abs=1e-3) and not bounds.left
    allowed = [choice for choice, _ in _allowed(menu(limits), [candidate_rigs(AXIS, log)], bounds)]
    assert allowed and all(c.share == share or (share is None and c.share < 1.0) for c in allowed)
    for choice in allowed:
        t = np.arange(len(choice.input)) * limits.h
        _, place, _ = lsim(([1.0], [95.0, 203.0, 0.0]), choice.input, t)
        assert 0.02 < 0.125 + place.min() and 0.125 + place.max() < 0.23
        smaller = next((s for s in (0.1, 0.15, 0.25, 0.35, 0.5, 0.7, 1.0) if s > choice.share), None)
        if smaller:  # it is as large as it may be
            assert np.ptp(place) * smaller / choice.share > 0.19 * 0.5


def test_pushes_there_and_back_bring_a_free_mass_back_to_where_it_stood():
    limits = InputLimits(-1.0, 1.0, 0.0, np.inf, 100.0, 1.0, 0.01, 1, 2)
    for choice in menu(limits):
        if "push" in choice.what:
            speed = np.cumsum(choice.input) * limits.h
            place = np.cumsum(speed) * limits.h
            assert abs(place[-1]) < 0.02 * np.abs(place).max() and abs(speed[-1]) < 0.02 * np.abs(speed).max()


def test_a_pressure_is_kept_below_its_range_by_a_smaller_input():
    logs, bounds = session(2, roles=()), Bounds({"pressure": (-1.0, 0.1)})
    problem = problem_of(RIG, make(logs, "command", "output"), logs)
    found = fit(problem, problem.nominal(), WHITE, 0)
    rig = CandidateRig(SimpleNamespace(effect="leak", fit=found), Part.of(found), (), ())
    steps = Choice("a step", np.repeat([0.0, 1.0], 100), InputLimits(0.0, 1.8, 0.0, np.inf, 60.0, 1.0, 0.05))
    [(choice, [made])] = _allowed([steps], [rig], bounds)
    assert choice.share == 0.5 and made.signals["pressure"].max() == pytest.approx(0.09, rel=1e-3)
    assert not _allowed([steps], [rig], Bounds({"pressure": (-1.0, 0.01)}))


def test_what_outlives_a_rest_is_carried_into_the_experiment():
    logs = session(2)
    bare = problem_of(RIG, make(logs, "pressure", "curvature"), logs)
    form = library()["softening"].forms[0]
    problem = bare.with_candidates([CandidateEffect("softening", form, "actuator")])
    found = fit(problem, np.r_[bare.nominal(), problem.starts(problem.candidates[0])[0]], WHITE, 0)
    part = Part.of(found)
    largest = RIG.actuator.drive(0.18)  # of the session: what softening acts on is K(p) p
    assert max(part.left[0].values()) == pytest.approx(largest, rel=0.05)


@pytest.mark.parametrize(
    "rivals, left_out",
    [
        (("softening", "gain_drift"), ("staircase", "hold at", "small steps")),
        (("creep", "sensor_relaxation"), ("mixed", "triangle", "staircase", "sines")),
        (("slow_regulator", "transport_delay"), ("triangle",)),
    ],
)
def test_only_experiments_that_show_the_rivals_are_proposed(rivals, left_out):
    asked = [SimpleNamespace(effect=name) for name in rivals]
    problem = SimpleNamespace(references=SimpleNamespace(clocks={"response": 2.0}))
    nothing = SimpleNamespace(
        segment=SimpleNamespace(fed=SimpleNamespace(parts=lambda x: [], x=None, run=SimpleNamespace(h=0.02))),
        nominal=SimpleNamespace(problem=problem),
    )
    choices = menu(InputLimits(0.0, 1.0, 0.0, np.inf, 1200.0, 2.0, 0.02))
    made = [(c, [SimpleNamespace(entering=c.input)]) for c in choices]
    shown = [c.what for c, _ in _showing(made, nothing, asked)]
    assert len(shown) == len(choices) - len(left_out)
    assert not [what for what in shown if any(word in what for word in left_out)]


def option(apart, seconds=100.0):
    return _Option(SimpleNamespace(seconds=seconds), None, np.asarray(apart, float))


@pytest.mark.parametrize(
    "tiers, chosen",
    [
        ([[([6.0, 9.0], 100), ([20.0, 5.5], 100)]], 0),  # the least counts
        ([[([6.0], 100), ([7.0], 400)]], 0),  # by the second
        (
            [[([4.0], 100), ([4.5], 400)]],
            1,
        ),  # but for one that is not sure to tell, where that does not count
        ([[([5.1], 100)], [([90.0], 100)]], 0),  # what has been done before comes first
        ([[([4.9], 100)], [([90.0], 100)]], 1),  # unless it is not sure to tell
        ([[([2.0], 100)], [([90.0], 100)]], 1),  # unless it does not tell
        ([[([9.0, 0.2], 100), ([5.0, 0.3], 100)]], 0),  # what none tells does not count
        ([[([0.2, 0.9], 100), ([0.4, 0.5], 100)]], 1),  # the best of a bad lot
    ],
)
def test_the_most_telling_experiment_is_chosen(tiers, chosen):
    made = [[option(*o) for o in tier] for tier in tiers]
    assert _best(made)[1] is [o for tier in made for o in tier][chosen]


@pytest.mark.parametrize("apart, asked", [(2.9, False), (3.1, True)])
def test_a_further_signal_is_asked_for_where_it_tells_enough(apart, asked):
    plain, logged = option([1.0]), replace(option([apart]), stage="regulator")
    assert (_best([[plain], [logged]])[1] is logged) == asked


def test_nothing_is_proposed_where_nothing_is_allowed():
    assert _best([]) is None


def test_a_further_signal_is_looked_at_while_some_rival_is_told_by_nothing():
    assert _all_told([[option([6.0, 1.0])], [option([1.0, 5.1])]])
    assert not _all_told([[option([6.7, 4.9])], [option([9.0, 1.0])]])
    assert not _all_told([[]])


@pytest.fixture(scope="module")
def two():
    """The rig, and the same with another gain, having made steps; and the segment with its noise."""
    logs = session(2, roles=())
    limits = InputLimits(0.0, 1.8, 0.0, np.inf, 60.0, 1.0, 0.05)
    steps = Choice("steps", np.repeat([0.0, 1.0, 0.0, 0.5], 100), limits)
    found = []
    for gain in (1.05, 1.0):
        rig = replace(RIG, actuator=replace(RIG.actuator, gain=tuple(gain * g for g in RIG.actuator.gain)))
        problem = problem_of(rig, make(logs, "command", "output"), logs)
        got = fit(problem, problem.nominal(), WHITE, 0)
        got = replace(got, sse=1e-6 * len(got.innovations), information=1e3 * np.eye(len(got.vector)))
        rival = SimpleNamespace(effect="creep", stage="actuator", fit=got)
        found.append(CandidateRig(rival, Part.of(got), (), ()).making(steps))
    e = SimpleNamespace(segment=problem.segment, ar=np.ones(1), nominal=got)
    return e, found


def test_what_the_session_told_does_not_count_for_a_log_that_is_diagnosed_alone(two):
    e, made = two
    assert in_session(e, made)[0] > 20.0  # another gain, where the session knows it
    assert alone(e, made, "actuator")[0] < 3.0  # alone, either rig may have it


def test_what_is_ahead_of_a_logged_signal_is_not_seen_a_second_time_behind_it(two):
    e, (a, b) = two
    odd = replace(
        a, signals=a.signals | {"output": a.signals["output"] * np.linspace(0.5, 2.0, len(b.entering))}
    )
    assert alone(e, [odd, b], "actuator") == pytest.approx(alone(e, [a, b], "actuator"))
    behind = replace(b, rival=SimpleNamespace(effect="sensor_lag", stage="sensor", fit=b.rival.fit))
    assert alone(e, [odd, behind], "actuator")[0] > 3.0 * alone(e, [a, behind], "actuator")[0]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_rig_that_runs_away_from_an_experiment_tells_nothing_of_it(two, value):
    """A sharp loop in a spring was no number there, and ended the diagnosis in a fault."""
    e, (a, b) = two
    wild = replace(b, signals=b.signals | {"output": np.where(b.entering > 0, value, 0.0)})
    assert alone(e, [a, wild], "actuator")[0] >= 0.0 and in_session(e, [a, wild])[0] == 0.0


def test_a_log_by_itself_has_to_tell_also_what_only_the_session_ruled_out(monkeypatch):
    rival = SimpleNamespace(stage="actuator")
    e = SimpleNamespace(segment=SimpleNamespace(stages=("actuator", "sensor")), nominal=None)
    question = _Question(e, (rival, rival, rival), (rival,))
    assert len(question.anew) == 5 and question.anew[-1].effect == ""  # the last: that nothing is there
    monkeypatch.setattr(next_experiment, "candidate_rigs", lambda *_: [])
    for apart, left in (([9.0, 5.0, 2.0, 7.0], [2.0, 2.0]), ([9.0, 5.0, 8.0, 6.0], [6.0, 5.0])):
        monkeypatch.setattr(next_experiment, "alone", lambda *_, apart=apart: np.array(apart))
        [one] = _with_a_further_signal(question, [SimpleNamespace(seconds=1.0)], ())
        assert list(one.apart) == left


LIMITS = InputLimits(0.0, 2.0, 0.0, np.inf, 10.0, 1.0, 0.5)


def made(apart, what="steps", share=1.0, **other):
    """An option of a real experiment of 5 s."""
    return _Option(
        Choice(what, np.r_[0.0, np.ones(9)], LIMITS, share), None, np.asarray(apart, float), **other
    )


def row_of(options, holds=lambda choice: True):
    row = _in_a_row(options[0], [options], holds)
    return row, row.choice.what.split(", then ")


def test_what_is_certain_to_tell_is_made_alone():
    first = made([11.1], "first")
    assert row_of([first, made([90.0], "other")])[0] is first


def test_what_is_less_than_certain_is_followed_by_what_tells_most_beside_it():
    first, alike, other = made([9.0, 5.0], "a"), made([12.0, 2.0], "b"), made([1.0, 14.5], "c")
    row, names = row_of([first, alike, other])
    assert names == ["a", "c", "b"] and row.choice.parts == 3
    assert row.apart == pytest.approx([np.sqrt(81 + 144 + 1), np.sqrt(25 + 4 + 14.5**2)])
    # what one tells is not trusted, nor is the sum: a row that is begun is made whole
    assert row_of([first, alike, made([14.0, 14.5], "c")])[1] == ["a", "c", "b"]


def test_a_row_has_three_experiments_at_most_and_each_once():
    row, names = row_of([made([4.0], str(i)) for i in range(6)])
    assert len(set(names)) == len(names) == row.choice.parts == 3


def test_no_time_is_spent_where_a_row_would_not_tell_either():
    options = [made([1.0], str(i)) for i in range(6)]
    assert row_of(options)[0] is options[0]


def test_a_row_is_of_one_kind_and_stays_within_the_bounds():
    first, wide, fine = made([4.0], "a"), made([9.0], "wide"), made([4.0], "fine")
    logged = replace(made([9.0], "logged"), stage="actuator")
    faster = replace(logged, stage=None, choice=replace(logged.choice, limits=replace(LIMITS, rate=1.0)))
    options = [first, logged, faster, wide, fine]
    assert row_of(options, lambda choice: "wide" not in choice.what)[1] == ["a", "fine"]


def test_what_shows_too_little_alone_may_follow():
    first, other = made([4.0], "a"), made([9.0], "b", shows=False)
    assert _best([[first, other]])[1] is first and not _all_told([[first, other]])
    assert row_of([first, other])[1] == ["a", "b"]


def test_a_row_is_one_input_of_all_its_experiments():
    half, full = made([4.0], share=0.5).choice, made([4.0]).choice
    row = half.then(full)
    assert np.array_equal(row.input, np.r_[half.input, full.input]) and half.input.max() == 1.0
    assert row.seconds == half.seconds + full.seconds == 10.0
