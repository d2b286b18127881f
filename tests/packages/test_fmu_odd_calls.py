"""A simulator that calls the block with times and values that are none: it says so, and goes on as before.

Red when such a step never ends, is called good, or when an output is no number or beyond its limits.
"""

import math

import pytest

from tests.controllers import seed_controller
from tests.packages.test_fmu import STEP, fmpy, instantiated, made  # noqa: F401 - a fixture

ODD = ((0.0, math.nan), (math.nan, STEP), (0.0, math.inf), (0.0, 1e300), (0.0, -STEP), (-math.inf, STEP))


def _refused(unit, now, size) -> bool:
    """Whether the block has an error to answer; FMPy raises it, FMI 3.0 answers in its own way."""
    try:
        unit.doStep(currentCommunicationPoint=now, communicationStepSize=size)
    except Exception as reason:  # noqa: BLE001 - FMPy has no exception of its own for it
        return "status 3" in str(reason)
    return False


@pytest.mark.parametrize("fmi", (2, 3))
def test_a_step_that_is_none_is_refused_at_once(fmpy, fmi, tmp_path):  # noqa: F811
    units = [
        instantiated(fmpy, made(tmp_path, seed_controller(9, name="filter"), "f32", fmi))[0] for _ in "ab"
    ]
    for unit in units:
        unit.exitInitializationMode()
    assert all(_refused(units[0], now, size) for now, size in ODD)
    for k in range(5):
        assert not any(_refused(unit, k * STEP, STEP) for unit in units)
    get = [unit.getReal if fmi == 2 else unit.getFloat64 for unit in units]
    assert get[0]([0, 4]) == get[1]([0, 4])
    for unit in units:
        unit.terminate()
        unit.freeInstance()


@pytest.mark.parametrize(
    "fmi, arithmetic",
    [
        (2, "q15"),
        (3, "f32"),
        *(pytest.param(*one, marks=pytest.mark.long) for one in ((2, "f32"), (3, "q15"))),
    ],
)
def test_a_start_that_is_no_number_is_a_limit(fmpy, arithmetic, fmi, tmp_path):  # noqa: F811
    controller = seed_controller(5, name="filter")
    assert controller.integrator
    unit, numbers = instantiated(fmpy, made(tmp_path, controller, arithmetic, fmi))
    get, put = (unit.getReal, unit.setReal) if fmi == 2 else (unit.getFloat64, unit.setFloat64)
    put([numbers["u0"]], [math.nan])
    unit.setBoolean([numbers["reset"]], [True])
    unit.exitInitializationMode()
    low, high = controller.ranges.output
    (u,) = get([numbers["u"]])
    assert low <= u <= high and abs(u - low) < 1e-3 * (high - low)
    unit.terminate()
    unit.freeInstance()
