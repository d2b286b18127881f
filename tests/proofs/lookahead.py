"""What the sums of kernels that look ahead can be, by the phase of the latest step in its group of four.

A block that is being summed reaches what its weights so far give; how far it is depends on the phase, so one
interval a member would not do. The phases are taken apart, and every slot of the rings is a case of its own.
"""

from __future__ import annotations

from focgen.codegen.kernels import Kernels, named_sums
from focgen.codegen.lookahead import AHEAD, LookAhead, Run
from focgen.codegen.state import Member, members
from focgen.plan.formats import Interval, span, weighted
from focgen.plan.plan import Plan
from tests.proofs.harness import arguments, calls, chosen, every, function, program, reachable, within

State = tuple[Interval, ...]


def phases(plan: Plan, kernels: Kernels) -> dict[str, tuple[State, ...]]:
    """By member, for each of the four phases the interval of every one of its sums; not of floating ones."""
    reach = {"error": span(plan.error).hull(0), "filtered": span(plan.filtered)} if not plan.floating else {}
    found = {}
    for name, table in named_sums(plan).items():
        ahead = kernels.ahead(plan, table)
        if ahead and reach:
            found[f"{name}_ahead"] = tuple(_after(ahead, p, reach[table.history]) for p in range(AHEAD))
    return found


def _after(ahead: LookAhead, phase: int, x: Interval) -> State:
    """After a step of that phase: this group's sums, the next group's complete blocks, the block at work."""
    whole, complete, work = [], [], []
    for i in range(AHEAD):
        whole.append(_run(ahead, ahead.slices[AHEAD], i, x)[0])
        done, open_ = _run(ahead, ahead.slices[phase + 1], i, x)
        complete.append(done)
        work.append(open_)
    return (*whole, *complete, *work)


def _run(ahead: LookAhead, count: int, i: int, x: Interval) -> tuple[Interval, Interval]:
    """The complete blocks and the open one of sum ``i`` after so many runs."""
    flat = [w for block in ahead.weights for w in block]
    complete = work = Interval(0, 0)
    for run in ahead.runs[:count]:
        work = work + weighted(_weights(flat, run, i), x)
        if run.ends:
            complete, work = complete + work.shifted(run.shift), Interval(0, 0)
    return complete, work


def _weights(flat: list, run: Run, i: int) -> list:
    begin = run.weights + AHEAD - i
    return flat[begin : begin + AHEAD * run.tiles]


def harness(plan: Plan, kernels: Kernels, asked: set[str]) -> str:
    """C for Eva: a step from every slot, and the other calls, from any state of that slot's phase; afterwards
    the members ``asked`` are within their intervals, and the sums within those of the phase reached.

    Both rings have as many slots and turn together, so their slots are one number. Raises ValueError where
    that is not so.
    """
    ranges, sums = reachable(plan, kernels), phases(plan, kernels)
    rings = [name for name in ("error_now", "filtered_now") if name in ranges]
    if len({ranges[name].high for name in rings}) > 1:
        raise ValueError(f"{plan.name}: the rings have different sizes")
    found = [m for m in members(plan, kernels) if m.name not in rings]
    free, looking = ([m for m in found if (m.name in sums) == is_sum] for is_sum in (False, True))
    state = [line for m in free for line in every(m, chosen(m, ranges.get(m.name)))]
    state += [f"    s.{ring} = now;" for ring in rings] + _switch("now", looking, sums, chosen)
    again = [line for m in free if m.name in asked for line in every(m, within(m, ranges[m.name]))]
    again += [f"    /*@ assert error_now: s.error_now < {plan.name}_ERRORS; */"]
    again += [f"    /*@ assert {ring}: s.{ring} == s.error_now; */" for ring in rings[1:]]
    again += _switch("s.error_now", looking, sums, within)
    step, *others = reversed(calls(plan).values())
    each = (
        f"    for (unsigned now = 0; now < {plan.name}_ERRORS; now++) {{ any_state(now); {step} again(); }}"
    )
    rest = [f"    any_state(0); {call} again();" for call in others]
    main = function("int main", [*arguments(plan), each, *rest])
    return program(plan, [function("static void any_state", state, "unsigned now"),
                          function("static void again", again), main])  # fmt: skip


def _switch(now: str, looking: list[Member], sums: dict[str, tuple[State, ...]], statement) -> list[str]:
    """A statement about each sum of each member, by the phase of a slot."""
    cases = []
    for phase in range(AHEAD):
        cases.append(f"    case {phase}:")
        for m in looking:
            of = [
                statement(m, one).replace("$", f"own_{m.name}[{i}]")
                for i, one in enumerate(sums[m.name][phase])
            ]
            cases += [f"        {line}" for line in of]
        cases.append("        break;")
    return [f"    switch ({now} & 3u) {{", *cases, "    }"] if looking else []
