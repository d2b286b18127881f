"""Valves that stick in somebody else's loop, made here step by step, and tones that only look like it.

Red when a sticking valve is taken for another effect, or a tone from outside for a valve.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict.outside import from_outside
from focgen.diagnosis.verdict.unexplained import is_unknown
from focgen.fractional.transfer import TransferFunction
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.rig import kernels
from focgen.rig.begun import past_of, with_past
from focgen.rig.effects import Run, form_of
from focgen.rig.rig import Delays, LinearActuator, Rig, Signals

GAIN, LAG = 1.2, 3.0
RIG = Rig(  # as its owner believes it to be
    "flow",
    1.0,
    Signals("t", "pv", "op", reference="sp"),
    LinearActuator(TransferFunction([(1.1 * GAIN, 0.0)], [(0.9 * LAG, 1.0), (1.0, 0.0)])),
    delays=Delays(actuator=1.0),
)
RIVALS = ("hysteresis", "valve_stiction")


def valve(commands, band, left, anew, place):
    """Positions by the rule as it is told, command after command: stuck until the command is more than the
    band away; then ``left`` behind it, until it turns round, or stuck again at once."""
    now, way, before, found = commands[0] - place, 0.0, commands[0], []
    for u in commands:
        if way and ((u - before) * way <= 0.0 or anew):
            way = 0.0
        if abs(u - now) > band:
            way = np.sign(u - now)
        if way:
            now = u - way * left
        before = u
        found.append(now)
    return np.array(found)


def loop(seed, band=0.0, left=0.0, tone=0.0, steps=True, count=1000):
    """A PI controller, a valve, a lag; ``tone``: on the output, from outside; away from rest."""
    rng = np.random.default_rng(seed)
    reference = 50.0 + (np.repeat(rng.uniform(-6.0, 6.0, 8), count // 8) if steps else np.zeros(count))
    u, y, flow, total = np.zeros(count), np.zeros(count), 50.0, 50.0 / GAIN
    x = np.full(count + 1, 50.0 / GAIN)
    way, fade = 0.0, np.exp(-1.0 / LAG)
    for k in range(count):
        y[k] = flow + 0.15 * rng.standard_normal() + tone * np.sin(2.0 * np.pi * k / 37.0)
        error = reference[k] - y[k]
        total += 0.15 * error
        u[k] = total + 0.6 * error
        if way and k and (u[k] - u[k - 1]) * way <= 0.0:
            way = 0.0
        if abs(u[k] - x[k]) > band:
            way = np.sign(u[k] - x[k])
        x[k + 1] = u[k] - way * left if way else x[k]
        flow = fade * flow + (1.0 - fade) * GAIN * x[k]
    return Experiment("loop", 1.0, {"command": u, "output": y, "reference": reference})


def explained(log):
    """The one segment, told to choose between a sticking valve and a loop of hysteresis."""
    (found,) = explain_all(RIG, begun_session(RIG, [log]), 12.0, RIVALS)
    return found


@pytest.mark.parametrize("anew", [False, True])
@pytest.mark.parametrize("left", [0.0, 0.3])
def test_a_held_valve_moves_as_its_rule_says(left, anew):
    u = 40.0 + np.cumsum(np.random.default_rng(1).normal(0.0, 0.4, 600))
    rest = np.zeros(len(u), np.uint8)
    rest[0] = kernels.BALANCED
    made = kernels.stick(u, rest, 1.5, left, anew, 0.7)
    np.testing.assert_array_equal(made, valve(u, 1.5, left, anew, 0.7))
    assert len(np.unique(made)) > 10


@pytest.mark.parametrize("form", ["stick_slip_begun", "slips_begun"])
def test_a_valve_whose_place_is_given_lies_there_whatever_past_was_guessed(form):
    """A past that no log shows is one that leaves the plant where it was: of the valve's positions."""
    u = 40.0 + np.cumsum(np.random.default_rng(1).normal(0.0, 0.4, 300))
    begin = Begin((55.0, 30.0, u[0]), (9.0, 4.0))
    run = Run.of([300], [0.0], 1.0, [begin])
    whole, kept = past_of(run)
    x = with_past(u, run)
    made = form_of("valve_stiction", form).act(x, (1.5, 0.3, 0.7), whole)
    np.testing.assert_array_equal(made[kept], valve(u, 1.5, 0.3 * 1.5, form == "slips_begun", 0.7 * 1.5))
    ahead = np.delete(np.arange(len(x)), kept)
    assert len(ahead) > 8
    np.testing.assert_array_equal(made[ahead], x[ahead])


