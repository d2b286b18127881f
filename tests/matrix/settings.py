"""What is varied: the environment of one Python, and the versions of Python, numpy and scipy."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KERNELS = ("Nehalem", "Haswell", "Zen", "SkylakeX")
"""Of OpenBLAS, each for another processor."""
VERSIONS = {
    "3.11": (("numpy==1.26.*", "scipy==1.11.*"), ("numpy", "scipy")),
    "3.12": (("numpy==1.26.*", "scipy==1.12.*"), ("numpy", "scipy")),
    "3.13": (("numpy==2.1.*", "scipy==1.14.*"), ("numpy", "scipy")),
    "3.14": (("numpy==2.3.*", "scipy==1.16.*"), ("numpy", "scipy")),
}
"""Two of each: an old one that has wheels for that Python, and the newest."""


@dataclass(frozen=True)
class Setting:
    """``name`` for the table; ``change`` of the environment; ``python`` that runs it."""

    name: str
    change: dict[str, str] = field(default_factory=dict)
    python: str = sys.executable


PLAIN = Setting("as it is", {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
ENVIRONMENTS = (
    *(Setting(f"OpenBLAS for {kernel}", {"OPENBLAS_CORETYPE": kernel}) for kernel in KERNELS),
    Setting("four threads", {"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}),
    Setting("hash seed 0", {"PYTHONHASHSEED": "0"}),
    Setting("hash seed 12345", {"PYTHONHASHSEED": "12345"}),
    Setting("locale C", {"LC_ALL": "C", "LANG": "C"}),
    Setting("Turkish locale", {"LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8", "PYTHONUTF8": "0"}),
    Setting("German locale", {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}),
    Setting("time zone Pacific/Kiritimati", {"TZ": "Pacific/Kiritimati"}),
    Setting("all at once", {"PYTHONHASHSEED": "7", "TZ": "America/St_Johns", "LC_ALL": "C",
                            "OMP_NUM_THREADS": "3", "OPENBLAS_CORETYPE": "Nehalem"}),
)  # fmt: skip


def digests(setting: Setting, folder: Path, *forms: str) -> dict[str, str] | str:
    """The SHA-256 of every file that is made under a setting, or why nothing could be. ``forms``: which of
    them (:mod:`tests.every_form`), else all. Raises RuntimeError where making them fails."""
    env = {key: value for key, value in os.environ.items() if key not in ("OPENBLAS_CORETYPE", "LC_ALL")}
    env = {**env, **PLAIN.change, **setting.change, "PYTHONPATH": str(ROOT)}
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    done = subprocess.run(
        [setting.python, "-m", "tests.every_form", str(folder), *forms],
        cwd=ROOT, env=env, capture_output=True, encoding="utf-8", errors="replace",
    )  # fmt: skip
    if done.returncode == -signal.SIGILL:
        return "this processor cannot execute it"
    if done.returncode:
        raise RuntimeError(f"{setting.name}: {done.stderr[-2000:]}")
    return json.loads(done.stdout)["files"]


def installed(version: str, packages: tuple[str, ...], place: Path) -> Setting | str:
    """A Python of its own with these packages, or why there is none here."""
    command = _found(f"python{version}")
    if command is None:
        return f"python{version} is not installed"
    python = place / "bin" / "python"
    if not (place / "ready").exists():
        shutil.rmtree(place, ignore_errors=True)
        if _fails([command, "-m", "venv", str(place)]):
            return f"python{version} makes no environment"
        rest = ["cffi", "clevercsv", "jinja2", "pint", "tomlkit", "pytest"]
        if _fails([str(python), "-m", "pip", "install", "--quiet", "--prefer-binary", *packages, *rest]):
            return f"{' '.join(packages)} cannot be installed"
        (place / "ready").touch()
    said = "import numpy, scipy, sys; print(sys.version.split()[0], numpy.__version__, scipy.__version__)"
    names = subprocess.run([str(python), "-c", said], capture_output=True, text=True).stdout.split()
    return Setting("Python {}, numpy {}, scipy {}".format(*names), python=str(python))


def _found(name: str) -> str | None:
    """The first of that name that runs: a version manager may put others ahead that do not."""
    places = os.environ.get("PATH", "").split(os.pathsep)
    commands = filter(None, (shutil.which(name, path=place) for place in places))
    return next((command for command in commands if not _fails([command, "-c", "pass"])), None)


def _fails(command: list[str]) -> bool:
    return subprocess.run(command, capture_output=True).returncode != 0
