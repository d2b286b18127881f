"""``python -m tests.equality``: random controllers compared; what was compared is kept."""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path

from focgen.codegen.kernels import TARGETS
from focgen.errors import FocgenError
from tests.equality.drawn import drawn
from tests.equality.one import on_core, on_host
from tests.equality.table import table

_LANES, _SAMPLES = 384, 2048
_CORE_LANES, _CORE_SAMPLES = 8, 2048
_EVERY = 37  # a controller in so many runs on the emulated cores, too: of every kind and arithmetic in turn
_AVR = 0.1  # of what the other cores are given


def main() -> int:
    asked = _asked()
    path = asked.folder / "compared.jsonl"
    if not asked.report:
        asked.folder.mkdir(parents=True, exist_ok=True)
        _compare(asked, path)
    results = _results(path)
    text = table(results)
    (asked.folder / "table.md").write_text(text + "\n", encoding="utf-8")
    print(text)
    return int(any(r["differing"] or not r["within"] for r in results))


def _asked() -> argparse.Namespace:
    given = argparse.ArgumentParser(prog="make equality")
    given.add_argument("--samples", type=float, default=1e9, help="on the host")
    given.add_argument("--controllers", type=int, default=2000, help="at least, on the host")
    given.add_argument(
        "--core-samples", type=float, default=1e7, help="on each emulated core; a tenth on an AVR"
    )
    given.add_argument("--cores", nargs="*", default=list(TARGETS), choices=list(TARGETS))
    given.add_argument("--lanes", type=int, default=_LANES, help="that run side by side on the host")
    given.add_argument("--first", type=int, default=0, help="the first seed")
    given.add_argument("--folder", type=Path, default=Path("build/equality"), help="kept from run to run")
    given.add_argument("--report", action="store_true", help="only print what was compared")
    return given.parse_args()


def _results(path: Path) -> list[dict]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def _compare(asked: argparse.Namespace, path: Path) -> None:
    """Seed after seed, on the host and, every so many, on the cores that lack samples."""
    samples, done, controllers = defaultdict(int), set(), 0
    for r in _results(path):
        samples[r["target"]] += r["samples"]
        done.add((r["seed"], r["target"]))
        controllers += r["target"] == "host"
    wanted = {name: asked.core_samples * (_AVR if name == "avr" else 1.0) for name in asked.cores}
    seed, absent = asked.first, set()
    while (
        samples["host"] < asked.samples
        or controllers < asked.controllers
        or _lacking(samples, wanted, absent)
    ):
        targets = ["host"] if samples["host"] < asked.samples or controllers < asked.controllers else []
        if seed % _EVERY == 0:
            targets += _lacking(samples, wanted, absent)
        waiting = [target for target in targets if (seed, target) not in done]
        one = drawn(seed) if waiting else None
        for target in waiting if one else ():
            host = target == "host"
            found = on_host(one, asked.lanes, _SAMPLES) if host else _there(one, target, absent)
            if found:
                samples[target] += found.samples
                controllers += host
                _keep(path, asdict(found))
        seed += 1


def _lacking(samples: dict, wanted: dict[str, float], absent: set[str]) -> list[str]:
    return [name for name, count in wanted.items() if samples[name] < count and name not in absent]


def _there(one, target: str, absent: set[str]):
    """On a core; where there is nothing to run it, it is not asked again."""
    try:
        found = on_core(one, target, _CORE_LANES, _CORE_SAMPLES)
    except FocgenError as fault:
        print(f"seed {one.seed} on {target}: {fault}", file=sys.stderr)
        return None
    if found is None and not (target == "avr" and one.plan.arithmetic == "f64"):
        absent.add(target)
        print(f"{target}: nothing here compiles for it or emulates it", file=sys.stderr)
    return found


def _keep(path: Path, line: dict) -> None:
    with open(path, "a", encoding="utf-8") as out:
        out.write(json.dumps(line) + "\n")
    said = f"{line['seed']:6} {line['target']:14} {line['kind']:14} {line['arithmetic']} {line['samples']:9}"
    ratio = 1.0 / max(line["share"], 1e-300)
    print(f"{said} {line['differing']} bound/worst {ratio:.3g} {line['seconds']:.1f} s", flush=True)


if __name__ == "__main__":
    sys.exit(main())
