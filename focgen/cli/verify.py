"""``focgen verify``: generated C against the reference."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from focgen.cli.outcome import Outcome
from focgen.present import present
from focgen.report.firmware_summary import verification_payload
from focgen.verification.compare import TargetResult
from focgen.verification.verify import TARGETS, Verification, verify

EXAMPLE = """example:
  focgen verify firmware --samples 100000

  compiles the folder's C, runs it on steps, noise, saturation, schedule ends, resets and tracking, and on
  the inputs that take every sum to its proved worst case. Every bit of output, increment and flags has to
  agree with the Python reference, and the errors have to stay within the manifest's bounds. Exit
  status 1 where they do not.

  The folder is rendered anew first. Where its C, headers, manifest or controller.toml have been edited, that
  is said, nothing is compiled unless --edited asks for it, and the exit status is 1. A folder is code: do not
  verify a stranger's with --edited outside a sandbox.

  focgen verify firmware --target all

  does the same on emulated microcontrollers, with every cross compiler and emulator that is installed;
  pip install 'focgen[targets]' is enough for all but the AVR. What is skipped is said, with its remedy."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="a folder that focgen generate has written")
    parser.add_argument(
        "--samples", type=int, metavar="N", help="mixed inputs (default: 10000; emulated: as takes seconds)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the inputs (default: 0)")
    parser.add_argument(
        "--target", default="host", choices=(*TARGETS, "all"), help="where to run it (default: host)"
    )
    parser.add_argument(
        "--edited", action="store_true", help="compile and run C that is not as it was generated, too"
    )


def run(args: Namespace) -> Outcome:
    found = verify(args.folder, args.samples, args.seed, args.target, args.edited)
    return Outcome(verification_payload(found), verification_text(found), found.holds)


def verification_text(found: Verification) -> str:
    """The verification for people."""
    lines = [f"{found.name} ({found.arithmetic})"]
    lines += [f"  {name}: {_result(result)}" for name, result in found.targets.items()]
    lines += [f"  {difference}" for difference in found.differences]
    lines += [f"  note: {note}" for note in found.notes]
    return "\n".join([*lines, _verdict(found)])


def _verdict(found: Verification) -> str:
    if found.holds:
        return "verified"
    return "NOT verified" + (": what ran agrees, but it has been edited" if found.agrees else "")


def _result(result: TargetResult) -> str:
    if result.skipped:
        return f"skipped: {result.skipped}"
    lines = []
    if result.max_error is not None:
        equal = f"{result.samples - result.mismatches} of {result.samples}"
        left = f", and the states of {result.states} runs" if result.states and not result.mismatches else ""
        lines.append(f"{equal} samples equal in every bit{left}")
    if result.first:
        lines.append(f"first difference: {result.first}" if lines else result.first)
    if result.selftest is not None:
        wrong = f"wrong at its step {result.selftest}"
        lines.append(f"self-test: {wrong if result.selftest else '0, agrees'}")
    lines += result.header
    lines += [f"an instruction the core does not have: {one}" for one in result.illegal]
    lines += _errors(result) if result.max_error is not None else []
    lines += [f"with {tool}" for tool in result.tools]
    lines += [f"not with {tool}" for tool in result.absent]
    return "\n    ".join(lines)


def _errors(result: TargetResult) -> list[str]:
    bound, error = present(result.error_bound), present(result.max_error)
    return [
        (
            f"largest error {error.operator:.3g} ahead of the integrator, bound {bound['operator']:.3g}"
            f"{'' if result.within else ': EXCEEDED'}; {error.output:.3g} at the output, which may grow by "
            f"{bound['output_per_sample']:.3g} a sample"
        )
    ]
