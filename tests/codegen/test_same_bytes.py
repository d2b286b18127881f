"""From controller.toml to the folder, and from a rig to controller.toml: the same bytes on every processor.

Another processor is had by telling the libraries to take this one for it: OpenBLAS its kernels, numpy the
instructions that it looks for.

Red when a processor's own rounding reaches a file.
"""

from __future__ import annotations

import functools
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal as scipy_signal

from focgen.control.files import controller_text, read_controller
from focgen.fractional import discrete
from focgen.loop import tuning
from focgen.loop.design import design
from focgen.plan import stability
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from tests.codegen.test_golden import CONTROLLER, FORMS, arithmetic
from tests.loop.test_design import SECOND_ORDER, linear_rig

try:
    from numpy._core import _multiarray_umath as core
except ImportError:  # numpy 1
    from numpy.core import _multiarray_umath as core

ROOT = Path(__file__).parents[2]
KERNELS, FEATURES = "OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES"


def features(*without: str) -> str:
    """What numpy has found here beyond what it was built for and uses where it can, as far as it is named."""
    found = [name for name in core.__cpu_dispatch__ if core.__cpu_features__.get(name)]
    return " ".join(name for name in found if any(part in name for part in without))


SETTINGS = {
    "Haswell": {KERNELS: "Haswell"},
    "SkylakeX": {KERNELS: "SkylakeX"},
    "Zen": {KERNELS: "Zen"},
    "an old processor": {KERNELS: "Nehalem", FEATURES: features("")},
    "no AVX-512": {FEATURES: features("512", "V4")},
}
FARTHEST = "an old processor"
"""From what is made by any processor of today; the others are in the long suite, which makes all forms."""
QUICK = ("f32", "q15", "exp_f64", "exp_q31", "fastest")
"""Both memories in all kinds of numbers, and a design."""


@functools.cache
def made(setting: str | None = None, *forms: str) -> dict[str, dict[str, str]]:
    """The digests of everything, or of some ``forms``, made in a process with this setting; None: what the
    libraries choose by themselves. Skips where the processor cannot execute it."""
    plain = {key: value for key, value in os.environ.items() if key not in (KERNELS, FEATURES)}
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "tests.every_form", folder, *forms],
            cwd=ROOT,
            env={**plain, **one_thread, **(SETTINGS[setting] if setting else {})},
            capture_output=True,
            text=True,
        )
    if done.returncode == -signal.SIGILL:
        pytest.skip(f"this processor cannot execute the kernels of {setting}")
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    "setting, forms, least",
    [(FARTHEST, QUICK, 30), *(pytest.param(s, (), 50, marks=pytest.mark.long) for s in SETTINGS)],
)
def test_another_processor_makes_the_same_bytes(setting, forms, least):
    here, there = (made(one, *forms)["files"] for one in (None, setting))
    assert there.keys() == here.keys() and len(here) > least
    assert [name for name, digest in there.items() if here[name] != digest] == []


@pytest.mark.parametrize(("left", "found"), [("functions", ("512", "V4")), ("algebra", ("V3", "AVX2"))])
def test_the_settings_change_what_is_left_to_the_processor(left, found):
    """Else the comparison would show nothing. Numpy's functions of doubles have another digit with AVX-512
    only; products and solutions of matrices from AVX2 on."""
    if platform.machine() not in ("x86_64", "AMD64") or not features(*found):
        pytest.skip(f"this processor has nothing that could be left out of the {left}")
    here, old = (made(setting, *QUICK)["numpy"] for setting in (None, FARTHEST))
    assert old[left] != here[left]


# ------------------------------------------------------------------- what no setting of this machine varies


def noisy(function, size: float, seed: int = 1):
    """A function whose result is off as another library's may be: by ``size`` of its root mean square."""
    random = np.random.default_rng(seed)

    def off(*arguments):
        found = np.asarray(function(*arguments))
        return found + size * np.sqrt(np.mean(np.square(found))) * random.standard_normal(found.shape)

    return off


def planned(form: str) -> Plan:
    """Of a golden form, with every bit of its bounds."""
    memory = dict(memory="exponential", tolerance=1e-3, horizon=100_000) if form.startswith("exp") else {}
    stability._inverse.cache_clear()
    return build_plan(read_controller(CONTROLLER), arithmetic(form), **memory)


@pytest.mark.parametrize(
    "form", [form if form != "exp_f32" else pytest.param(form, marks=pytest.mark.long) for form in FORMS]
)
def test_other_transforms_make_the_same_plan(form, monkeypatch):
    """Of a Fourier transform every library makes another last digit; norms are rounded up for that."""
    here = planned(form)
    monkeypatch.setattr(stability, "fftconvolve", noisy(scipy_signal.fftconvolve, 1e-14))
    varied = {name: noisy(getattr(scipy_signal, name), 1e-14) for name in ("fftconvolve", "lfilter")}
    monkeypatch.setattr(discrete, "signal", SimpleNamespace(**varied))
    there = planned(form)
    stability._inverse.cache_clear()
    assert there.error_bound == here.error_bound and there.proofs == here.proofs and there == here


def test_a_design_does_not_hold_the_noise_of_its_simulation(monkeypatch):
    """K_o follows from settling times that were found, a roll-off's time from the crossover aimed at."""
    rig, measure, guess = linear_rig(*SECOND_ORDER), tuning.measure_step, tuning._guess
    here = design(rig, overshoot=5.0)
    random = np.random.default_rng(2)

    def off(output, *rest):
        return measure(output + 1e-12 * np.ptp(output) * random.standard_normal(output.shape), *rest)

    monkeypatch.setattr(tuning, "measure_step", off)
    monkeypatch.setattr(tuning, "_guess", lambda bench: guess(bench) * (1.0 + 1e-13))
    there = design(rig, overshoot=5.0)
    assert any("roll-off" in note for note in here.notes)
    assert controller_text(there.controller) == controller_text(here.controller)
    assert there.schedule == here.schedule
