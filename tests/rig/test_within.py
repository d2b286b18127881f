"""What a quick regulator makes of a held command within each sample, beside its exact response.

Red when an area or a moment of a sample is not that of the response, or readings that another regulator made
are taken to run as this one's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.rig.within import (
    PLACES,
    by_regulator,
    course_within,
    is_quick,
    kinks,
    laid_on_samples,
    read_within,
)

H = 0.2
COUNT = 60


def lag(tau, gain=1.1):
    return TransferFunction([(gain, 0.0)], [(tau, 1.0), (1.0, 0.0)])


def pulses(rng):
    return np.repeat(rng.uniform(-1.0, 3.0, COUNT // 6), 6) * (np.arange(COUNT) > 2)


def exact(command, tau, at, gain=1.1):
    """The response of a lag at rest to a held command (n,), at any times (m,): a sum of closed forms."""
    jumps = np.diff(command, prepend=0.0)
    since = at[:, None] - H * np.arange(len(command))
    return gain * (-np.expm1(-np.maximum(since, 0.0) / tau)) @ jumps


def times(late=0.0):
    """At the places of the sample that ends at each index, (7, n)."""
    return H * (np.arange(COUNT)[None, :] - 1.0 + PLACES[:, None]) - late


@pytest.mark.parametrize("late", [0.0, 0.07, 0.5, -0.07, -0.3])
@pytest.mark.parametrize("tau", [0.04, 0.2, 0.6])
def test_a_regulator_is_followed_within_samples(tau, late):
    command = pulses(np.random.default_rng(1))
    made = by_regulator(lag(tau), H, command, late)
    kept = slice(0, COUNT - 2)  # of a command that was ahead of its row, the log does not hold the last
    wanted = exact(command, tau, times(late).ravel()).reshape(made.shape)
    np.testing.assert_allclose(made[:, kept], wanted[:, kept], atol=1e-9)


def gauss(values):
    """The means (n,) of a signal and of its moment, over each sample, by 400 points."""
    places = (np.arange(400) + 0.5) / 400
    return values(places).mean(0), (values(places) * (2.0 * places[:, None] - 1.0)).mean(0)


@pytest.mark.parametrize("tau", [0.1, 0.3])
def test_areas_and_moments_of_each_sample_are_those_of_the_response(tau):
    command = pulses(np.random.default_rng(2))
    course = course_within(by_regulator(lag(tau), H, command, 0.0)[None])

    def response(x):
        at = H * (np.arange(COUNT)[None, :] - 1.0 + x[:, None])
        return exact(command, tau, at.ravel()).reshape(at.shape)

    def drawn(x):
        x = x[:, None]
        line = course.values[0] - course.straight[0] * (1.0 - x)
        return line + course.bends[0] * x * (x - 1.0) + course.twists[0] * x * (x - 1.0) * (2.0 * x - 1.0)

    for wanted, found in zip(gauss(response), gauss(drawn)):
        np.testing.assert_allclose(found[1:], wanted[1:], atol=2e-3 * np.ptp(command))


@pytest.mark.parametrize("tau", [0.1, 0.3])
def test_straight_lines_hold_the_area_of_the_response_once_it_is_laid_on_the_samples(tau):
    command = np.zeros(COUNT)
    command[10:20] = 1.0
    made = by_regulator(lag(tau), H, command, 0.0)
    laid = made[-1] + laid_on_samples(made, np.arange(COUNT) == 0)
    times = np.arange(COUNT) * H
    area, first = 1.1 * 10 * H, 1.1 * 10 * H * (14.5 * H + 0.5 * H + tau)  # of a pulse behind a lag
    assert H * laid.sum() == pytest.approx(area, rel=1e-3)
    assert H * times @ laid == pytest.approx(first, rel=1e-3)
    assert abs(H * times @ made[-1] / first - 1.0) > 3e-3  # lines through the readings do not


@pytest.mark.parametrize("tau", [0.1, 0.3])
def test_what_lines_miss_goes_to_the_end_of_the_sample_that_it_is_nearer_to(tau):
    command = (np.arange(COUNT) >= 10).astype(float)
    made = by_regulator(lag(tau), H, command, 0.0)
    nodes, fine = np.arange(COUNT) * H, np.arange(COUNT * 500 - 499) * H / 500
    wanted = exact(command, tau, fine)
    lines = [np.interp(fine, nodes, y) for y in (made[-1] + laid_on_samples(made, nodes == 0.0), made[-1])]
    for power in (0, 1):
        off, plain = (float((fine - 10 * H) ** power @ (line - wanted)) for line in lines)
        assert abs(off) < 0.02 * abs(plain)


def test_experiments_stay_apart():
    command = np.r_[np.ones(COUNT), np.zeros(COUNT)]
    made = np.concatenate([by_regulator(lag(0.1), H, part, 0.0) for part in np.split(command, 2)], axis=1)
    first = np.arange(2 * COUNT) % COUNT == 0
    assert not np.any(laid_on_samples(made, first)[COUNT:])
    assert np.any(laid_on_samples(made, np.arange(2 * COUNT) == 0)[COUNT - 1 : COUNT + 1])
    begun = made + (PLACES[:, None] - 1.0) * first  # what was before a log begins is no part of it
    np.testing.assert_array_equal(laid_on_samples(begun, first), laid_on_samples(made, first))


@pytest.mark.parametrize("off", [1.0, 1.03])
def test_readings_run_as_the_regulator_that_made_them(off):
    rng = np.random.default_rng(3)
    command, first = pulses(rng), np.arange(COUNT) == 0
    made = by_regulator(lag(off * 0.1), H, command, 0.0)
    slow = 0.05 * np.sin(np.arange(COUNT) / 9.0)
    readings = exact(command, 0.1, H * np.arange(COUNT)) + slow + rng.normal(0.0, 0.003, COUNT)
    found = read_within(readings, made, first)
    np.testing.assert_allclose(found[-1], readings)
    wanted = exact(command, 0.1, times().ravel()).reshape(made.shape) + slow
    lines = np.r_[readings[:1], readings[:-1]] * (1.0 - PLACES[:, None]) + PLACES[:, None] * readings
    missed = [np.sqrt(np.mean((way - wanted)[:, 1:] ** 2)) for way in (found, lines)]
    assert missed[0] < 0.3 * missed[1]


@pytest.mark.parametrize("tau", [0.3, 0.6])
def test_readings_of_another_regulator_run_in_lines(tau):
    command = pulses(np.random.default_rng(4))
    readings = exact(command, tau, H * np.arange(COUNT))
    assert read_within(readings, by_regulator(lag(0.08), H, command, 0.0), np.arange(COUNT) == 0) is None


def test_a_chain_turns_within_samples_where_all_of_it_is_quick():
    rig = Rig("r", H, Signals("t", "y", "u"), Actuator(0.5, 0.6, (1.0,)), regulator=lag(0.1))
    assert kinks(rig, ("regulator", "actuator"), H) and kinks(rig, ("regulator", "sensor"), H)
    assert not kinks(rig, ("sensor",), H)  # which is 1
    assert not kinks(replace(rig, regulator=lag(5.0)), ("regulator", "actuator"), H)


def test_quick_is_what_is_through_with_its_way_in_few_samples():
    assert [is_quick(lag(tau, -2.0), H) for tau in (0.01, 0.2, 1.7, 1.9, 20.0)] == [True] * 3 + [False] * 2
    assert not is_quick(TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]), H)  # which integrates
