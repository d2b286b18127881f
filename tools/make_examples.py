"""Make the example rig and its logs, the same bytes every time:  python tools/make_examples.py

The logs are synthetic. They come from the nominal rig of the paper with one thing added that its model does
not have, an actuator that unloads more slowly than it loads, and with noise on every signal. So a fractional
model fits the positive steps well, and fails where the paper's fails: when the pressure falls.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.files import write_rig
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Actuator, Ranges, Rig, Signals

STEP = 0.02  # s
LEVELS = (0.075, 0.1, 0.125, 0.15, 0.175, 0.2)  # bar
FREQUENCIES = (0.05, 0.1, 0.2, 0.4)  # Hz
UNLOADING = {"name": "unloading_asymmetry", "form": "speed", "stage": "actuator", "unloading_speed": 0.4}
NOISE = {"pressure": 0.0006, "curvature": 0.00008, "output": 0.00008}  # bar, 1/mm, 1/mm
DIGITS = {"command": 3, "pressure": 4, "curvature": 6, "output": 6}


def nominal() -> Rig:
    """Eq. (1), (2) and (5); the line K(p) and the sample time are ours."""
    return Rig(
        name="spba",
        sample_time=STEP,
        signals=Signals("t_s", "kappa_per_mm", "u_V", "p_bar", "kappa_cam_per_mm", None, "run"),
        actuator=Actuator(1.32, 0.6, (0.0015, 0.345)),
        regulator=TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)]),
        sensor=TransferFunction([(10, 0)], [(1, 1), (10, 0)]),
        ranges=Ranges((0.0, 10.0), (0.0, 0.25), (0.0, 0.02)),
    )


def steps(rig: Rig) -> list[Experiment]:
    """A second of rest, 40 s at a level, 15 s of release; one experiment a level."""
    time = np.arange(0.0, 56.0, STEP)
    held = (time >= 1.0) & (time < 41.0)
    return [
        _experiment(f"{level:.3f}", held * level / rig.regulator.dc_gain, 100.0 * i)
        for i, level in enumerate(LEVELS)
    ]


def sines(rig: Rig) -> list[Experiment]:
    """0.05 bar around 0.1 bar, Fig. 8: four periods after a ramp to the middle, at least 40 s."""
    made = []
    for i, frequency in enumerate(FREQUENCIES):
        time = np.arange(0.0, 10.0 + max(40.0, 4.0 / frequency), STEP)
        ramp = np.clip(time / 5.0, 0.0, 1.0)
        pressure = 0.1 * ramp + 0.05 * np.sin(2.0 * np.pi * frequency * (time - 10.0)) * (time >= 10.0)
        made.append(_experiment(f"{frequency:g} Hz", pressure / rig.regulator.dc_gain, 1000.0 + 200.0 * i))
    return made


def _experiment(name: str, command: np.ndarray, start: float) -> Experiment:
    return Experiment(name, STEP, {"command": np.round(command, DIGITS["command"])}, start)


def noisy(signals: dict[str, np.ndarray], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """White noise, and as much again with a pole at 0.9."""
    out = {}
    for role, clean in signals.items():
        white, driving = rng.normal(size=(2, len(clean)))
        slow = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], driving)
        out[role] = clean + NOISE[role] * np.sqrt(0.5) * (white + slow)
    return out


def csv(rig: Rig, experiments: list[Experiment], rng: np.random.Generator) -> str:
    """One table of experiments, a column ``run`` telling them apart."""
    roles = ("command", "pressure", "curvature", "output")
    columns = rig.signals.columns()
    lines = [",".join(["run", "t_s", *(columns[role] for role in roles)])]
    real = replace(rig, effects=(UNLOADING,))
    for experiment, clean in zip(experiments, simulate_session(real, experiments)):
        table = {**experiment.signals, **noisy(clean, rng)}
        for k, time in enumerate(experiment.time):
            cells = (f"{table[role][k]:.{DIGITS[role]}f}" for role in roles)
            lines.append(",".join([experiment.name, f"{time:.2f}", *cells]))
    return "\n".join(lines) + "\n"


def main() -> None:
    folder = Path(__file__).resolve().parents[1] / "examples"
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    rig, rng = nominal(), np.random.default_rng(20)
    write_rig(rig, folder / "rig.toml")
    (folder / "logs" / "steps.csv").write_text(csv(rig, steps(rig), rng))
    (folder / "logs" / "sines.csv").write_text(csv(rig, sines(rig), rng))


if __name__ == "__main__":
    main()
