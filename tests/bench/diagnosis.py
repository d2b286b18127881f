"""What a diagnosis costs, in seconds of one core and in replays of the session: 400 s of 100 Hz logs, and
14 000 samples of a plant with a hysteretic spring."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import LinearActuator, Rig, Signals
from focgen.trials import patterns
from focgen.trials.cases import spans_of
from focgen.trials.machine import Machine, Session
from focgen.trials.recording import MEASURED, coloured
from focgen.trials.rigs import draw_chain, nominal_of
from focgen.trials.severity import Trial, calibrate
from focgen.trials.vocabulary import draw_form
from tests.records.made import RATE, bouc_wen

TS, SECONDS, NOISE = 0.01, 400.0, 0.008
DRAWS = 20
HYSTERETIC = 14_000  # samples
NOMINAL = TransferFunction([(1.0, 0.0)], [(2.0, 2.0), (12.0, 1.0), (95000.0, 0.0)])
EFFECTS = (("C", "hysteresis"), ("B", "valve_asymmetry"), ("A", "transport_delay"))


def session(signals: str, effect: str, seed: int = 7):
    """A nominal rig and its logs: about 400 s at 100 Hz, the effect at 8 % of its stage's span."""
    rng = np.random.default_rng(seed)
    rig, full = draw_chain(rng, signals, TS)
    seen, length = [], 0.0
    for experiment in patterns.full(rng, TS):
        if length < SECONDS:
            kept = experiment.levels[: round((SECONDS - length) / TS)]
            seen.append(replace(experiment, levels=kept))
            length += len(kept) * TS
    commands = [e.levels * full for e in seen]
    coarse = Trial(commands, list(np.cumsum([0.0, *(len(c) * TS + 20.0 for c in commands[:-1])])), TS)
    setting, _ = calibrate(
        draw_form(effect, rng, spans_of(rig, full, coarse, coarse.clocks[-1])), rig, coarse, 0.08
    )
    machine = Session(Machine(rig, (setting,)), TS / 4)
    logs = []
    for experiment, command, clock in zip(seen, commands, coarse.clocks):
        trace = machine.run(np.repeat(command, 4), clock)
        columns = {name: getattr(trace, name)[::4] for name in MEASURED if name in rig.signals.columns()}
        noisy = {n: v + coloured(rng, len(v), NOISE * np.ptp(v)) for n, v in columns.items()}
        logs.append(Experiment(experiment.name, TS, {"command": command, **noisy}, start=clock))
    return nominal_of(rig, rng, (0.06, 0.15)), logs


def hysteretic():
    """The nominal rig of the hysteretic benchmark and a record of it."""
    made_of = bouc_wen(samples=HYSTERETIC)
    rig = Rig("mass", 1.0 / RATE, Signals("t", "y", command="f"), LinearActuator(NOMINAL))
    signals = {"command": made_of["f_N"], "output": made_of["y_m"]}
    return rig, [Experiment("made", rig.sample_time, signals)]


def run() -> str:
    """The table."""
    lines = [
        f"Diagnosis of 400 s at 100 Hz, and with a threshold from {DRAWS} simulated sessions",
        f"signals  effect             core s  replays  with {DRAWS}, core s  says",
    ]
    for signals, effect in EFFECTS:
        rig, logs = session(signals, effect)
        with_draws, _ = _timed(lambda: diagnose(rig, logs, bootstrap=DRAWS))
        lines.append(_row(signals, effect, rig, logs, f"{with_draws:15.1f}"))
    return "\n".join([*lines, _row("A", f"spring, {HYSTERETIC}", *hysteretic(), f"{'–':>15s}")])


def _row(signals: str, effect: str, rig, logs, with_draws: str) -> str:
    replay(rig, logs)
    (once, _), (whole, found) = _timed(lambda: replay(rig, logs)), _timed(lambda: diagnose(rig, logs))
    causes = ["/".join(c.effect for c in cause.candidates) for cause in found.causes]
    times = f"{whole:7.1f}  {whole / once:7.0f}  {with_draws}"
    return f"{signals:7s}  {effect:17s}  {times}  {' + '.join(causes) or found.verdict}"


def _timed(what):
    """Seconds of one core, and what came of it."""
    begun = time.process_time()
    found = what()
    return time.process_time() - begun, found