@pytest.mark.parametrize("known", [False, True])
def test_a_past_that_logs_show_is_gone_through_and_a_log_from_rest_has_none(known):
    u = np.cumsum(np.random.default_rng(1).normal(0.0, 0.4, 300))
    act, values = form_of("valve_stiction", "slips_begun").act, (1.5, 0.3, 0.7)
    run = Run.of([300, 300], [0.0, 900.0], 1.0, [Begin(), Begin((55.0, 30.0), (9.0,), known)])
    whole, kept = past_of(run)
    x = with_past(np.concatenate([u, u + 30.0]), run)
    made = act(x, values, whole)[kept]
    np.testing.assert_array_equal(made[:300], act(u, values, Run.of([300], [0.0], 1.0)))
    passed = x[300:] if known else u + 30.0
    np.testing.assert_array_equal(made[300:], valve(passed, 1.5, 0.3 * 1.5, True, 0.7 * 1.5)[-300:])


@pytest.mark.parametrize(
    "band, left, count",
    [(4.5, 1.5, 600), (4.5, 1.5, 1200), pytest.param(2.5, 2.5, 600, marks=pytest.mark.long)],
)
def test_a_valve_that_sticks_in_a_loop_is_no_hysteresis(band, left, count):
    found = explained(loop(3, band, left, count=count))
    first = found.causes[0].rivals[0]
    assert first.effect == "valve_stiction" and not is_unknown(found)
    assert found.best.problem.values(found.best.vector)[0][0] == pytest.approx(band, rel=0.1)


@pytest.mark.parametrize("steps", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_tone_from_outside_is_not_put_down_to_what_lies_in_the_loop(steps):
    found = explained(loop(3, tone=2.0, steps=steps, count=1000 if steps else 600))
    assert found.causes  # what follows a tone fits it
    assert found.segment.closed and from_outside(found) and is_unknown(found)


def test_a_loop_is_closed_whose_reference_never_moves():
    held, no_reference = loop(2, steps=False, count=200), loop(2, steps=False, count=200)
    no_reference = replace(no_reference, signals={r: held[r] for r in ("command", "output")})
    elsewhere = replace(held, signals={**held.signals, "reference": np.full(200, 90.0)})
    assert make([held], "command", "output").closed
    for other in (no_reference, elsewhere):  # their commands answer the noise of what is read
        assert make([other], "command", "output").closed
    np.testing.assert_array_equal(np.ptp(make([held], "command", "output").wanted), 0.0)


def test_where_a_valve_lay_is_asked_only_of_logs_that_begin_in_use():
    log = loop(3, 2.5, 2.5, count=200)
    at_rest, in_use = (make(logs, "command", "output") for logs in ([log], begun_session(RIG, [log])))
    asked = [{c.form.name for c in candidates_for(s, RIG) if c.form.begun} for s in (at_rest, in_use)]
    assert asked == [set(), {"stick_slip_begun", "slips_begun"}]


@pytest.mark.long
@pytest.mark.parametrize("band, left", [(4.5, 1.5), (2.5, 2.5)])
def test_a_valve_that_sticks_is_named_among_all_effects(band, left):
    """One that slips to where its band ends is a play as well, and both are in the set."""
    found = diagnose(RIG, [loop(3, band, left, count=2000)], pictures=False)
    assert found.verdict in ("named", "set")
    first, *others = [c.effect for c in found.causes[0].candidates]
    assert first == "valve_stiction" or (
        band == left and first == "hysteresis" and "valve_stiction" in others
    )


@pytest.mark.long
def test_a_sound_loop_has_nothing():
    assert diagnose(RIG, [loop(3, count=2000)], pictures=False).verdict in ("parameters", "none")


def swept(band, seed=1):
    """A triangle up and down, not in a loop, of a valve that slips once it is a band away."""
    u = np.concatenate([np.linspace(0.0, 100.0, 400), np.linspace(100.0, 0.0, 400)[1:]])
    x, y, flow = valve(u, band, 0.0, True, 0.0), np.zeros(len(u)), 0.0
    for k in range(1, len(u)):
        flow += (1.0 - np.exp(-1.0 / LAG)) * (GAIN * x[k - 1] - flow)
        y[k] = flow
    y += np.random.default_rng(seed).normal(0.0, 0.5, len(y))
    return Experiment("sweep", 1.0, {"command": u, "output": y})


@pytest.mark.parametrize(
    "band",
    [
        6.3,
        pytest.param(11.19, marks=pytest.mark.long),
        pytest.param(16.7, marks=pytest.mark.long),
        23.0,
        pytest.param(31.0, marks=pytest.mark.long),
    ],
)
def test_a_band_is_found_wherever_it_lies_between_two_starts(band):
    """Many slips in a row fit no band but theirs, and those that the command passes in the same step."""
    (e,) = explain_all(RIG, [swept(band)], 12.0, ["valve_stiction"])
    (first, *_) = e.best.problem.values(e.best.vector)
    assert first[0] == pytest.approx(band, rel=0.02, abs=100.0 / 399.0)
    assert np.std(e.best.weighed) < 1.2 * 0.5 / e.segment.level_out
