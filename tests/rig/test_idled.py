"""A rig that idled at a level between its logs: what is put ahead of them, and in windows.

Red when a gap between two logs counts as 0, when a step since the last log is lost, or when what few steps
leave of a past stays.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.logs.read import in_session_order
from focgen.rig.carried import raised
from focgen.rig.effects import library
from focgen.rig.initial import in_windows
from focgen.rig.placed import Placed
from focgen.rig.recalled import recalled
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.rig.tried import nearest

H, IDLE, GAP = 0.05, 0.3, 100
ONE = np.concatenate([np.full(n, v) for n, v in ((20, IDLE), (160, 0.9), (200, 0.7), (40, IDLE))])
RIG = Rig("finger", H, Signals("t", "y", pressure="p"), Actuator(1.0, 0.6, (3.0,)))


def logs_of(last=ONE, begins=()):
    """Three logs, the rig idle between them; the ``last`` one may be another."""
    whole = np.r_[ONE, np.full(GAP, IDLE), ONE, np.full(GAP, IDLE), last]
    one = Experiment("whole", H, {"pressure": whole, "output": whole}, begins={"pressure": Begin((IDLE,))})
    (made,) = simulate_session(RIG, [one])
    starts = [k * (len(ONE) + GAP) for k in range(3)]
    return [
        Experiment(
            f"run {k}",
            H,
            {"pressure": whole[a : a + len(ONE)], "output": made["output"][a : a + len(ONE)]},
            start=a * H,
            begins={"pressure": Begin((IDLE,))},
        )
        for k, a in enumerate(starts)
    ]


def off(logs, k):
    """By how much log ``k`` is off where it is simulated by itself, as a share of the largest output."""
    (made,) = simulate_session(RIG, logs[k : k + 1])
    return float(np.sqrt(np.mean((made["output"] - logs[k]["output"]) ** 2))) / 2.7


def test_between_two_logs_the_input_is_what_the_later_one_begins_with():
    logs = logs_of()
    assert off(logs, 2) > 0.01  # the level held for ever
    told = recalled(RIG, logs, held=())
    assert off(told, 2) < 0.001
    begin = told[2].before("pressure")
    since = [level for level, t in zip(begin.levels[1:], begin.ago) if t < GAP * H]
    assert since == pytest.approx([IDLE] * len(since))
    assert not begin.known  # nobody has seen the gap


@pytest.mark.parametrize("clock", ["one", pytest.param("of its own", marks=pytest.mark.long)])
def test_a_session_is_told_by_its_earlier_logs_from_the_start(clock):
    """Before any effect is looked for, and where no clock says how long the rig idled, too."""
    rng, noise = np.random.default_rng(3), 0.003
    logs = [
        replace(
            log,
            begins={},
            signals={**log.signals, "output": log["output"] + rng.normal(0.0, noise, len(ONE))},
        )
        for log in logs_of()
    ]
    if clock != "one":
        logs = in_session_order([Experiment(log.name, H, log.signals) for log in logs])
    told = begun_session(RIG, logs)
    made = simulate_session(RIG, told)
    for log, one in zip(told[1:], made[1:]):
        assert np.std(log["output"] - one["output"]) < 1.05 * noise
    assert all(log.before("pressure").after is not None for log in told[1:])


def test_in_a_row_the_rig_goes_on_through_the_gap():
    """As it did, sample for sample, and not by means over windows."""
    logs = logs_of()
    made = simulate_session(RIG, recalled(RIG, logs, held=()))
    for log, one in zip(logs, made):
        assert np.max(np.abs(log["output"] - one["output"])) < 1e-9


def test_a_step_since_the_last_log_is_kept_where_its_own_begin_tells_of_it():
    logs, step = logs_of(), Begin((0.9, IDLE), (2.0,))
    moved = [*logs[:2], replace(logs[2], begins={"pressure": step})]
    kept, held = (recalled(RIG, moved, held=own)[2].before("pressure") for own in ((2,), ()))
    assert kept.levels[-2:] == (0.9, IDLE)
    assert kept.ago[-1] == 2.0
    assert kept.after == held.after
    # in a row with the others, the step is there as well
    alone, in_a_row = (
        simulate_session(RIG, recalled(RIG, moved, held=(2,))[k:])[-1]["output"] for k in (2, 0)
    )
    assert np.max(np.abs(alone - in_a_row)) < 0.01
    assert np.max(np.abs(alone - logs[2]["output"])) > 0.1


def test_a_night_between_two_logs_takes_no_memory():
    logs = logs_of()
    later = replace(logs[2], start=logs[2].start + 1e9)
    begin = recalled(RIG, [*logs[:2], later], held=())[2].before("pressure")
    assert begin.levels == pytest.approx([IDLE] * len(begin.levels))
    assert len(begin.levels) < 100


@pytest.mark.parametrize("seed", range(5))
def test_windows_tell_what_few_steps_do_not(seed):
    """Ten holds ahead of the log, of which its begin has the last one only."""
    rng = np.random.default_rng(seed)
    past = np.repeat(rng.uniform(0.1, 1.0, 10), rng.integers(20, 120, 10))
    whole = np.r_[past, np.full(40, IDLE), ONE, ONE]
    one = Experiment("whole", H, {"pressure": whole, "output": whole}, begins={"pressure": Begin((past[0],))})
    y = simulate_session(RIG, [one])[0]["output"] + rng.normal(0.0, 0.005, len(whole))
    ahead = len(past) + 40
    log = Experiment(
        "run",
        H,
        {"pressure": whole[ahead:], "output": y[ahead:]},
        begins={"pressure": Begin((float(past[-1]), IDLE), (40 * H,))},
    )
    (told,) = in_windows(RIG, [log])
    assert off([log], 0) > 1.3 * 0.005 / 2.7
    assert off([told], 0) < 1.1 * 0.005 / 2.7


def test_a_past_that_earlier_logs_show_is_left_as_it_is():
    logs = [
        replace(log, begins={"pressure": replace(log.before("pressure"), known=True)}) for log in logs_of()
    ]
    assert all(a is b for a, b in zip(logs, in_windows(RIG, logs)))


def test_what_wears_asks_for_the_earlier_logs_themselves():
    """Means over windows wear a rubber less than what was: it goes on from the log before instead."""
    softening = library()["softening"]
    form = next(form for form in softening.forms if form.name == "work")
    placed = Placed("softening", form, "actuator", (0.5, 5.0))
    logs = list(recalled(RIG, logs_of(), held=()))
    later = logs[2]["output"] * 1.1  # a past could make up for some of it
    logs[2] = replace(logs[2], signals={**logs[2].signals, "output": later})
    assert in_windows(RIG, logs)[2].begins != logs[2].begins
    assert [log.begins for log in in_windows(RIG, logs, [placed])[1:]] == [log.begins for log in logs[1:]]


def test_a_signal_is_raised_in_its_window_only():
    begin = Begin((1.0, 2.0, 3.0), (4.0, 1.0))
    made = raised(begin, 0.5, 2.0, 0.5)
    assert made == Begin((1.0, 2.0, 2.5, 3.5, 3.0), (4.0, 2.0, 1.0, 0.5))
    assert raised(begin, 0.5, np.inf, 4.0) == Begin((1.5, 2.0, 3.0), (4.0, 1.0))


def test_rows_that_noise_hides_are_hardly_taken():
    """Of what the data ask of one way for sure, nearly all is taken, of one that noise hides next to none."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0.0, 1.0, 2000)
    rows = np.stack([np.sin(np.arange(2000) / 3.0), 1e-3 * np.cos(np.arange(2000) / 5.0)])
    left = (noise - 2.0 * rows[0] - 2.0 * rows[1])[:, None]
    by, free = nearest(rows, left)
    assert by[0] == pytest.approx(2.0, abs=0.2)
    assert abs(by[1]) < 0.1
    assert free == 1
