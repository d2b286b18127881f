"""Exponential memory over 10^7 samples, in compiled C: the error never leaves the manifest's bound.

The truth is the operator with the memory's own poles and weights, in long double and in another form: each
mode sums up differences, S_k = p S_{k-1} + v_k, instead of keeping a mean.

Red when errors grow with the number of samples.
"""

import numpy as np
import pytest
from cffi import FFI

from focgen.codegen.generate import generate
from focgen.compiler import compile_shared
from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.scenario import nearest_raw
from focgen.verification.host import FLAGS
from tests.controllers import simple

ARITHMETICS = ("f64", "f32", "q31", "q15")
LONG, ASKED = 10**7, {"memory": "exponential", "tolerance": 1e-4, "horizon": 10**6}
RUN = """#include "{0}.h"
void run(uint32_t count, const {0}_sig *ref, {0}_sig *u);
void run(uint32_t count, const {0}_sig *ref, {0}_sig *u)
{{
    static {0}_state state;

    {0}_init(&state);
    for (uint32_t k = 0; k < count; k++) {{
        u[k] = {0}_step(&state, ref[k], 0);
    }}
}}
"""
CTYPES = {"f64": "double", "f32": "float", "q31": "int32_t", "q15": "int16_t"}
DTYPES = {"f64": np.float64, "f32": np.float32, "q31": np.int32, "q15": np.int16}


def signals(samples: int) -> dict[str, np.ndarray]:
    """Within ±1, from 0."""
    k = np.arange(samples)
    noise = np.random.default_rng(11).uniform(-1.0, 1.0, samples)
    sine = np.sin(2e-4 * np.pi * k) * 0.999
    return {"step": np.full(samples, 0.73), "ramp": k / samples, "sine": sine, "noise": noise}


def ran(controller, arithmetic: str, x: dict[str, np.ndarray], folder, **asked):
    """The plan, and what its C answers to physical signals, physical."""
    made = generate(controller, folder / arithmetic, arithmetic, name="c", **asked)
    (folder / "run.c").write_text(RUN.format("c"))
    compile_shared([made.folder / "c.c", folder / "run.c"], folder / f"{arithmetic}.so", FLAGS, [made.folder])
    ffi, ctype = FFI(), CTYPES[arithmetic]
    ffi.cdef(f"void run(uint32_t, const {ctype} *, {ctype} *);")
    library, found = ffi.dlopen(str(folder / f"{arithmetic}.so")), {}
    for name, values in x.items():
        raw = nearest_raw(values, made.plan.error).astype(DTYPES[arithmetic])
        u = np.empty_like(raw)
        library.run(len(raw), *(ffi.cast(f"{ctype} *", a.ctypes.data) for a in (raw, u)))
        found[name] = u * made.plan.output.lsb
    return made.plan, found


EXACT = """#include <stdint.h>
typedef long double real;
typedef struct { double scale; int count; const double *pole, *weight; real state[64]; } term;
static real past(term *t)
{
    real sum = 0;
    for (int i = 0; i < t->count; i++) sum += t->weight[i] * t->state[i];
    return t->scale * sum;
}
static void push(term *t, real v)
{
    for (int i = 0; i < t->count; i++) t->state[i] = t->pole[i] * t->state[i] + v;
}
void exact(uint32_t count, const double *x, double *y, double b, int nb, const double *pb, const double *wb,
           double a, int na, const double *pa, const double *wa)
{
    term num = {b, nb, pb, wb, {0}}, den = {a, na, pa, wa, {0}};
    real x1 = 0, y1 = 0;
    for (uint32_t k = 0; k < count; k++) {
        const real right = x[k] + b * (x[k] - x1) + past(&num) + a * y1 - past(&den);
        const real now = right / (1 + (real)a);
        push(&num, x[k] - x1);
        push(&den, now - y1);
        x1 = x[k];
        y[k] = (double)(y1 = now);
    }
}
"""
NONE = (0.0, 0, np.zeros(1), np.zeros(1))


class Exact:
    """(b s^β + 1) / (a s^α + 1) with the memories of a plan."""

    def __init__(self, folder):
        (folder / "exact.c").write_text(EXACT)
        compile_shared([folder / "exact.c"], folder / "exact.so", ("-std=c99", "-O2"))
        self.ffi = FFI()
        part = "double, int, const double *, const double *"
        self.ffi.cdef(f"void exact(uint32_t, const double *, double *, {part}, {part});")
        self.library = self.ffi.dlopen(str(folder / "exact.so"))

    def __call__(self, plan, x: np.ndarray) -> np.ndarray:
        transfer, y = plan.controller.transfer, np.empty_like(x)
        parts = [*self._part(plan, transfer.num), *self._part(plan, transfer.den)]
        held = [p if np.isscalar(p) else self.ffi.cast("double *", p.ctypes.data) for p in parts]
        pointers = [self.ffi.cast("double *", a.ctypes.data) for a in (x, y)]
        self.library.exact(len(x), *pointers, *held)
        return y

    @staticmethod
    def _part(plan, terms):
        for t in terms:
            for memory in plan.memories:
                if memory.order == t.order:
                    poles, weights = np.array(memory.poles), np.array(memory.weights)
                    return t.coefficient * plan.sample_time**-t.order, memory.states, poles, weights
        return NONE


def inverse_model():
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-50.0, 50.0))
    return simple(TransferFunction([(1.32, 0.6), (1.0, 0.0)]), ranges=ranges)


def lead():
    """Fractional terms in numerator and denominator."""
    transfer = TransferFunction([(0.5, 0.6), (1.0, 0.0)], [(0.1, 0.8), (1.0, 0.0)])
    return simple(transfer, ranges=ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-9.0, 9.0)))


@pytest.mark.parametrize("samples", [20_000, pytest.param(LONG, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "controller, arithmetic",
    [
        pytest.param(made, arithmetic, id=f"{name}-{arithmetic}", marks=marks)
        for i, (name, made) in enumerate((("sum", inverse_model()), ("recursion", lead())))
        for j, arithmetic in enumerate(ARITHMETICS)
        for marks in [() if (i + j // 2) % 2 == 0 else pytest.mark.long]
    ],
)
def test_no_drift_and_no_stagnation(controller, arithmetic, samples, tmp_path):
    x, truth = signals(samples), Exact(tmp_path)
    plan, found = ran(controller, arithmetic, x, tmp_path, **ASKED)
    for name, u in found.items():
        error = np.abs(u - truth(plan, x[name]))
        early, late = error[: samples // 2].max(), error[samples // 2 :].max()
        print(f"{arithmetic} {name}: {error.max():.2e} of {plan.error_bound.operator:.2e}, later {late:.2e}")
        assert error.max() <= plan.error_bound.operator
        assert late <= 1.5 * early + 0.1 * plan.error_bound.operator
