"""``python -m tests.records``: diagnose each benchmark's training record, replay what was found on the test.

The data are looked for in ``--data`` or in the folder that FOCGEN_DATA names; what is absent is skipped. The
test is read only for the last column of the table. Rows are kept in ``--out``: an interrupted run goes on,
with ``--again`` all are measured anew.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import focgen
from focgen.custody import sha256_of
from focgen.diagnosis.diagnose import diagnose
from focgen.logs.experiment import Experiment
from focgen.output import write_file
from focgen.rig.files import read_rig
from focgen.rig.replay import experiments, replay
from focgen.rig.rig import Rig
from tests.records import made
from tests.records.benchmarks import BENCHMARKS, Benchmark

HEAD = (
    "benchmark",
    "verdict",
    "train, nominal refitted",
    "train",
    "test",
    "published (test)",
    "s of one core",
)


def main() -> None:
    """Print the table, a row a benchmark, as it is made."""
    parser = argparse.ArgumentParser(prog="python -m tests.records", description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FOCGEN_DATA", "data")))
    parser.add_argument("--out", type=Path, default=Path("build/records"))
    parser.add_argument("names", nargs="*", help="only those whose name begins so")
    parser.add_argument("--again", action="store_true", help="measure what was measured before, too")
    given = parser.parse_args()
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|", flush=True)
    for benchmark in BENCHMARKS:
        if given.names and not any(benchmark.name.startswith(name) for name in given.names):
            continue
        missing = [f for f in (benchmark.train, benchmark.test) if not (given.data / f).exists()]
        row = [benchmark.name, f"skipped: {given.data} has no {missing[0]}"] if missing else None
        print(
            "| " + " | ".join(row or _row(benchmark, given.data, given.out, given.again)) + " |", flush=True
        )


def _row(benchmark: Benchmark, data: Path, out: Path, again: bool) -> list[str]:
    """The row that was kept of the same benchmark, data and version of focgen; else measured."""
    place = out / benchmark.name / "row.json"
    digests = [sha256_of(data / file) for file in (benchmark.train, benchmark.test)]
    made_from = [repr(benchmark), *digests, focgen.__version__]
    if not again and place.is_file():
        kept = json.loads(place.read_text(encoding="utf-8"))
        if kept["made_from"] == made_from:
            return kept["row"]
    row = measured(benchmark, data, out)
    write_file(place, json.dumps({"made_from": made_from, "row": row}) + "\n")
    return row


def measured(benchmark: Benchmark, data: Path, out: Path) -> list[str]:
    """One row of the table."""
    out = out / benchmark.name
    out.mkdir(parents=True, exist_ok=True)
    (out / "rig.toml").write_text(benchmark.rig, encoding="utf-8")
    rig, began = read_rig(out / "rig.toml"), time.process_time()
    train = _training(benchmark, rig, data)
    found = diagnose(rig, train, out=out, pictures=False)
    took = time.process_time() - began
    refitted, augmented = (read_rig(out / name) for name in ("refitted.toml", "augmented.toml"))
    test = experiments(rig, [data / benchmark.test])
    errors = [_error(r, logs, p) for r, logs, p in (
        (refitted, train, 1), (augmented, train, 1), (augmented, test, benchmark.periods)
    )]  # fmt: skip
    numbers = [f"{benchmark.scale * e:.3g} {benchmark.unit}" for e in errors]
    return [benchmark.name, _verdict(found), *numbers, benchmark.published, f"{took:.0f}"]


def _training(benchmark: Benchmark, rig: Rig, data: Path) -> tuple[Experiment, ...]:
    if not benchmark.made:
        return experiments(rig, [data / benchmark.train])
    columns = getattr(made, benchmark.made)()
    roles = {role: columns[column] for role, column in rig.signals.columns().items()}
    return (Experiment("made", rig.sample_time, roles),)


def _verdict(found) -> str:
    causes = "; ".join(
        ", ".join(f"`{c.effect}` {c.confidence:.2f}" for c in cause.candidates) for cause in found.causes
    )
    return f"{found.verdict}: {causes}" if causes else found.verdict


def _error(rig: Rig, logs, periods: int) -> float:
    """The root mean square error of the output; of the last of ``periods`` run one after the other."""
    logs = [_repeated(log, periods) for log in logs]
    simulated = replay(rig, logs).simulated
    last = [len(log) // periods * (periods - 1) for log in logs]
    squares = [
        np.mean((log["output"] - simulated[log.name]["output"])[k:] ** 2) for log, k in zip(logs, last)
    ]
    return float(np.sqrt(np.mean(squares)))


def _repeated(log: Experiment, periods: int) -> Experiment:
    signals = {role: np.tile(np.asarray(values, float), periods) for role, values in log.signals.items()}
    return replace(log, signals=signals, raw_time=None, rows=None)


if __name__ == "__main__":
    main()
