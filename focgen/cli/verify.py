"""``focgen verify``: generated C against the reference."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from focgen.cli.outcome import Outcome, plain
from focgen.verification.verify import TARGETS, TargetResult, Verification, verify

HELP = "compile generated C and compare it with the reference, sample for sample"
EXAMPLE = """example:
  focgen verify firmware --samples 100000

  compiles the folder's C, runs it on steps, noise, saturation, schedule ends, resets and tracking, and on
  the inputs that take every sum to its proved worst case. Every bit of output, increment and flags has to
  agree with the Python reference, and the errors have to stay within the manifest's bounds. Exit
  status 1 where they do not."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="a folder that focgen generate has written")
    parser.add_argument(
        "--samples", type=int, default=10_000, metavar="N", help="samples of mixed inputs (default: 10000)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the inputs (default: 0)")
    parser.add_argument(
        "--target", default="host", choices=(*TARGETS, "all"), help="where to run it (default: host)"
    )


def run(args: Namespace) -> Outcome:
    found = verify(args.folder, args.samples, args.seed, args.target)
    payload = {
        "name": found.name,
        "arithmetic": found.arithmetic,
        "targets": {name: _entry(result) for name, result in found.targets.items()},
        "differences": list(found.differences),
        "holds": found.holds,
    }
    return Outcome(payload, verification_text(found), found.holds)


def _entry(result: TargetResult) -> dict[str, Any]:
    """A target in JSON: why it was skipped and nothing else, or what was seen there."""
    if result.skipped is not None:
        return {"skipped": result.skipped}
    entry = plain(result)
    del entry["skipped"]
    return entry


def verification_text(found: Verification) -> str:
    """The verification for people."""
    lines = [f"{found.name} ({found.arithmetic})"]
    lines += [f"  {name}: {_result(result)}" for name, result in found.targets.items()]
    lines += [f"  {difference}" for difference in found.differences]
    return "\n".join([*lines, "verified" if found.holds else "NOT verified"])


def _result(result: TargetResult) -> str:
    if result.skipped:
        return f"skipped: {result.skipped}"
    if result.max_error is None:
        return result.first
    bound, error = result.error_bound, result.max_error
    lines = [f"{result.samples - result.mismatches} of {result.samples} samples equal in every bit"]
    if result.first:
        lines.append(f"first difference: {result.first}")
    lines += result.header
    lines.append(
        f"largest error {error.operator:.3g} ahead of the integrator, bound {bound['operator']:.3g}"
        f"{'' if result.within else ': EXCEEDED'}; {error.output:.3g} at the output, which may grow by "
        f"{bound['output_per_sample']:.3g} a sample"
    )
    return "\n    ".join(lines)
