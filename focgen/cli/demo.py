"""``focgen demo``: the whole chain on the example logs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, is_page, write_report
from focgen.demonstration import Demo, demo
from focgen.present import present
from focgen.report.demo_page import demo_lead, diagnosis_sentence, firmware_table
from focgen.report.page import text_table

EXAMPLE = """example:
  focgen demo --out build/demo

  takes less than a minute and ends with build/demo/report.html."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="the folder to write")
    parser.add_argument(
        "--force", action="store_true", help="replace files also where no earlier demo has written them"
    )
    add_report(parser)


def run(args: Namespace) -> Outcome:
    check_report(args.report, (), args.out if is_page(args.report) else None)
    made = demo(args.out, args.force)
    folder = made.folder / "pictures"
    if is_page(args.report):
        told = write_report(args.report, made.report.read_text(encoding="utf-8"), ())
    else:
        pictures = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
        told = write_report(args.report, pictures if args.report else None, ())
    return Outcome(_payload(made), f"{_text(made)}\n{told}", made.holds)


def _payload(made: Demo) -> dict[str, Any]:
    found, designed = made.identification, made.design
    return {
        "paths": {
            "folder": made.folder,
            "report": made.report,
            "rig": made.folder / "identified.toml",
            "controller": made.folder / "controller.toml",
            "firmware": {a: made.folder / "firmware" / a for a in made.generated},
        },
        "identify": {
            "T": present(found.joint).T,
            "alpha": present(found.joint).alpha,
            "gain": present(found.joint).gain,
            "gof": {model: values["mean"] for model, values in found.gof.items()},
        },
        "design": {
            "settling_s": designed.settling_s,
            "overshoot_pct": designed.overshoot_pct,
            "holds": designed.holds,
        },
        "simulate": {
            "settling_s": [s.settling_s for s in made.simulation.setpoints],
            "holds": made.simulation.holds,
        },
        "study": {"recommendation": made.memory.recommendation},
        "verify": {a: v.targets for a, v in made.verified.items()},
        "diagnose": {
            "verdict": made.diagnosis.verdict,
            "sealed": made.sealed,
            "found": [[c.effect for c in cause.candidates] for cause in made.diagnosis.causes],
        },
        "holds": made.holds,
    }


def _text(made: Demo) -> str:
    lead = demo_lead(made.identification, made.design, made.verified)
    return (
        f"\n{lead}\n\n{text_table(firmware_table(made.generated, made.verified))}\n\n"
        f"{made.memory.recommendation}\n\n{diagnosis_sentence(made.diagnosis, made.sealed)}\n\n"
        f"look at  {made.report}\n"
        f"         {made.folder / 'pictures'}\nread     {made.folder / 'firmware' / 'q31'}"
    )
