"""What a loaded controller is given that only looks like numbers: refused in a line, and the state stays.

Red when such a thing raises anything but InputError, or is taken for a number.
"""

import datetime
import decimal
import warnings
from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.codegen.generate import generate
from focgen.control.controller import Tunable
from focgen.errors import InputError
from focgen.fractional.transfer import TransferFunction
from tests.controllers import seed_controller, simple

ONE = {
    "digits without end": 10**400,
    "text": "0.01",
    "bytes": b"0.01",
    "complex": 1j,
    "signalling NaN": decimal.Decimal("sNaN"),
    "nothing": None,
    "masked": np.ma.masked,
    "a class": int,
    "an array": np.array([0.01, 0.02]),
}
MANY = {
    "rows of several lengths": [[1.0], [1.0, 2.0]],
    "digits without end": [0.01, 10**400],
    "texts": ["0.01", "0.02"],
    "texts among numbers": np.array([0.01, "0.02"], object),
    "complex": np.array([0.01 + 5j]),
    "dates": np.array([datetime.date(2026, 1, 1)], "datetime64[s]"),
    "times": np.array([5], "timedelta64[s]"),
    "records": np.zeros(3, [("a", float)]),
    "masked": np.ma.array([0.01, 1e9], mask=[False, True]),
}


@pytest.fixture(scope="module", params=("f32", "q15"))
def controller(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    generate(seed_controller(5), folder, request.param)
    return focgen.load(folder)


def _scheduled(controller):
    return (0.0,) if controller.scheduled else ()


@pytest.mark.parametrize("kind", ONE)
def test_one_that_is_no_number_is_refused(controller, kind):
    state = controller._machine.content(controller._state)
    with pytest.raises(InputError, match="ref"):
        controller.step(ONE[kind], 0.0, *_scheduled(controller))
    assert controller._machine.content(controller._state) == state


@pytest.mark.parametrize("kind", ONE)
def test_one_that_is_no_count_is_refused(controller, kind):
    """In counts a number of a format is whole."""
    counting = controller.counts()
    sched = (0,) if controller.scheduled else ()
    with pytest.raises(InputError, match="ref") as told:
        counting.step(ONE[kind], 0, *sched)
    assert "\n" not in str(told.value)


def test_numbers_beyond_all_are_ends_without_a_warning(controller):
    """As infinity is."""
    sched = (0.0,) if controller.scheduled else ()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(controller.new().run([1e308, -1e308], 0.0, *sched)).all()


@pytest.mark.parametrize("kind", MANY)
def test_many_that_are_no_numbers_are_refused(controller, kind):
    state = controller._machine.content(controller._state)
    with pytest.raises(InputError, match="ref"):
        controller.run(MANY[kind], 0.0, *_scheduled(controller))
    assert controller._machine.content(controller._state) == state


def test_arrays_of_any_layout_are_the_same_numbers(controller):
    """Strides, byte order, alignment and width of an array are no matter."""
    given = np.linspace(0.0, 0.01, 50).astype(np.float32).astype(float)
    packed = np.frombuffer(b"x" + given.tobytes(), np.uint8)[1:].view(np.float64)
    spread = np.zeros(100)
    spread[::2] = given
    kinds = [given[::-1].copy()[::-1], spread[::2], packed, given.astype(">f8"), given.astype(np.longdouble)]
    kinds += [given.astype(object), np.ma.array(given), list(given), given.astype(np.float32)]
    right = controller.new().run(given, 0.0, *_scheduled(controller))
    assert np.ptp(right) > 0
    for one in kinds:
        np.testing.assert_array_equal(controller.new().run(one, 0.0, *_scheduled(controller)), right)


@pytest.mark.parametrize(
    "gain",
    [
        *(2.0, {1.0: 2}, [[1.0]], (10**400,)),
        *(pytest.param(g, marks=pytest.mark.long) for g in (None, "1", 1j, ("1",), (None,), (np.ones(2),))),
    ],
)
def test_factors_that_are_no_row_of_numbers_are_refused(tmp_path, gain):
    """One gain has one factor, in a tuple all the same."""
    made = simple(
        TransferFunction([(1.0, 0.5)]), length=5, tunable=Tunable((0.5, 2.0), (-10.0, -10.0), (10.0, 10.0))
    )
    generate(made, tmp_path, "q31", tunable=True)
    loaded = focgen.load(tmp_path)
    for call in (loaded.check, loaded.tune):
        with pytest.raises(InputError):
            call(replace(loaded.default(), gain=gain))
    assert loaded.check(replace(loaded.default(), gain=np.array([1.5]))) == 0
