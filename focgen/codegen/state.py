"""What a controller remembers: the members of NAME_state and how large they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

from focgen.codegen.banks import means, rests, state_about
from focgen.codegen.kernels import PORTABLE, Kernels, named_sums
from focgen.codegen.literals import scale
from focgen.plan.plan import Block, Format, Plan, Sum
from focgen.present import present

_SIZES = {"uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "float": 4, "int64_t": 8, "double": 8}


@dataclass(frozen=True)
class Member:
    """One member of the state; ``array`` is the C text of its length, ``count`` the length."""

    ctype: str
    name: str
    about: str
    count: int = 1
    array: str = ""

    @property
    def declaration(self) -> str:
        """As C declares it."""
        return f"{self.ctype} {self.name}{f'[{self.array}]' if self.array else ''};"


def members(plan: Plan, kernels: Kernels = PORTABLE) -> tuple[Member, ...]:
    """The members: single ones first, within reach of short addresses, then the rings; widest types first.

    Sums that look ahead stand before the rings that they look at, and these before other rings, so that they
    begin at a word.
    """
    found = [
        *_set_point(plan),
        *_integral(plan),
        *_inner(plan),
        *_recursion(plan),
        *_histories(plan, kernels),
        *_means(plan),
    ]
    found += [*_parameters(plan), *_bytes(plan)]
    found += [_ahead(table, name) for name, table in named_sums(plan).items() if kernels.ahead(plan, table)]
    grouped = [h for h in ("error", "filtered") if kernels.grouped(plan, h)]
    by_words = [*(f"{name}_ahead" for name in named_sums(plan)), *grouped] if grouped else []
    late = {m.name for m in found if by_words and m.name not in by_words}
    return tuple(sorted(found, key=lambda m: (bool(m.array), -_SIZES[m.ctype], m.name in late)))


def _ahead(table: Sum, name: str) -> Member:
    words = 8 if table.total.floating else 12
    about = "sums that look ahead: of this group, of the next" + (", of a block" if words == 12 else "")
    return Member(table.blocks[0].sum.ctype, f"{name}_ahead", about, words, str(words))


def _histories(plan: Plan, kernels: Kernels) -> list[Member]:
    error = Member(
        plan.error.ctype,
        "error",
        f"ring of ref - meas{_counts(plan.error)}",
        kernels.slots(plan, "error"),
        f"{plan.name.upper()}_ERRORS",
    )
    slots = [error, Member("uint16_t", "error_now", "slot of the latest error")]
    if plan.feedback:
        about = f"ring of the filtered error{_counts(plan.filtered)}"
        size = f"{plan.name.upper()}_FILTERED"
        slots.append(Member(plan.filtered.ctype, "filtered", about, kernels.slots(plan, "filtered"), size))
        slots.append(Member("uint16_t", "filtered_now", "slot of the latest filtered error"))
    return slots


def _means(plan: Plan) -> list[Member]:
    """The exponential memory's."""
    found = []
    for table in plan.sums:
        for i, bank in enumerate(table.banks):
            ctype, count = bank.state.ctype, bank.modes
            found.append(Member(ctype, means(table, i), state_about(plan, table, bank), count, str(count)))
            if bank.compensated:
                about = "what the means above have still to take up"
                found.append(Member(ctype, rests(table, i), about, count, str(count)))
    return found


def _set_point(plan: Plan) -> list[Member]:
    if plan.set_point is None:
        return []
    if not plan.floating:
        fine = replace(plan.reference, lsb=plan.reference.lsb * 2.0**-plan.set_point.up)
        return [Member("int64_t", "set_point", f"filtered{_counts(fine)}")]
    return [
        Member(plan.reference.ctype, "lag", "by which the filtered set point is behind"),
        Member(plan.reference.ctype, "latest", "the reference of the latest step"),
    ]


def _inner(plan: Plan) -> list[Member]:
    if plan.inner is None:
        return []
    return [
        Member(
            plan.inner.state.ctype,
            "inner",
            f"integral of the terms of negative order{_counts(plan.inner.state)}",
        ),
        Member(inner_input(plan), "inner_input", "what was added to it last, half a trapezoid"),
    ]


