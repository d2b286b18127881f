"""Programs that build packages: on the path, or from the Python packages that bring them."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest


def build_tool(name: str) -> str:
    """The path of a program. Skips where it is neither on this machine nor beside this Python."""
    found = shutil.which(name) or shutil.which(name, path=str(Path(sys.executable).parent))
    if not found:
        pytest.skip(f"{name} is not on this machine; pip install {name} brings it")
    return found
