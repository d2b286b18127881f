"""Which form a core's history sums take; without a core, the portable one."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.codegen.lookahead import AHEAD, LookAhead, look_ahead
from focgen.plan.plan import Plan, Sum

TARGETS = ("cortex-m0plus", "cortex-m3", "cortex-m4", "cortex-m7", "rv32imac", "avr")
"""The cores that ``--target`` names. An AVR, and float64 anywhere, take the portable form: there the products
cost, not the loads."""

_AHEAD = {
    ("cortex-m0plus", "q15"),
    ("cortex-m3", "q15"),
    ("cortex-m3", "q31"),
    ("cortex-m4", "q15"),
    ("cortex-m4", "q31"),
    ("cortex-m4", "f32"),
    ("cortex-m7", "q15"),
    ("cortex-m7", "q31"),
    ("cortex-m7", "f32"),
    ("rv32imac", "q15"),
    ("rv32imac", "q31"),
}


_LONG = {("cortex-m0plus", "q31")}  # no product of 64 bits: halves, by hand


_FILES = {
    ("cortex-m0plus", "q15"): "foc_m0_q15.h",
    ("cortex-m0plus", "q31"): "foc_m0_q31.h",
    ("cortex-m3", "q15"): "foc_m3_q15.h",
    ("cortex-m3", "q31"): "foc_m3_q31.h",
    ("cortex-m4", "q15"): "foc_m4_q15.h",
    ("cortex-m4", "q31"): "foc_m3_q31.h",
    ("cortex-m4", "f32"): "foc_m4_f32.h",
    ("cortex-m7", "q15"): "foc_m4_q15.h",
    ("cortex-m7", "q31"): "foc_m3_q31.h",
    ("cortex-m7", "f32"): "foc_m4_f32.h",
}


@dataclass(frozen=True)
class Kernels:
    """How a plan's sums are computed on ``target``; None: everywhere, in portable C."""

    target: str | None = None

    def own(self, arithmetic: str) -> bool:
        """Whether the target has kernels of its own for an arithmetic."""
        return (self.target, arithmetic) in _AHEAD | _LONG

    def ahead(self, plan: Plan, table: Sum | None) -> LookAhead | None:
        """The look-ahead form of a sum, where it takes that form."""
        if table is None or table.banks or (self.target, plan.arithmetic) not in _AHEAD:
            return None
        return look_ahead(table)

    def long(self, plan: Plan) -> bool:
        """Whether the sums take the form for cores without a long product."""
        return (self.target, plan.arithmetic) in _LONG

    def slots(self, plan: Plan, history: str) -> int:
        """How many samples a ring holds: ``history`` is "error" or "filtered"."""
        lags = plan.error_lags if history == "error" else plan.filtered_lags
        return -(-(lags + 1) // AHEAD) * AHEAD if self.grouped(plan, history) else lags + 1

    def grouped(self, plan: Plan, history: str) -> bool:
        """Whether a sum looks ahead over this ring."""
        return any(self.ahead(plan, s) for s in named_sums(plan).values() if s.history == history)

    def headers(self, plan: Plan) -> tuple[str, ...]:
        """The runtime's headers beside ``foc_rt.h``; the source includes all but the last."""
        looks = any(self.ahead(plan, s) for s in named_sums(plan).values())
        if not looks and not self.long(plan):
            return ()
        own = _FILES.get((self.target or "", plan.arithmetic))
        return (
            *((own,) if own else ()),
            f"foc_ahead_{plan.arithmetic}.h" if looks else "foc_long.h",
            "foc_tiles.h",
        )


PORTABLE = Kernels()


def runtime_files(plan: Plan, kernels: Kernels = PORTABLE) -> tuple[str, ...]:
    """The files of the runtime that a plan's C includes."""
    extra = [*["foc_memory.h"] * (plan.states > 0), *["foc_integral.h"] * plan.counted]
    extra += ["foc_tune.h"] * (plan.tuning is not None)
    return ("foc_rt.h", "foc_save.h", *extra, *kernels.headers(plan))


def named_sums(plan: Plan) -> dict[str, Sum]:
    """A plan's history sums by the name their tables have in C."""
    found = {
        "numerator": plan.direct,
        "integrand": plan.inner.rest if plan.inner else None,
        "denominator": plan.feedback.table if plan.feedback else None,
    }
    return {name: table for name, table in found.items() if table is not None}
