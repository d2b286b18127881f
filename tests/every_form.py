"""Makes everything that is compared between machines, and prints the digest of each file as JSON.

``python -m tests.every_form FOLDER [FORM…]``. Two digests are of numpy's own functions, which show what a
setting changes.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import sys
from pathlib import Path

import numpy as np
from scipy import linalg

from focgen.cli.main import main
from tests.codegen.test_golden import CONTROLLER, EXPONENTIAL, FORMS, options

EXAMPLE = Path(__file__).parents[1] / "examples" / "rig.toml"
FURTHER = {f"exp_{a}": ["--arithmetic", a, "--name", f"finger_{a}", *EXPONENTIAL] for a in ("q15", "f64")}
BAND = ["--memory", "exponential", "--operator", "continuous", "--tolerance", "1e-2", "--band", "0.3", "30"]
FURTHER["band_q31"] = ["--arithmetic", "q31", "--name", "finger_q31", *BAND]
SPECIFIED = {"example": [], "fastest": ["--overshoot", "10"]}


def make(folder: Path, few: tuple[str, ...] = ()) -> None:
    """Every golden form, poles of 16 and of all their bits, and designs of the example rig with their C; or
    only a ``few`` of these, by name.
    """
    for form, how in {**{form: options(form) for form in FORMS}, **FURTHER}.items():
        if not few or form in few:
            done(["generate", str(CONTROLLER), "--out", str(folder / form), *how])
    for name, specification in SPECIFIED.items():
        if few and name not in few:
            continue
        controller = folder / f"{name}.toml"
        done(["design", str(EXAMPLE), "--out", str(controller), *specification])
        done(["generate", str(controller), "--out", str(folder / name), "--arithmetic", "f64"])


def done(argv: list[str]) -> None:
    with contextlib.redirect_stdout(sys.stderr):
        assert main(argv) == 0, argv


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def of_numpy() -> dict[str, str]:
    """What is left to the processor: functions of numpy, and the linear algebra of numpy and of scipy."""
    x = np.linspace(0.01, 20.0, 4000)
    square = np.cos(np.outer(x[:60], x[:60])) + 3.0 * np.eye(60)
    functions = [np.exp(x), np.log(x), x**0.3, np.sin(x)]
    solved = [square @ square, np.linalg.solve(square, x[:60]), linalg.solve(square, x[:60])]
    return {
        name: digest(b"".join(part.tobytes() for part in parts))
        for name, parts in (("functions", functions), ("algebra", solved))
    }


if __name__ == "__main__":
    made = Path(sys.argv[1])
    make(made, tuple(sys.argv[2:]))
    files = {str(p.relative_to(made)): digest(p.read_bytes()) for p in sorted(made.rglob("*")) if p.is_file()}
    print(json.dumps({"files": files, "numpy": of_numpy()}))
