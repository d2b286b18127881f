"""From what happened to what is logged: sampling, noise, quantisation, and the files."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.present import present
from focgen.rig.rig import Signals
from focgen.trials.machine import Trace

MEASURED = ("pressure", "curvature", "output")


@dataclass(frozen=True)
class Recorder:
    """How this rig's logs are taken.

    ``noise`` rms and ``lsb`` by signal, in its units; ``skew`` s by which the measured columns are taken
    after their time stamp; ``jitter`` largest deviation of a sample from its instant, s; ``absolute``:
    whether the time stamps run through the session; ``one_file``: whether a column separates the experiments;
    ``time_unit``: s of the log for each s of the generator.
    """

    noise: dict[str, float]
    lsb: dict[str, float]
    skew: float
    jitter: float
    absolute: bool
    one_file: bool
    time_unit: float = 1.0


def draw_recorder(rng: np.random.Generator, spans: dict[str, float], Ts: float) -> Recorder:
    """Noise 0.4 to 2 % of each span, 11 to 16 bits, and in half of the cases each a jitter and a skew."""
    noise = {
        name: span * 10.0 ** rng.uniform(np.log10(0.004), np.log10(0.02)) for name, span in spans.items()
    }
    if "pressure" in noise:
        noise["pressure"] *= 0.6
    lsb = {name: float(1.3 * span / 2 ** rng.integers(11, 17)) for name, span in spans.items()}
    jitter = rng.uniform(0.005, 0.04) * Ts if rng.random() < 0.5 else 0.0
    skew = rng.uniform(-0.5, 0.5) * Ts if rng.random() < 0.5 else 0.0
    return Recorder(noise, lsb, skew, jitter, bool(rng.random() < 0.5), bool(rng.random() < 0.3))


def coloured(rng: np.random.Generator, count: int, level: float) -> Array:
    """Noise of rms ``level``: half of its power white, half with a pole at 0.9; shape (count,)."""
    white, other = rng.normal(size=(2, count + 100))
    slow = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], other)
    made: Array = level * np.sqrt(0.5) * (white + slow)[100:]
    return made


def quantised(values: Array, lsb: float) -> Array:
    """Rounded to the converter's steps."""
    return lsb * np.round(values / lsb)


class Reader(Protocol):
    """A session that reads an output (n,) as the rig's converter does."""

    def read(self, output: Array) -> Array:
        """The samples, a new array."""


def sample(
    trace: Trace, Ts: float, recorder: Recorder, session: Reader, rng: np.random.Generator
) -> dict[str, Any]:
    """The log of one experiment by role, ``time`` included: arrays (n,); ``noise`` is that of the output."""
    count = round(len(trace.command) * trace.h / Ts)
    instants = np.arange(count) * Ts
    if recorder.jitter:
        instants = np.abs(instants + rng.uniform(-recorder.jitter, recorder.jitter, count))
    held = np.minimum((instants / trace.h + 1e-6).astype(int), len(trace.command) - 1)
    columns = {"time": instants + (trace.clock if recorder.absolute else 0.0), "command": trace.command[held]}
    for name in MEASURED:
        clean = np.interp(instants + recorder.skew, trace.time, getattr(trace, name))
        noise = coloured(rng, count, recorder.noise[name])
        noisy = clean + noise
        if name == "output":
            noisy, columns["noise"] = session.read(noisy), noise
        columns[name] = quantised(noisy, recorder.lsb[name])
    return columns


def floor_of(logs: Sequence[tuple[str, dict[str, Any]]]) -> float:
    """The rms of the output's noise over the experiments, each counted alike."""
    return float(np.sqrt(np.mean([np.mean(np.square(columns["noise"])) for _, columns in logs])))


def as_csv(rows: Sequence[tuple[str, dict[str, Any]]], signals: Signals, time_unit: float, runs: bool) -> str:
    """One CSV of one or more experiments (name, columns by role)."""
    roles = ["time", *signals.columns()]
    names = [signals.time, *signals.columns().values()]
    out = io.StringIO()
    out.write(",".join(([present(signals.run)] if runs else []) + names) + "\n")
    for name, columns in rows:
        lead = f"{name}," if runs else ""
        table = np.stack([columns["time"] * time_unit, *(columns[role] for role in roles[1:])], axis=1)
        body = io.StringIO()
        np.savetxt(body, table, fmt=["%.9g"] + ["%.7g"] * (len(roles) - 1), delimiter=",")
        out.write("".join(lead + line + "\n" for line in body.getvalue().splitlines()))
    return out.getvalue()
