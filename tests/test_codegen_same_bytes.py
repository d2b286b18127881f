"""From controller.toml to the folder, and from a rig to controller.toml: the same bytes on every processor.

Another processor is had by telling the libraries to take this one for it: OpenBLAS its kernels, numpy the
instructions that it looks for.
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

import pytest

try:
    from numpy._core import _multiarray_umath as core
except ImportError:  # numpy 1
    from numpy.core import _multiarray_umath as core

ROOT = Path(__file__).parents[1]
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


@functools.cache
def made(setting: str | None = None) -> dict[str, dict[str, str]]:
    """The digests of everything, made in a process with this setting; None: what the libraries choose by
    themselves. Skips where the processor cannot execute it."""
    plain = {key: value for key, value in os.environ.items() if key not in (KERNELS, FEATURES)}
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "tests.every_form", folder],
            cwd=ROOT,
            env={**plain, **one_thread, **(SETTINGS[setting] if setting else {})},
            capture_output=True,
            text=True,
        )
    if done.returncode == -signal.SIGILL:
        pytest.skip(f"this processor cannot execute the kernels of {setting}")
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


@pytest.mark.parametrize("setting", SETTINGS)
def test_another_processor_makes_the_same_bytes(setting):
    here, there = made()["files"], made(setting)["files"]
    assert there.keys() == here.keys() and len(here) > 50
    assert [name for name, digest in there.items() if here[name] != digest] == []


def test_the_settings_change_what_is_left_to_the_processor():
    """Else the comparison would show nothing: numpy's functions, and products and solutions of matrices."""
    if platform.machine() not in ("x86_64", "AMD64") or not features("V3", "AVX2"):
        pytest.skip("this processor has nothing that could be left out")
    here, old = made()["numpy"], made("an old processor")["numpy"]
    assert old["functions"] != here["functions"] and old["algebra"] != here["algebra"]
