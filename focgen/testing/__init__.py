"""Tests of C of your own, or of anything else that steps, against the reference of a generated controller.

from focgen.testing import assert_equivalent, from_c

def test_my_port():
    assert_equivalent("firmware", from_c(["port.c"], prefix="port"))
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focgen.testing.equivalence import Equivalence, assert_equivalent
    from focgen.testing.own_c import from_c

_HOME = {
    "assert_equivalent": "focgen.testing.equivalence",
    "Equivalence": "focgen.testing.equivalence",
    "from_c": "focgen.testing.own_c",
}

__all__ = ["Equivalence", "assert_equivalent", "from_c"]


if not TYPE_CHECKING:  # a checker reads the imports above

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module 'focgen.testing' has no attribute {name!r}")
        return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
