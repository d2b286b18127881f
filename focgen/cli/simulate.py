"""``focgen simulate``: the closed loop of rig and controller."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from focgen.cli.outcome import Outcome
from focgen.control.controller import ARITHMETICS
from focgen.loop.simulate import simulate
from focgen.output import write_files
from focgen.report.control import simulation_pictures
from focgen.report.control_summary import simulation_payload, simulation_text

HELP = "the closed loop of rig and controller at a row of set points"
EXAMPLE = """example:
  focgen simulate identified.toml controller.toml --setpoints 0.002 0.006 0.01 0.014 --report pictures

  steps the loop from rest to each set point, with the controller bit for bit as it will run, with the ideal
  one, and with the rig's gain frozen. Exit status 1 where a set point is not reached and held."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("rig", metavar="RIG", help="rig.toml")
    parser.add_argument("controller", metavar="CONTROLLER", help="controller.toml")
    parser.add_argument(
        "--setpoints",
        type=float,
        nargs="+",
        metavar="Y",
        help="outputs to step to (default: tenths 1 … 7 of the output's range)",
    )
    parser.add_argument("--consecutive", action="store_true", help="one after the other, not each from rest")
    parser.add_argument("--duration", type=float, metavar="S", help="time at each set point, s")
    parser.add_argument(
        "--delay", type=int, default=1, choices=(0, 1), help="computation delay, samples (default: 1)"
    )
    parser.add_argument("--arithmetic", choices=ARITHMETICS, help="instead of the controller's")
    parser.add_argument("--length", type=int, metavar="L", help="memory length instead of the controller's")
    parser.add_argument("--report", metavar="DIR", help="write pictures of output and command there")


def run(args: Namespace) -> Outcome:
    result = simulate(
        args.rig,
        args.controller,
        args.setpoints,
        consecutive=args.consecutive,
        duration=args.duration,
        delay=args.delay,
        arithmetic=args.arithmetic,
        length=args.length,
    )
    text = simulation_text(result)
    if args.report:
        write_files(args.report, simulation_pictures(result), [args.rig, args.controller])
        text += f"\npictures in {args.report}"
    return Outcome(simulation_payload(result), text, result.holds)