def _recursion(plan: Plan) -> list[Member]:
    if not carries(plan):
        return []
    return [Member(plan.wide.ctype, "carry", "what the rounding of the filtered error has left over")]


def _integral(plan: Plan) -> list[Member]:
    if plan.integrator is None:
        return []
    found = [
        Member(
            plan.integrator.state.ctype,
            "integral",
            f"the output before rounding{_counts(plan.integrator.state)}"
            if not plan.integrator.state.floating
            else "the output",
        ),
        Member(plan.increment.ctype, "increment", "half a trapezoid, of the latest sample"),
    ]
    if starts(plan):
        found.append(
            Member(plan.filtered.ctype, "resting", "filtered error that reset has left, until a step")
        )
    return found


def _parameters(plan: Plan) -> list[Member]:
    """What NAME_tune has taken over."""
    if plan.tuning is None:
        return []
    signal, gains = plan.output.ctype, f"{plan.name.upper()}_GAINS"
    count = len(plan.tuning.nominal)
    found = [
        Member(plan.gain.ctype, "gains", f"with their factors{_counts(plan.gain)}", count, gains),
        Member(signal, "u_min", "lower limit of the output"),
        Member(signal, "u_max", "upper limit of the output"),
    ]
    if counts_limits(plan):
        state = present(plan.integrator).state
        found += [
            Member(state.ctype, "low", f"lower limit of the output{_counts(state)}"),
            Member(state.ctype, "high", f"upper limit of the output{_counts(state)}"),
        ]
    if plan.schedule:
        about = "from each breakpoint to the next"
        found.append(Member(plan.gain.ctype, "slopes", about, count - 1, f"{gains} - 1"))
    return found


def counts_limits(plan: Plan) -> bool:
    """Whether the state holds tuned limits in counts of its integral, too: then no step has to turn them."""
    integrator = plan.integrator
    return (
        plan.tuning is not None and plan.floating and integrator is not None and not integrator.state.floating
    )


def _bytes(plan: Plan) -> list[Member]:
    found = [Member(plan.output.ctype, "output", "what the latest step has returned")] if holds(plan) else []
    found += [Member("uint8_t", "flags", f"{plan.name.upper()}_FLAG_...")]
    if starts(plan):
        found.append(Member("uint8_t", "starting", "1 from reset to the first step"))
    return found


def inner_input(plan: Plan) -> str:
    """The type of what the inner integral takes in: counts of its own where it is in counts."""
    return present(plan.inner).state.ctype if plan.floating else present(plan.inner).rest.total.ctype


def carries(plan: Plan) -> bool:
    """Whether the recursion's rounding leaves anything to carry."""
    return plan.feedback is not None and not plan.floating and plan.narrow > 0


def holds(plan: Plan) -> bool:
    """Whether the output must be kept for steps that are left out; with an integral it is that."""
    return plan.floating and plan.integrator is None


def starts(plan: Plan) -> bool:
    """Whether the first step after a reset must still find the gain of the sample before it."""
    return plan.integrator is not None and (plan.schedule is not None or plan.tuning is not None)


def _counts(form: Format) -> str:
    return "" if form.floating else f", counts of {scale(form.lsb, form.unit)}"


def state_bytes(plan: Plan, kernels: Kernels = PORTABLE) -> int:
    """sizeof(NAME_state) where every type is aligned to its size, as on 32-bit ARM and RISC-V."""
    total, widest = 0, 1
    for member in members(plan, kernels):
        size = _SIZES[member.ctype]
        total = -(-total // size) * size + size * member.count
        widest = max(widest, size)
    return -(-total // widest) * widest


def printed_blocks(table: Sum) -> list[Block]:
    """The blocks that the plain form prints: those with a weight other than 0, or one where there is none."""
    return [block for block in table.blocks if any(block.weights)] or list(table.blocks[:1])


def plain_bytes(plan: Plan, table: Sum) -> int:
    """Bytes of a sum's tables in the plain form; a block that is alone needs no table of blocks."""
    blocks = printed_blocks(table)
    weights = sum(len(block.weights) for block in blocks) * size_of(plan.error.ctype)
    return weights + 6 * len(blocks) * (len(blocks) > 1)


def size_of(ctype: str) -> int:
    """Bytes of a C type."""
    return _SIZES[ctype]
