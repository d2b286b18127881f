"""``focgen simulate``: the closed loop of rig and controller."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, write_report
from focgen.control.controller import ARITHMETICS
from focgen.loop.simulate import simulate
from focgen.report.control import simulation_pictures
from focgen.report.control_summary import simulation_payload, simulation_text
from focgen.report.pages.control import simulation_page

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
    add_report(parser)


def run(args: Namespace) -> Outcome:
    given = [args.rig, args.controller]
    check_report(args.report, given)
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
    shown = drawn(args.report, lambda: simulation_page(result), lambda: simulation_pictures(result))
    text += "\n" + write_report(args.report, shown, given)
    return Outcome(simulation_payload(result), text, result.holds)
