"""The plant of a study: memory in the denominator, against Mittag-Leffler functions and whole sums.

Red when a plant in a study ends elsewhere than the exact one.
"""

import math

import numpy as np
import pytest
from scipy.special import erfcx

from focgen.fractional.transfer import TransferFunction
from focgen.studies import plant
from focgen.studies.results import Variant
from tests.conftest import paper_controller, paper_rig

LAG = TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)])


def test_where_short_memory_ends():
    """1/(T h^−α Σ w + 1), and an hour of simulation ends there; the exponential form ends where it should."""
    for length in (20, 300):
        found = plant.plant_row(LAG, Variant("short", "f64", 0.1, length=length))
        ratio = math.exp(math.lgamma(length + 0.4) - math.lgamma(length + 1.0)) / math.gamma(0.4)
        assert found.rest == pytest.approx(1.0 / (1.0 + 1.32 * 0.1**-0.6 * ratio), rel=1e-12)
        assert found.output[-1] == pytest.approx(found.rest, abs=1e-9)
    found = plant.plant_row(LAG, Variant("exponential", "f64", 0.1, tolerance=1e-5, horizon=100_000))
    assert found.rest == 1.0 and abs(found.errors["1 h"]) < 1e-5


def test_the_exact_step_is_a_mittag_leffler_function():
    """At α = 1/2, T = 1 the step response is 1 − erfcx(√t)."""
    half = TransferFunction([(1.0, 0.0)], [(1.0, 0.5), (1.0, 0.0)])
    t = plant.plant_times(0.1) * 0.1
    assert plant.exact_step(half, 0.1) == pytest.approx(1.0 - erfcx(np.sqrt(t)), abs=1e-11)


def test_the_plant_is_the_rig_s_or_what_the_controller_inverts():
    assert plant.plant_of(paper_controller(), paper_rig()) == LAG
    assert plant.plant_of(paper_controller(), None) == LAG
    whole = TransferFunction([(1.0, 1.0), (1.0, 0.0)])
    assert plant.plant_of(paper_controller(transfer=whole), None) is None
