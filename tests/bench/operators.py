"""s^0.6 on a Cortex-M4: the exponential form fitted to (jω)^α beside Oustaloup's filter as biquads.

Four decades up to a tenth of the Nyquist frequency. The rival: poles and zeros by Oustaloup's recursion and
Tustin's transform, as sections of direct form I in q31 and of transposed direct form II in f32. It gets the
best of many widths, pairings and gains. Errors are the largest |H/(jω)^α − 1| in the band, with the
coefficients as they are quantised; rounding within a step is left aside. Beside each cascade stands the
leanest exponential form that is at least as close.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from focgen.plan.response import filtered_response
from focgen.studies.costs import multiplies
from tests.bench._on_core import CalledCost, called
from tests.controllers import simple

ALPHA = 0.6
LOW, HIGH = math.pi * 1e-5, math.pi * 0.1  # rad per sample
OMEGA = np.geomspace(LOW, HIGH, 800)
CASCADES = tuple((poles, 2) for poles in (4, 6, 8, 12, 16)) + tuple((poles, 1) for poles in (6, 8, 12, 16))
"""Poles, and how many of them share a section."""
CORE = "cortex-m4"
STEPS = 100
_WIDER = np.geomspace(1.0, 1000.0, 16)  # beyond either end of the band, for the recursion's own ends


@dataclass(frozen=True, eq=False)
class Cascade:
    """Biquads of ``poles`` poles: ``sections`` (b0, b1, b2, −a1, −a2) as quantised, and the ``error``."""

    poles: int
    sections: np.ndarray
    error: float

    @property
    def multiplies(self) -> int:
        """Products of a sample."""
        return 5 * len(self.sections)


def error_of(response: np.ndarray) -> float:
    """The largest relative error in the band; ``response`` at OMEGA."""
    return float(np.abs(response / (1j * OMEGA) ** ALPHA - 1.0).max())


def oustaloup(poles: int, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Poles and zeros in z of Oustaloup's filter between ``low`` and ``high`` in rad per sample, rising."""
    k = np.arange(poles) + 0.5
    zeros, places = (low * (high / low) ** ((k + shift) / poles) for shift in (-ALPHA / 2, ALPHA / 2))
    return tuple((2.0 - w) / (2.0 + w) for w in (places, zeros))


def _layouts(poles: np.ndarray, zeros: np.ndarray, together: int) -> Iterator[np.ndarray]:
    """Sections of one pole; or of two, of neighbours and of the slowest with the fastest."""
    if together == 1:
        nothing = np.zeros(len(poles))
        yield np.column_stack([nothing + 1.0, -zeros, nothing, poles, nothing])
        return
    half = len(poles) // 2
    for one, other in ((slice(0, None, 2), slice(1, None, 2)), (slice(half), slice(None, half - 1, -1))):
        (p, q), (y, z) = ((part[one], part[other]) for part in (poles, zeros))
        yield np.column_stack([np.ones(half), -y - z, y * z, p + q, -p * q])


def _rounded(sections: np.ndarray, arithmetic: str) -> np.ndarray:
    if arithmetic == "f32":
        return sections.astype(np.float32).astype(float)
    return np.clip(np.round(sections * 2.0**30), -(2.0**31), 2.0**31 - 1) / 2.0**30


def _response(sections: np.ndarray) -> np.ndarray:
    back = np.exp(-1j * OMEGA)
    b0, b1, b2, a1, a2 = sections.T[..., None]
    return np.prod((b0 + (b1 + b2 * back) * back) / (1.0 - (a1 + a2 * back) * back), axis=0)


def _centred(sections: np.ndarray) -> np.ndarray:
    """With the gain for which the error's extremes are alike, spread evenly over the sections."""
    size = np.abs(_response(sections) / (1j * OMEGA) ** ALPHA)
    scale = (2.0 / (size.max() + size.min())) ** (1.0 / len(sections))
    return sections * np.array([scale, scale, scale, 1.0, 1.0])


@cache
def best_cascade(poles: int, together: int, arithmetic: str | None) -> Cascade:
    """The rival at its best; with ``arithmetic`` None its coefficients are not rounded."""
    found = None
    for below in _WIDER:
        for above in _WIDER:
            parts = oustaloup(poles, LOW / below, HIGH * above)
            for sections in map(_centred, _layouts(*parts, together)):
                if arithmetic:
                    sections = _rounded(sections, arithmetic)
                error = error_of(_response(sections))
                if found is None or error < found.error:
                    found = Cascade(poles, sections, error)
    return found


def exponential(error: float, arithmetic: str) -> tuple[Plan, float] | None:
    """The leanest exponential form no further from (jω)^α than ``error``, as quantised, and its own error."""
    for tolerance in error * np.array([1.0, 0.95, 0.9, 0.8, 0.6, 0.4]):
        try:
            plan = _planned(float(min(tolerance, 0.1)), arithmetic)
        except PlanError:
            return None
        found = error_of(filtered_response(plan, OMEGA))
        if found <= error:
            return plan, found
    return None


