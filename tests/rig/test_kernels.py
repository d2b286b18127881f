"""The compiled loops against the same sums written in Python, one sample and one mode at a time.

Red when a loop that was made quicker is no longer what it was.
"""

import numpy as np
import pytest

from focgen.rig import kernels

FREE = {"place": 0.0, "stiffness": 0.0, "slide": 0.0, "stick": 0.0}


def rest(n):
    made = np.zeros(n, np.uint8)
    made[[0, n // 2]] = 1
    return made


def modes_in_python(x, begins, rows, through, switching, place, stiffness, slide, stick):
    """Every mode by itself; the present input, which y depends on in a line, solved for as that."""
    y, z, past, last, moving = np.zeros(len(x)), None, 0.0, 0.0, False
    for k, now in enumerate(x):
        if begins[k]:
            z, past, last, moving = np.zeros(len(rows[0].a)), 0.0, 0.0, False
        row = rows[int(switching and abs(now) < abs(last))]
        still, gain = np.sum(row.a * z + row.b0 * past), through + np.sum(row.b1)
        pushed = stiffness * max(last - place, 0.0) if stiffness else 0.0
        borne = now - pushed - (last - still) / gain
        if stick and abs(borne) <= (slide if moving else stick):
            now, moving = now - borne - pushed, False
        else:
            moving = bool(stick)
            now -= np.copysign(slide, borne) if stick else 0.0
            beyond = (still + gain * now - place) / (1.0 + gain * stiffness)
            now -= stiffness * beyond if stiffness and beyond > 0.0 else 0.0
        z = row.a * z + row.b0 * past + row.b1 * now
        past, last = now, through * now + np.sum(z)
        y[k] = last
    return y


class Row:
    def __init__(self, rng, m, speed):
        rates = np.sort(rng.uniform(0.002, 0.9, m)) * speed
        self.a, weight = np.exp(-rates), rng.uniform(0.5, 1.0, m) / m
        self.b0, self.b1 = 0.4 * weight * (1 - self.a), 0.6 * weight * (1 - self.a)


@pytest.mark.parametrize("m", [1, 7, 32, 45])  # as many as are run at once, and more
@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"switching": True},
        {"place": 0.3, "stiffness": 2.0},
        {"slide": 0.2, "stick": 0.3},
        {"switching": True, "place": 0.2, "stiffness": 1.0, "slide": 0.1, "stick": 0.1},
    ],
    ids=["free", "two paces", "obstacle", "friction", "all"],
)
def test_modes_are_the_sum_of_each(m, changed):
    rng = np.random.default_rng(m)
    x = 2.0 * np.sin(0.03 * np.arange(600)) + 0.3 * np.sin(0.4 * np.arange(600))
    rows, own = (Row(rng, m, 1.0), Row(rng, m, 3.0)), FREE | {"switching": False} | changed
    tables = [np.array([getattr(row, name) for row in rows]) for name in ("a", "b0", "b1")]
    made = kernels.modes(x, rest(600), *tables, np.zeros((2, 6)), 0.05, **own)
    exact = modes_in_python(x, rest(600), rows, 0.05, **own)
    np.testing.assert_allclose(made, exact, atol=1e-12 * np.max(np.abs(exact)))


@pytest.mark.parametrize(
    "changed", [{"switching": True}, {"place": 0.3, "stiffness": 2.0}], ids=["two paces", "obstacle"]
)
def test_modes_in_equilibrium_are_those_of_a_long_hold(changed):
    rng, held, own = np.random.default_rng(7), 20_000, FREE | {"switching": False} | changed
    x = 1.0 + 0.5 * np.sin(0.03 * np.arange(600))
    rows = (Row(rng, 7, 1.0), Row(rng, 7, 3.0))
    tables = [np.array([getattr(row, name) for row in rows]) for name in ("a", "b0", "b1")]
    begins = np.zeros(600, np.uint8)
    begins[0] = kernels.BALANCED
    made = kernels.modes(x, begins, *tables, np.zeros((2, 6)), 0.05, **own)
    long = np.r_[np.full(held, x[0]), x]
    first = np.zeros(len(long), np.uint8)
    first[0] = 1
    exact = kernels.modes(long, first, *tables, np.zeros((2, 6)), 0.05, **own)[held:]
    np.testing.assert_allclose(made, exact, atol=1e-9)


@pytest.mark.parametrize(("k", "known"), [(1, 0), (6, 0), (9, 5), (13, 12)])
def test_products_of_few_rows_or_many_known_or_not(k, known):
    rows = np.random.default_rng(k).standard_normal((k, 2100))
    exact = rows @ rows.T
    made = kernels.products(rows, exact[:known, :known] if known else None)
    np.testing.assert_allclose(made, exact, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("coarse", [1, 4])
@pytest.mark.parametrize(
    "ar", [[1.0], [1.0, -0.6, 0.2], [1.0, *0.6 ** np.arange(1, 10)]], ids=["white", "coloured", "of order 9"]
)
def test_innovations_and_what_they_are_more_than_others(coarse, ar):
    rng, n = np.random.default_rng(coarse), 3001
    y, made, weight = rng.standard_normal((3, n))
    whitened = []
    for first, last in ((0, n // 2), (n // 2, n)):
        count = (last - first) // coarse
        left = (weight * (y - made))[first : first + count * coarse].reshape(count, coarse).mean(axis=1)
        whitened.append(np.convolve(left, ar)[:count])
    exact = np.concatenate(whitened)
    found = kernels.innovations(y, made, weight, rest(n), coarse, np.array(ar))
    np.testing.assert_allclose(found, exact, atol=1e-12)
    less, into = rng.standard_normal(len(exact)), np.empty(len(exact))
    kernels.innovations(y, made, weight, rest(n), coarse, np.array(ar), less, 250.0, into)
    np.testing.assert_allclose(into, 250.0 * (exact - less), atol=1e-9)
