"""The pytest plug-in: a fixture ``assert_equivalent``, whose samples and seed the command line can set.

    def test_my_port(assert_equivalent):
        assert_equivalent("firmware", from_c(["port.c"], prefix="port"))

``pytest --focgen-samples 1000000 --focgen-seed 7`` tries more, and other, inputs.
"""

import functools
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """The two options."""
    group = parser.getgroup("focgen", "equivalence with a generated controller")
    group.addoption("--focgen-samples", type=int, metavar="N", help="mixed inputs of assert_equivalent")
    group.addoption("--focgen-seed", type=int, metavar="S", help="seed of the inputs of assert_equivalent")


@pytest.fixture
def assert_equivalent(request: pytest.FixtureRequest) -> Any:
    """:func:`focgen.testing.assert_equivalent`, with what the command line says."""
    from focgen.testing.equivalence import assert_equivalent as function

    chosen = {key: request.config.getoption(f"--focgen-{key}") for key in ("samples", "seed")}
    return functools.partial(function, **{key: value for key, value in chosen.items() if value is not None})
