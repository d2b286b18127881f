"""``focgen generate``: C for a controller."""

from __future__ import annotations

import argparse

from focgen.cli.outcome import Outcome
from focgen.codegen.generate import PACKAGES, Generated, generate
from focgen.codegen.kernels import TARGETS
from focgen.codegen.packages.package import FMI, check_package
from focgen.control.controller import ARITHMETICS, MEMORIES
from focgen.errors import InputError
from focgen.fractional.continuous import OPERATORS
from focgen.plan.plan import Plan

EXAMPLE = """example:
  focgen generate controller.toml --out firmware --arithmetic q31 --length 1000
  focgen verify firmware
  focgen generate controller.toml --out firmware --memory exponential --tolerance 1e-4 --horizon 1000000
  focgen generate controller.toml --out block --for fmu
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command's arguments."""
    parser.add_argument(
        "controller", metavar="CONTROLLER", help="controller.toml, designed or written by hand"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the C and its manifest")
    parser.add_argument("--arithmetic", choices=ARITHMETICS, help="default: the controller's")
    _add_memory(parser)
    parser.add_argument("--target", metavar="CORE", help=f"sums for a core: {', '.join(TARGETS)}")
    parser.add_argument("--name", help="prefix of every C name; default: the controller's name")
    _add_extras(parser)


def _add_memory(parser: argparse.ArgumentParser) -> None:
    """How much of the past takes part, and in which form."""
    parser.add_argument("--memory", choices=MEMORIES, help="form of the memory; default: the controller's")
    parser.add_argument(
        "--length", type=int, metavar="L", help="past samples that take part; default: the controller's"
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="E",
        help="largest relative error of the exponential memory's weights; "
        "default: the controller's, else 1e-4; of --operator continuous: of its response, default 1e-3",
    )
    parser.add_argument(
        "--horizon",
        type=int,
        metavar="N",
        help="samples back to which --tolerance holds; default: the controller's, else 1000000",
    )
    parser.add_argument(
        "--operator",
        choices=OPERATORS,
        help="what the exponential memory follows: the weights of Gruenwald and Letnikov (gl),"
        " or s^alpha itself over a band of frequencies, within --tolerance of it;"
        " default: the controller's, else gl",
    )
    parser.add_argument(
        "--band",
        type=float,
        nargs=2,
        metavar=("LOW", "HIGH"),
        help="of --operator continuous, in rad/s; default: the controller's, else four decades up to a tenth"
        " of Nyquist",
    )


def _add_extras(parser: argparse.ArgumentParser) -> None:
    """What is written beside the five functions, and what is left out."""
    parser.add_argument(
        "--selftest", action="store_true", help="add NAME_selftest(), which a board runs: 0 if it agrees"
    )
    parser.add_argument(
        "--no-float", action="store_true", help="leave out NAME_ref_from_f32() and the other conversions"
    )
    parser.add_argument(
        "--tunable",
        action="store_true",
        help="add NAME_tune(): gains and output limits in RAM, within the box of [tunable] in the controller",
    )
    parser.add_argument(
        "--for",
        dest="package",
        action="append",
        type=_package,
        choices=PACKAGES,
        help="what to add to the plain files: a CMake package, an Arduino or PlatformIO library, an FMU",
    )
    parser.add_argument("--fmi", type=int, choices=FMI, help="version of an FMU's interface; default: 3")
    parser.add_argument(
        "--force", action="store_true", help="replace files also where they have been edited since"
    )


def run(args: argparse.Namespace) -> Outcome:
    """Generate and say what was written."""
    made = generate(
        args.controller,
        args.out,
        args.arithmetic,
        args.memory,
        args.length,
        args.name,
        args.target,
        _one(args.package),
        args.tolerance,
        args.horizon,
        args.selftest,
        args.no_float,
        args.operator,
        args.band and tuple(args.band),
        args.tunable,
        args.fmi,
        args.force,
    )
    return Outcome(made.manifest, _text(made))


def _package(name: str) -> str:
    """The name of a package. Raises InputError for one that there is not, with what to do instead."""
    return check_package(name).name


def _one(packages: list[str] | None) -> str:
    """The package that is asked for; each has its own layout, so a folder has one."""
    if packages and len(packages) > 1:
        what = f"is given {len(packages)} times"
        raise InputError("--for", what, "generate each package into a folder of its own")
    return packages[0] if packages else "plain"


def _text(made: Generated) -> str:
    plan, manifest = made.plan, made.manifest
    bound, size, unit = plan.error_bound, manifest["sizes"], plan.controller.units.output
    rate = f"{unit}/s" if plan.integrator and unit else unit
    ahead = "integrator" if plan.integrator else "limits"
    truncation = "no bound" if bound.truncation is None else f"{bound.truncation:.3g} {rate}".rstrip()
    grows = _growth(bound.operator_per_sample)
    within = _within(bound.within_horizon, rate)
    lines = [
        (
            f"{plan.name}: {plan.arithmetic}, {_memory(plan)}, {size['state_bytes']} bytes of state,"
            f" {size['table_bytes']} bytes of tables"
        ),
        f"error ahead of the {ahead}: {grows}at most {bound.operator:.3g} {rate}".rstrip()
        + f"; {_whose(plan)} at most {truncation}{within}",
        *(
            f"short memory: {b['coefficient']:.6g} s^{b['order']:g} is {b['bias']:.3g} at rest instead of 0"
            for b in manifest["memory_bias"]
            if b["bias"]
        ),
        *_least(made),
        f"wrote {', '.join(made.files)} to {made.folder}",
        f"next: focgen verify {made.folder}",
    ]
    return "\n".join(lines)


def _least(made: Generated) -> list[str]:
    """From which error on the integral always moves, and what it cannot hold."""
    least, unit = made.manifest.get("smallest_error"), made.plan.controller.units.measurement
    found = (
        []
        if least is None
        else [f"a steady error always moves the integral from {least:.3g} {unit}".rstrip() + " on"]
    )
    return found + [f"note: {remark}" for remark in made.manifest.get("remarks", [])]


def _whose(plan: Plan) -> str:
    """What the second error is owed to."""
    return "against s^α, for a sine in the band," if plan.band else f"by {plan.memory} memory"


def _memory(plan: Plan) -> str:
    if not plan.exponential:
        return f"{plan.length} past samples"
    said = f"exponential memory of {plan.states} modes, {plan.multiplies} multiplications a step"
    if not plan.band:
        return said
    worst = max((memory.tolerance for memory in plan.memories), default=0.0)
    return f"{said}, {100.0 * worst:.2g} % of s^α from {plan.band[0]:.4g} to {plan.band[1]:.4g} rad/s"


def _within(bound: float | None, unit: str) -> str:
    """Of an exponential memory."""
    return "" if bound is None else f", up to its horizon {bound:.3g} {unit}".rstrip()


def _growth(per_sample: float) -> str:
    """What an inner integral adds to the bound in words; nothing where there is none."""
    return f"grows by at most {per_sample:.3g} a sample, to " if per_sample else ""
