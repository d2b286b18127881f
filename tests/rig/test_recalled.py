"""A rig that rested too short between two experiments to forget the first.

The rig here is not the library's: its fractional integral is a bank of relaxations, by the Stieltjes form of
the kernel t^(α − 1)/Γ(α).

Red when what an earlier experiment left is lost, or is put into a rig that was reset.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.logs.read import in_session_order
from focgen.rig.files import read_rig
from focgen.rig.recalled import recalled
from focgen.rig.replay import replay, simulate_session
from focgen.rig.rig import Rig

H, T, ALPHA, GAIN, NOISE = 0.05, 1.0, 0.6, 3.0, 0.01
TEXT = """
name = "short rests"
sample_time = 0.05
[signals]
time = "t_s"
run = "run"
pressure = "p_bar"
output = "x_mm"
[actuator]
T = {T}
alpha = {alpha}
gain = [3.0]
"""


def _fractional(x: np.ndarray) -> np.ndarray:
    """T D^α y + y = K x by implicit steps of H/10, the input in straight lines."""
    h, n = H / 10, len(x)
    fine = np.interp(np.arange(10 * n) / 10, np.arange(n), x)
    rates = np.geomspace(1e-5, 1e4, 80)
    weights = np.sin(np.pi * ALPHA) / np.pi * rates ** (1.0 - ALPHA) * np.log(rates[1] / rates[0])
    weights, kept = weights * h / (1.0 + h * rates), 1.0 / (1.0 + h * rates)
    z, now, y = np.zeros(80), float(weights.sum()), np.zeros(10 * n)
    for k, value in enumerate(fine):
        y[k] = (float(kept @ z) + now / T * GAIN * value) / (1.0 + now / T)
        z = kept * z + weights * (GAIN * value - y[k]) / T
    return y[::10]


def _session(rest: float, first: float = 0.6) -> tuple[np.ndarray, np.ndarray, list[tuple[int, int]]]:
    """Three experiments on one clock, with rests that no log shows: input, reading, spans."""
    held = int(8.0 / H)
    one = np.concatenate([np.zeros(20), *(np.full(held, v) for v in (first, 0.0, 1.0, 0.3))])
    gap = np.zeros(int(rest / H))
    x = np.concatenate([one, gap, one * 0.8, gap, one])
    noise = np.random.default_rng(4).normal(0.0, NOISE, len(x))
    starts = [k * (len(one) + len(gap)) for k in range(3)]
    return x, _fractional(x) + noise, [(s, s + len(one)) for s in starts]


def _logs(rest: float, first: float = 0.6) -> list[Experiment]:
    x, y, spans = _session(rest, first)
    x = x.copy()
    return [
        Experiment(f"run {k}", H, {"pressure": x[a:b], "output": y[a:b]}, start=a * H)
        for k, (a, b) in enumerate(spans)
    ]


def _rig(folder: Path, text: str = TEXT.format(T=T, alpha=ALPHA)) -> Rig:
    (folder / "rig.toml").write_text(text)
    return read_rig(folder / "rig.toml")


def _left(rig: Rig, logs: list[Experiment]) -> float:
    made = simulate_session(rig, logs)
    return float(np.sqrt(np.mean([np.mean((a["output"] - b["output"]) ** 2) for a, b in zip(logs, made)])))


def test_what_was_before_is_simulated_ahead_of_an_experiment(tmp_path: Path) -> None:
    rig, logs = _rig(tmp_path), _logs(rest=10.0)
    told = begun_session(rig, logs)
    assert [log.before("pressure").known for log in told] == [False, True, True]
    assert _left(rig, logs) > 3.0 * NOISE
    assert _left(rig, list(told)) < 1.2 * NOISE


def test_experiments_in_a_row_go_on_from_one_another(tmp_path: Path) -> None:
    """As the rig did, sample for sample: it knows of no logs. One of them without the others, and the same in
    another order, have windows of the past instead."""
    rig, logs = _rig(tmp_path), _logs(rest=10.0)
    x, _, spans = _session(rest=10.0)
    whole = Experiment("whole", H, {"pressure": x, "output": x})
    unbroken = simulate_session(rig, [whole])[0]["output"]
    told = list(recalled(rig, logs))
    for (a, b), made in zip(spans, simulate_session(rig, told)):
        assert np.array_equal(made["output"], unbroken[a:b])
    (alone,) = simulate_session(rig, told[2:])
    turned = simulate_session(rig, told[::-1])
    a, b = spans[2]
    for made in (alone, turned[0]):
        off = float(np.sqrt(np.mean((made["output"] - unbroken[a:b]) ** 2)))
        assert 0.0 < off < 0.1 * NOISE


def test_nobody_goes_on_from_a_log_whose_own_past_is_not_known(tmp_path: Path) -> None:
    """The second log begins at a level, so that nothing says what was before it. The third one keeps both."""
    rig, logs = _rig(tmp_path), _logs(rest=10.0)
    late = 60  # samples of the second log are lost: it begins within its first step
    second = replace(
        logs[1], signals={k: v[late:] for k, v in logs[1].signals.items()}, start=logs[1].start + late * H
    )
    cut = [logs[0], second, logs[2]]
    told = recalled(rig, cut)
    assert [log.before("pressure").known for log in told] == [False, False, True]
    row, alone = simulate_session(rig, told)[2]["output"], simulate_session(rig, told[2:])[0]["output"]
    assert np.array_equal(row, alone)


@pytest.mark.parametrize("samples", [0.5, 1.5, 2.3, 20.5])
def test_a_pause_that_is_no_whole_number_of_samples(tmp_path: Path, samples: float) -> None:
    """The exact decay of a lag, from the middle of the straight line on which the input falls."""
    held = {"pressure": np.full(100, 2.0), "output": np.zeros(100)}
    later = {"pressure": np.r_[0.0, np.zeros(99)], "output": np.zeros(100)}
    start = 99 * H + samples * H + H
    logs = [Experiment("a", H, held), Experiment("b", H, later, start=start)]
    rig = _rig(tmp_path, TEXT.format(T=T, alpha=1.0))
    made = simulate_session(rig, recalled(rig, logs, closer=False))[1]["output"]
    since = (samples + 0.5 + np.arange(100)) * H
    exact = GAIN * 2.0 * (1.0 - np.exp(-100 * H / T)) * np.exp(-since / T)
    assert np.max(np.abs(made - exact)) < 0.002 * GAIN * 2.0


def test_replay_does_the_same(tmp_path: Path) -> None:
    frame = {key: np.concatenate(parts) for key, parts in _columns(_logs(rest=10.0)).items()}
    found = replay(_rig(tmp_path), frame)
    assert all(each.rmse < 1.25 * NOISE for each in found.logs.values())
    assert any("before the rig has come to rest" in note for note in found.notes)


def _columns(logs: list[Experiment]) -> dict[str, list[np.ndarray]]:
    return {
        "run": [np.full(len(log), k) for k, log in enumerate(logs)],
        "t_s": [log.start + log.time for log in logs],
        "p_bar": [np.asarray(log["pressure"]) for log in logs],
        "x_mm": [np.asarray(log["output"]) for log in logs],
    }


def test_a_rig_that_forgets_is_left_as_it_is(tmp_path: Path) -> None:
    rig = _rig(tmp_path, TEXT.format(T=0.5, alpha=1.0))
    logs = tuple(_logs(rest=10.0))
    assert all(a is b for a, b in zip(logs, recalled(rig, logs)))


def test_experiments_that_each_began_at_rest_are_believed(tmp_path: Path) -> None:
    """What the clock says is a guess: a rig that was reset between two experiments remembers nothing."""
    rig, logs = _rig(tmp_path), _logs(rest=10.0)
    reset = [
        Experiment(log.name, H, {**log.signals, "output": made["output"]}, start=log.start)
        for log, made in zip(logs, simulate_session(rig, logs))
    ]
    assert all(a is b for a, b in zip(reset, recalled(rig, reset)))
    assert any(log.before("pressure").known for log in begun_session(rig, logs))
    assert not any(log.before("pressure").known for log in begun_session(rig, reset))


@pytest.mark.parametrize("zero", [-0.4, 0.0, pytest.param(0.4, marks=pytest.mark.long)])
@pytest.mark.parametrize("remembers", [True, False])
def test_a_zero_that_is_off_is_no_past_and_hides_none(tmp_path: Path, zero: float, remembers: bool) -> None:
    """It is the same in every log, those too that nothing was before; a past is not in the first one. The
    nominal rig knows of no offset, and has a gain to be refitted."""
    rig, logs = _rig(tmp_path), _logs(rest=10.0)
    outputs = [log["output"] for log in logs]
    if not remembers:
        noise = np.random.default_rng(7).normal(0.0, NOISE, len(logs[0]))
        outputs = [made["output"] + noise for made in simulate_session(rig, logs)]
    off = [replace(log, signals={**log.signals, "output": y + zero}) for log, y in zip(logs, outputs)]
    told = [log.before("pressure").known for log in recalled(rig, off)]
    assert told == [False, remembers, remembers]


def test_where_no_log_tells_its_zero_a_rig_that_was_reset_is_believed(tmp_path: Path) -> None:
    """The first log begins with its first step. What a past would leave is below the noise of a sample, so
    that its decay shows nothing, and its mean shows all."""
    rig, logs = _rig(tmp_path), _logs(rest=40.0)
    cut = {role: values[20:] for role, values in logs[0].signals.items()}
    logs[0] = replace(logs[0], signals=cut, start=logs[0].start + 20 * H)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        made = [m["output"] + rng.normal(0.0, 0.05, len(m["output"])) for m in simulate_session(rig, logs)]
        reset = [replace(log, signals={**log.signals, "output": y}) for log, y in zip(logs, made)]
        assert all(a is b for a, b in zip(reset, recalled(rig, reset)))


@pytest.mark.parametrize("rest", [3.0, 30.0])
def test_windows_hold_what_went_in(tmp_path: Path, rest: float) -> None:
    """The past that is put ahead has the integral of what the logs hold."""
    logs = _logs(rest)
    begin = recalled(_rig(tmp_path), logs)[1].before("pressure")
    assert begin.samples(H).sum() == pytest.approx(np.sum(logs[0]["pressure"]), rel=0.01)


def _own_clocks(logs: list[Experiment]) -> tuple[Experiment, ...]:
    return in_session_order([replace(log, start=0.0) for log in logs])


@pytest.mark.parametrize("rest", [pytest.param(3.0, marks=pytest.mark.long), 10.0, 30.0])
def test_how_long_it_rested_is_told_where_every_log_has_a_clock_of_its_own(
    tmp_path: Path, rest: float
) -> None:
    rig, logs = _rig(tmp_path), _own_clocks(_logs(rest))
    assert [log.paused for log in logs] == [False, True, True]
    told = begun_session(rig, logs)
    first, second, _ = told
    assert second.start - first.start - len(first) * H == pytest.approx(rest, rel=0.2)
    assert _left(rig, list(logs)) > 1.5 * NOISE
    assert _left(rig, list(told)) < 1.2 * NOISE


@pytest.mark.parametrize(
    "rest", [pytest.param(8.0, marks=pytest.mark.long), 20.0]
)  # told of a step from a little, and near 0 at first
def test_a_log_that_begins_with_its_first_step_was_at_rest_or_recalls(tmp_path: Path, rest: float) -> None:
    """The input is not 0 at any sample ahead of the first step; that the output is near 0 says it was."""
    rig = _rig(tmp_path)
    logs = [_from(log, 20) for log in _logs(rest, first=0.3)]
    told = begun_session(rig, logs)
    assert [bool(log.before("pressure").known) for log in told] == [False, True, True]
    assert _left(rig, told) < 0.6 * _left(rig, logs)
    amid = [logs[0], _from(logs[1], 60)]  # in the middle of a hold
    assert not begun_session(rig, amid)[1].before("pressure").known


def _from(log: Experiment, first: int) -> Experiment:
    signals = {role: values[first:] for role, values in log.signals.items()}
    return replace(log, signals=signals, start=log.start + first * log.sample_time)


def test_rigs_that_each_began_at_rest_have_no_pauses(tmp_path: Path) -> None:
    rig, logs = _rig(tmp_path), _own_clocks(_logs(10.0))
    for seed in range(10):
        rng = np.random.default_rng(seed)
        reset = [
            replace(log, signals={**log.signals, "output": made["output"] + rng.normal(0.0, NOISE, len(log))})
            for log, made in zip(logs, simulate_session(rig, logs))
        ]
        told = begun_session(rig, reset)
        assert [(log.start, dict(log.begins)) for log in told] == [(log.start, {}) for log in reset]


def _behind(rig: Rig, logs: Sequence[Experiment], slower: float) -> tuple[Rig, list[Experiment]]:
    """The rig behind a regulator, and the logs with a command that a ``slower`` one made their input of."""
    regulated = replace(rig, regulator=TransferFunction([(1.0, 0.0)], [(0.2, 1.0), (1.0, 0.0)]))
    found = []
    for log in logs:
        x = log["pressure"]
        command = x + slower * 0.2 * np.diff(x, append=x[-1]) / H
        found.append(replace(log, signals={"command": command, **log.signals}))
    return replace(regulated, signals=replace(rig.signals, command="u_V")), found


@pytest.mark.parametrize("slower", [1.0, pytest.param(8.0, marks=pytest.mark.long)])
def test_a_stage_that_fits_badly_hides_no_past_of_another(tmp_path: Path, slower: float) -> None:
    """The squares of all stages added up are those of the worst one: what the output tells of the past is a
    hundredth of what a regulator leaves that is eight times slower than given."""
    plain, logs = _rig(tmp_path), _own_clocks(_logs(rest=10.0))
    rig, logs = _behind(plain, logs, slower)
    assert [log.before("pressure").known for log in begun_session(rig, logs)] == [False, True, True]


def _cut(at: int) -> list[Experiment]:
    """One recording in two files, cut where the input is held."""
    x, y, ((_, end), *_) = _session(rest=10.0)
    signals = [{"pressure": x[a:b], "output": y[a:b]} for a, b in ((0, at), (at, end))]
    return [Experiment(f"part {k}", H, s, start=k * at * H) for k, s in enumerate(signals)]


@pytest.mark.parametrize(
    "at",
    [182, pytest.param(300, marks=pytest.mark.long), 400],
    ids=["just behind a step", "later", "at another level"],
)
def test_a_recording_cut_in_two_goes_on_whatever_its_input_is(tmp_path: Path, at: int) -> None:
    rig, parts = _rig(tmp_path), _cut(at)
    whole = {role: np.concatenate([p[role] for p in parts]) for role in ("pressure", "output")}
    told = begun_session(rig, parts)
    assert [log.before("pressure").known for log in told] == [False, True]
    exact = simulate_session(rig, [Experiment("whole", H, whole)])[0]["output"]
    made = np.concatenate([m["output"] for m in simulate_session(rig, told)])
    np.testing.assert_array_equal(made, exact)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param("late", marks=pytest.mark.long),
        "early",
        "moved",
        pytest.param("by a clock of its own", marks=pytest.mark.long),
    ],
)
def test_a_log_that_begins_elsewhere_or_later_does_not_go_on(tmp_path: Path, change: str) -> None:
    rig, (first, second) = _rig(tmp_path), _cut(100)
    if change == "late":
        second = replace(second, start=second.start + 3 * H)
    elif change == "early":
        second = replace(second, start=second.start - 3 * H)
    elif change == "by a clock of its own":
        second = replace(second, paused=True)
    else:
        moved = second["output"] - 0.2 * np.max(first["output"])
        second = replace(second, signals={**second.signals, "output": moved})
    told = recalled(rig, [first, second], closer=False)
    assert not any(log.before("pressure").known for log in told)
