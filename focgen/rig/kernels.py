"""The compiled loops of the chain simulator (``kernels.c``), as functions of arrays.

The C is compiled on first use (half a second) into a temporary folder and loaded with cffi; nothing is left behind.
Every function takes a session's signal, shape (n,), and ``rest`` (n,), true where an experiment begins and the loop
starts at rest; it returns a new array of shape (n,).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from focgen.errors import BuildError

_SOURCE = Path(__file__).with_name("kernels.c")
_DECLARATIONS = """
void focgen_modes(int n, const double *x, double *y, const unsigned char *rest, int m, const double *a, const double *b0, const double *b1,
                  const double *pair, double through, int switching, double *z);
void focgen_lag(int n, const double *x, double *y, const unsigned char *rest, double keep_up, double keep_down);
void focgen_orifice(int n, const double *x, double *y, const unsigned char *rest, double h, double tau, double vent, double scale, int sub);
void focgen_rate(int n, const double *x, double *y, const unsigned char *rest, double h, double rate, double tau, int soft, int sub);
void focgen_play(int n, const double *x, double *y, const unsigned char *rest, double width, double start);
void focgen_stick(int n, const double *x, double *y, const unsigned char *rest, double band, double left);
void focgen_bouc_wen(int n, const double *x, double *y, const unsigned char *rest, double width, double power, double beta);
void focgen_filter(int n, const double *x, double *y, const unsigned char *rest, int m, const double *b, const double *a,
                   double *w);
"""
_FLAGS = ["-O3", "-shared", "-fPIC", "-fno-math-errno", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]


def _compiler() -> list[str]:
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        if name and shutil.which(name.split()[0]):
            return name.split()
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise BuildError("the simulator", "no C compiler was found", "install gcc, or pip install 'focgen[targets]'")


@cache
def _library():
    from cffi import FFI

    ffi = FFI()
    ffi.cdef(_DECLARATIONS)
    with tempfile.TemporaryDirectory(prefix="focgen-") as folder:
        target = str(Path(folder) / "kernels.so")
        for native in (["-march=native"], []):
            done = subprocess.run([*_compiler(), *_FLAGS, *native, "-o", target, str(_SOURCE), "-lm"],
                                  capture_output=True, text=True)
            if done.returncode == 0:
                return ffi, ffi.dlopen(target)
    raise BuildError("the simulator", f"the compiler refused it: {done.stderr.strip()[-200:]}", "set CC to another one")


def _call(name: str, x: np.ndarray, rest: np.ndarray, *others) -> np.ndarray:
    ffi, library = _library()
    x = np.ascontiguousarray(x, float)
    y = np.empty_like(x)
    getattr(library, name)(len(x), ffi.from_buffer("double[]", x), ffi.from_buffer("double[]", y),
                           ffi.from_buffer("unsigned char[]", rest), *others)
    return y


def modes(x, rest, a, b0, b1, pair, through: float, switching: bool) -> np.ndarray:
    """Sum of first-order modes; ``a``, ``b0``, ``b1`` (2, m) and ``pair`` (2, 6), rows loading and unloading."""
    ffi, _ = _library()
    tables = [np.ascontiguousarray(t, float) for t in (a, b0, b1, pair)]
    scratch = np.empty(tables[0].shape[1])
    pointers = [ffi.from_buffer("double[]", t) for t in tables]
    return _call("focgen_modes", x, rest, len(scratch), *pointers, float(through), int(switching),
                 ffi.from_buffer("double[]", scratch))


def lag(x, rest, h: float, up: float, down: float) -> np.ndarray:
    """A first-order lag with time constants ``up`` while rising and ``down`` while falling, s (0: none)."""
    keep = [float(np.exp(-h / t)) if t > 1e-4 * h else 0.0 for t in (up, down)]
    return _call("focgen_lag", x, rest, *keep)


def orifice(x, rest, h: float, fill: float, vent: float, scale: float) -> np.ndarray:
    """A chamber filled and vented through orifices; ``fill``, ``vent`` in s for a step of ``scale``."""
    return _call("focgen_orifice", x, rest, h, float(fill), float(vent), float(scale), 2)


def rate_limit(x, rest, h: float, rate: float, tau: float = 0.0, soft: bool = False) -> np.ndarray:
    """Follow ``x`` with |dy/dt| ≤ ``rate`` (units of x per s), through a lag ``tau`` in s."""
    return _call("focgen_rate", x, rest, h, float(rate), float(tau), int(soft), 4 if soft else 1)


def play(x, rest, width: float, start: float = 0.0) -> np.ndarray:
    """Backlash of half width ``width``, units of x."""
    return _call("focgen_play", x, rest, float(width), float(start))


def stick(x, rest, band: float, left: float) -> np.ndarray:
    """Stick–slip: held within ``band`` of ``x``, then slips to ``left`` from it; units of x."""
    return _call("focgen_stick", x, rest, float(band), float(left))


def bouc_wen(x, rest, width: float, power: float = 1.0, beta: float = 0.5) -> np.ndarray:
    """Bouc–Wen's hysteretic variable in [−1, 1]; ``width`` is the input's travel to reverse it, units of x."""
    return _call("focgen_bouc_wen", x, rest, float(width), float(power), float(beta))


def rational(x, rest, b, a) -> np.ndarray:
    """A discrete filter with numerator ``b`` and denominator ``a`` (a[0] = 1), of any length."""
    ffi, _ = _library()
    order = max(len(a), len(b)) - 1
    tables = [np.ascontiguousarray(np.pad(t, (0, order + 1 - len(t))), float) for t in (b, a)]
    scratch = np.zeros(order + 1)
    return _call("focgen_filter", x, rest, order, *(ffi.from_buffer("double[]", t) for t in (*tables, scratch)))
