"""Slips of unit, sign, column and time: each is named, and honest logs of varied rigs stay silent.

Red when a slip passes unnamed, or an honest log is warned of.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.errors import LogError
from focgen.fractional.transfer import TransferFunction
from focgen.logs import Experiment, read_logs
from focgen.logs.plausibility import doubts as by_ranges
from focgen.logs.plausibility import hint
from focgen.logs.units import unit_named, unit_of
from focgen.rig.files import read_rig, write_rig
from focgen.rig.plausibility import doubts
from focgen.rig.replay import simulate_session
from focgen.rig.rig import UNITY, Actuator, Ranges, Rig, Signals
from tests.logs.test_read import LIMITS, SIGNALS, read_columns, table

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module", params=["steps", "sines"])
def example(request):
    """The rig and one of its logs."""
    rig = read_rig(EXAMPLES / "rig.toml")
    return rig, read_logs([EXAMPLES / "logs" / f"{request.param}.csv"], rig.signals, rig.sample_time)


def slipped(logs, only=None, faster=1.0, exchange=(), **slips) -> list[Experiment]:
    """The logs with functions applied to roles, two exchanged, only some kept, or another clock."""
    changed = []
    for log in logs:
        signals = {role: slips.get(role, lambda y: y)(y) for role, y in log.signals.items()}
        if exchange:
            a, b = exchange
            signals[a], signals[b] = signals[b], signals[a]
        signals = {role: y for role, y in signals.items() if only is None or role in only}
        changed.append(
            replace(log, signals=signals, sample_time=log.sample_time * faster, start=log.start * faster)
        )
    return changed


def times(factor):
    return lambda y: factor * y


ALL = ("command", "pressure", "curvature", "output")
SLIPS = {
    "psi": (dict(pressure=times(14.5038)), "pressure in psi instead of bar"),
    "kPa": (dict(pressure=times(100.0)), "pressure in kPa instead of bar"),
    "mbar": (dict(pressure=times(1000.0)), "pressure in mbar instead of bar"),
    "1/cm": (dict(output=times(10.0), curvature=times(10.0)), "curvature and output in 1/cm instead of 1/mm"),
    "output in 1/cm": (dict(output=times(10.0)), "output in 1/cm instead of 1/mm"),
    "both signs": (dict(output=times(-1.0), curvature=times(-1.0)), "sign of curvature and output flipped"),
    "camera in 1/m": (dict(curvature=times(1000.0)), "curvature in 1/m instead of 1/mm"),
    "output in 1/m": (dict(output=times(1000.0)), "output in 1/m instead of 1/mm"),
    "per cent": (dict(command=times(10.0)), "command in per cent instead of V"),
    "millivolts": (dict(command=times(1000.0)), "command in mV instead of V"),
    "sign of output": (dict(output=times(-1.0)), "sign of output flipped"),
    "sign of pressure": (dict(pressure=times(-1.0)), "sign of pressure flipped"),
    "sign of command": (dict(command=times(-1.0)), "sign of command flipped"),
    "gauge and camera": (dict(exchange=("pressure", "curvature")), "pressure and curvature exchanged"),
    "gauge and output": (dict(exchange=("pressure", "output")), "columns of pressure and output exchanged"),
    "camera and sensor": (dict(exchange=("curvature", "output")), "curvature and output exchanged"),
    "absolute": (dict(pressure=lambda p: p + 1.013), "absolute instead of gauge pressure"),
    "minutes": (dict(faster=1 / 60), "minutes instead of seconds"),
    "row numbers": (dict(faster=50.0), "row numbers instead of seconds"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_each_slip_is_named_in_one_warning(example, slip):
    rig, logs = example
    how, words = SLIPS[slip]
    said = doubts(rig, slipped(logs, **how))
    assert len(said) == 1
    with pytest.raises(LogError, match=words):
        raise LogError(said[0], "", "")


SHORT = {
    "psi": (("pressure", "output"), dict(pressure=times(14.5038)), "psi"),
    "kPa": (("pressure", "output"), dict(pressure=times(100.0)), "kPa"),
    "1/cm": (("pressure", "output"), dict(output=times(10.0)), "output in 1/cm"),
    "command and output, per cent": (("command", "output"), dict(command=times(10.0)), "per cent"),
    "command and output, sign": (("command", "output"), dict(output=times(-1.0)), "sign of output"),
    "gauge and output": (("pressure", "output"), dict(exchange=("pressure", "output")), "exchanged"),
    "absolute": (("pressure", "output"), dict(pressure=lambda p: p + 1.013), "absolute"),
    "minutes": (("pressure", "output"), dict(faster=1 / 60), "minutes"),
}


@pytest.mark.parametrize("slip", SHORT)
def test_slips_in_logs_of_two_columns(example, slip):
    rig, logs = example
    only, how, words = SHORT[slip]
    said = doubts(rig, slipped(logs, only, **how))
    assert len(said) == 1 and words in said[0]


BARE = {
    "psi": (dict(pressure=times(14.5038)), "allows 0.25: 12.2 times; .*psi instead of bar"),
    "per cent": (dict(command=times(50.0)), "per cent"),
    "sign": (dict(output=times(-1.0)), "sign of output flipped"),
    "gauge and output": (dict(exchange=("pressure", "output")), "pressure and output exchanged"),
    "absolute": (dict(pressure=lambda p: p + 1.013), "absolute"),
}


@pytest.mark.parametrize("slip", BARE)
def test_ranges_alone_tell_gross_slips(slip):
    """Without a model of the stages, as before an identification."""
    rig = read_rig(EXAMPLES / "rig.toml")
    logs = read_logs([EXAMPLES / "logs" / "steps.csv"], rig.signals, rig.sample_time)
    how, words = BARE[slip]
    rig = replace(rig, actuator=None, regulator=UNITY, sensor=UNITY)
    (said,) = doubts(rig, slipped(logs, **how))
    with pytest.raises(LogError, match=words):
        raise LogError(said, "", "")
    assert doubts(rig, logs) == ()


def test_a_range_exceeded_without_a_known_unit_is_said_from_half_as_much_again_on():
    def said(factor):
        log = Experiment("a", 0.01, {"command": np.ones(50), "output": factor * np.linspace(0, 1, 50)})
        return by_ranges([log], {"output": (0.0, 1.0)}, {"output": "angle"})

    assert said(1.45) == () and "1.6 times; correct [ranges]" in said(1.6)[0]


def _noisy(rng, y):
    noise = rng.uniform(0.0, 0.02) * rng.normal(size=len(y))
    return y + np.ptp(y) * (noise + 0.05 * rng.normal())


def varied(rng) -> tuple[Rig, list[Experiment]]:
    """A nominal rig, and logs of one that departs from it as real ones do."""
    top = float(10 ** rng.uniform(-2, 3))
    gain = float(10 ** rng.uniform(-3, 2))
    speed, T = rng.uniform(5.0, 60.0), rng.uniform(0.1, 3.0)
    alpha, bend = rng.uniform(0.5, 1.2), rng.uniform(0.0, 1.5)
    volts = rng.choice([5.0, 10.0, 24.0])
    rig = Rig(
        "varied",
        0.02,
        Signals("t", "y", "u", "p", "kappa"),
        Actuator(T, alpha, (gain, bend * gain / top)),
        TransferFunction([(speed * top / volts, 0.0)], [(1.0, 1.0), (speed, 0.0)]),
        TransferFunction([(10.0, 0.0)], [(1.0, 1.0), (10.0, 0.0)]),
        Ranges((0.0, volts), (0.0, top), (0.0, gain * (1.0 + bend) * top)),
    )
    real = replace(
        rig,
        actuator=Actuator(
            T * rng.uniform(0.7, 1.4), alpha, tuple(rng.uniform(0.72, 1.4) * g for g in rig.actuator.gain)
        ),
    )
    step = 0.02 * rng.choice([0.2, 1.0, 1.0, 4.0])
    time = np.arange(0.0, 30.0, step)
    shapes = [
        np.repeat(rng.uniform(0.0, 1.0, 6), -(-len(time) // 6))[: len(time)],
        0.5 + 0.5 * np.sin(2 * np.pi * rng.uniform(0.05, 0.5) * time),
        np.where(time > 1.0, 1.0, 0.0),
    ]
    share = rng.choice([0.3, 0.6, 1.0])
    commands = [share * volts * shape for shape in shapes]
    inputs = [Experiment(f"{i}", step, {"command": u}, 100.0 * i) for i, u in enumerate(commands)]
    logs = []
    for log, made in zip(inputs, simulate_session(real, inputs)):
        noisy = {role: _noisy(rng, y) for role, y in made.items()}
        logs.append(replace(log, signals={**log.signals, **noisy}))
    only = [ALL, ("command", "pressure", "output"), ("pressure", "output"), ("command", "output")]
    return rig, slipped(logs, only[rng.integers(4)])


def test_honest_logs_of_varied_rigs_stay_silent():
    """Gains off by up to 40 %, a third of the range, offsets, noise, 12.5 to 250 Hz for a rig of 50 Hz."""
    rng = np.random.default_rng(9)
    said = [doubts(*varied(rng)) for _ in range(100)]
    assert [s for s in said if s] == []


def test_the_example_logs_stay_silent(example):
    rig, logs = example
    assert doubts(rig, logs) == ()
    for only in (("pressure", "output"), ("command", "output"), ("command", "pressure", "output")):
        assert doubts(rig, slipped(logs, only)) == ()
    assert doubts(rig, slipped(logs, faster=4.0)) == (), "a log at a quarter of the rate"
    assert doubts(replace(rig, sample_time=0.8), logs) == (), "a fortieth of the sample time, and no minutes"
    shifted = slipped(logs, pressure=lambda p: p + 0.08, output=lambda y: y + 0.012)
    assert doubts(rig, shifted) == (), "offsets"
    far = slipped(logs, curvature=lambda y: y + 1.0)
    assert doubts(rig, far) == (), "a camera's arbitrary zero"
    exchanged = slipped(logs, exchange=("curvature", "output"), output=lambda y: y + 1.0)
    assert "curvature and output exchanged" in doubts(rig, exchanged)[0], "whatever the camera's zero"


@pytest.mark.parametrize("one, other", [("command", "pressure"), ("curvature", "output")])
def test_a_column_in_two_places_is_told(example, one, other):
    """Noise and all: no stage between them would leave that, but one that is 1."""
    rig, logs = example
    twice = [replace(log, signals={**log.signals, other: log[one].copy()}) for log in logs]
    (told,) = doubts(rig, twice)
    assert f"{other} holds the same samples as {one}" in told
    passing = replace(rig, regulator=UNITY, sensor=UNITY)
    assert not any("same samples" in line for line in doubts(passing, twice))


def test_an_absolute_pressure_within_the_range_is_told_by_the_command_at_rest():
    """A range of 6 bar; the same values in an unnamed unit, or with the command up, may be right."""
    command = np.repeat([0.0, 2.0, 6.0, 0.0], 100)
    limits = {"command": (0.0, 10.0), "pressure": (0.0, 6.0)}

    def said(command, column):
        pressure = 1.013 + 0.5 * np.repeat([0.0, 2.0, 6.0, 0.0], 100)
        log = Experiment("a", 0.01, {"command": command, "pressure": pressure})
        return by_ranges([log], limits, {"pressure": column})

    assert "absolute" in said(command, "p_bar")[0]
    assert said(command, "p") == () and said(command + 2.0, "p_bar") == () and said(command, "p_kPa") == ()


def test_a_gain_that_is_read_as_offset_and_slope_is_told(example, tmp_path, capsys):
    """``gain = [0, 0.4]`` was read without a word, and settles at 0.4 p²."""
    rig, logs = example
    meant = replace(rig, actuator=replace(rig.actuator, gain=(0.0, 0.4)))
    (warning,) = doubts(meant, logs)
    assert "settles at begins as 0.4 p^2" in warning and "gain = [0.4] for a constant gain?" in warning
    for sound in ((0.4,), (1e-9, 0.4), (0.0,)):
        found = doubts(replace(rig, actuator=replace(rig.actuator, gain=sound)), logs)
        assert not any("p^2" in warning for warning in found)
    write_rig(meant, tmp_path / "rig.toml")
    main(["design", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "c.toml")])
    assert "note: the actuator's gain = [0, 0.4] is K(p) = gain[0] + gain[1] p" in capsys.readouterr().out


def test_units_by_name():
    assert unit_of("p_psi") == ("pressure", "psi") and unit_of("u [V]") == ("voltage", "V")
    assert unit_of("kappa_1pm") == ("curvature", "1/m") and unit_of("1/mm") == ("curvature", "1/mm")
    assert unit_of("y") is None and unit_of("velocity") is None and unit_of("a") is None
    assert hint("pressure", "p_bar", 80.0) == "pressure in kPa instead of bar?"
    assert hint("pressure", "p_bar", 1.0) == ""


def test_one_table_names_the_unit_of_any_column():
    """Units that tell a role in any spelling, others after an underscore only."""
    names = ("p_kpa", "u [V]", "kappa_per_mm", "rate_per_s", "force_kN", "N", "x_n", "y", None)
    found = [unit_named(name) for name in names]
    assert found == ["kPa", "V", "1/mm", "1/s", "kN", "", "", "", ""]


def test_a_name_that_ends_in_two_units_has_both_or_none():
    """A motor's omega_rad_s was in seconds, in the diagnosis, the pictures and the C."""
    names = (
        "omega_rad_s",
        "omega_rad_per_s",
        "v_mm_s",
        "k_N_per_mm",
        "torque_N_m",
        "slew_V_s",
        "kappa_cam_per_mm",
    )
    assert [unit_named(n) for n in names] == ["rad/s", "rad/s", "mm/s", "N/mm", "", "", "1/mm"]
    assert unit_of("k_N_per_mm") is None  # no curvature
    assert [unit_named(n) for n in ("p_1_bar", "p_A_bar", "m_s")] == ["bar", "bar", "s"]