@cache
def _planned(tolerance: float | None, arithmetic: str) -> Plan:
    """s^α; without a tolerance a plain gain in its place."""
    asked = dict(memory="exponential", operator="continuous", tolerance=tolerance, band=(LOW, HIGH))
    controller = simple(TransferFunction([(1.0, ALPHA if tolerance else 0.0)]), sample_time=1.0)
    return build_plan(controller, arithmetic, name="ours", **asked)


def rival_cost(cascade: Cascade, arithmetic: str, chain) -> CalledCost:
    """A sample of a cascade on the core."""
    from focgen.targets.cores import core

    kind, shift = ("float", "") if arithmetic == "f32" else ("int32_t", ", 1")
    name = "df2t_f32" if arithmetic == "f32" else "df1_q31"
    values = cascade.sections.ravel()
    written = (
        [f"{v!r}f" for v in values.tolist()] if kind == "float" else [str(int(v)) for v in values * 2**30]
    )
    text = f"""#include "biquads.h"
static {kind} state[{4 * len(cascade.sections)}];
static const {kind} coefficients[] = {{{", ".join(written)}}};
static const {name} cascade = {{{len(cascade.sections)}u, state, coefficients{shift}}};
static {kind} in, out;
uint32_t called(uint32_t k);
uint32_t called(uint32_t k)
{{
    in = ({kind})(int32_t)k;
    run_{arithmetic}(&cascade, &in, &out, 1u);
    return (uint32_t)(int32_t)out;
}}
"""
    inputs = np.random.default_rng(3).integers(0, 1 << 20, STEPS).tolist()
    return called(core(CORE), chain, text, inputs, [Path(__file__).parent / "c"])


def our_cost(plan: Plan, chain) -> np.ndarray:
    """Mean cycles of a whole step and words of state: difference, clamps, flags and guards included."""
    from focgen.targets.cores import core
    from focgen.targets.library import TargetLibrary
    from focgen.targets.steps import step_costs

    with tempfile.TemporaryDirectory() as scratch:
        write_files(scratch, folder_files(plan, b"", kernels=Kernels(CORE)))
        library = TargetLibrary(core(CORE), chain, [plan], [Path(scratch)])
        return np.array([step_costs(library, plan, STEPS).cycles.mean(), library.state_bytes(plan) / 4])


def rows(arithmetic: str, chain) -> list[str]:
    """A line for each cascade."""
    frame = our_cost(_planned(None, arithmetic), chain)
    return [_row(best_cascade(*shape, arithmetic), shape, arithmetic, frame, chain) for shape in CASCADES]


def _row(rival: Cascade, shape: tuple[int, int], arithmetic: str, frame: np.ndarray, chain) -> str:
    words = len(rival.sections) * (2 if arithmetic == "f32" else 4)
    cycles = rival_cost(rival, arithmetic, chain).cycles
    errors = f"{best_cascade(*shape, None).error:>8.2%}{rival.error:>8.2%}"
    line = (
        f"  {arithmetic:<5}{shape[0]:>4}/{shape[1]}{errors}{rival.multiplies:>5}{words:>6}{cycles:>7.0f}  |"
    )
    found = exponential(rival.error, arithmetic)
    if found is None:
        return f"{line}   no exponential form is as close"
    (plan, error), whole = found, our_cost(found[0], chain)
    (own, held), products = whole - frame, multiplies(plan)
    ratios = rival.multiplies / products, words / held, cycles / own, cycles / whole[0]
    ours = f"{plan.states:>3}{error:>7.2%}{products:>5}{held:>6.0f}{own:>7.0f}{whole[0]:>7.0f}  |"
    return line + ours + "".join(f"{ratio:>6.2f}" for ratio in ratios)


def run() -> str:
    """Return the table."""
    try:
        from focgen.targets.cores import core
        from focgen.targets.toolchains import toolchains

        chain = toolchains(core(CORE))[0]
        import unicorn  # noqa: F401
    except ImportError:
        return "Operators on a core: not measured, pip install 'focgen[targets]'"
    head = f"  {'':<5}{'poles':>6}{'exact':>8}{'rounded':>8}{'mult':>5}{'words':>6}{'cycles':>7}  |"
    head += (
        f"{'n':>3}{'error':>7}{'mult':>5}{'words':>6}{'cycles':>7}{'whole':>7}  |  mult words cycles whole"
    )
    title = f"s^{ALPHA} on a {CORE}, {chain.title}: Oustaloup and Tustin as biquads (poles/poles a section),"
    return "\n".join([
        title, "beside the leanest exponential form that is at least as close; then its costs over those.",
        "Words and cycles: less those of the same controller with a plain gain; whole: with them.",
        head, *rows("q31", chain), *rows("f32", chain),
    ])  # fmt: skip
