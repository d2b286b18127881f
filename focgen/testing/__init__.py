"""Tests of C of your own, or of anything else that steps, against the reference of a generated controller.

from focgen.testing import assert_equivalent, from_c

def test_my_port():
    assert_equivalent("firmware", from_c(["port.c"], prefix="port"))
"""

from importlib import import_module

_HOME = {
    "assert_equivalent": "focgen.testing.equivalence",
    "Equivalence": "focgen.testing.equivalence",
    "from_c": "focgen.testing.own_c",
}

__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'focgen.testing' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