def test_what_is_beyond_doubt_is_refused_with_the_likely_unit(tmp_path):
    with pytest.raises(LogError, match="pressure reaches 150 .*mbar instead of bar"):
        read_columns(tmp_path, table(p_bar=1e3 * table()["p_bar"]), limits=LIMITS)
    (log,) = read_columns(tmp_path, table(p_bar=14.5 * table()["p_bar"]), limits=LIMITS)
    assert "psi" in by_ranges([log], LIMITS, SIGNALS.columns())[0]


def test_replay_warns_and_notes_once(tmp_path, capsys):
    """psi in the file, and samples missing: one line each."""
    rig = read_rig(EXAMPLES / "rig.toml")
    write_rig(rig, tmp_path / "rig.toml")
    lines = (EXAMPLES / "logs" / "steps.csv").read_text().splitlines()
    kept = [lines[0]]
    for i, line in enumerate(lines[1:5601]):
        cells = line.split(",")
        cells[3] = f"{14.5038 * float(cells[3]):.4f}"
        if i % 2800 != 500:
            kept.append(",".join(cells))
    (tmp_path / "log.csv").write_text("\n".join(kept) + "\n")
    assert main(["replay", str(tmp_path / "rig.toml"), str(tmp_path / "log.csv")]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert [line for line in printed if "psi" in line and line.startswith("warning: ")] != []
    assert sum(line.startswith(("warning: ", "note: ")) for line in printed) == 2
    assert any(line.startswith("note: all experiments: samples missing") for line in printed)
