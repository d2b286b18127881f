"""The hand-made baseline judges a rig of first order in the generator's own terms.

Red when the order of such a rig is moved to where the generator's fractional scheme does not hold, so that
what the baseline compares is no number.
"""

import warnings

import numpy as np
import pytest

import focgen
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.baselines import guess
from focgen.trials.severity import below_one


@pytest.mark.parametrize("alpha, made", [(0.6, 0.6), (0.99, 0.99), (1.0, 0.99), (1.3, 0.99)])
def test_the_order_is_kept_below_one(alpha, made):
    rig = Rig("r", 0.05, Signals("t", "y", command="u"), Actuator(0.5, alpha, (2.0,)))
    assert below_one(rig).actuator.alpha == made


def test_a_rig_of_first_order_is_looked_at(tmp_path):
    h, n = 0.05, 1200
    u = np.repeat(np.random.default_rng(1).uniform(0.0, 1.0, n // 60), 60)
    y = np.zeros(n)
    for k in range(n - 1):
        y[k + 1] = y[k] + h * (2.0 * u[k] - y[k]) / 0.5
    read = y + 0.2 * np.linspace(0.0, 1.0, n) + np.random.default_rng(2).normal(0.0, 0.004, n)
    logged = Experiment("steps", h, {"command": u, "output": read})
    (tmp_path / "logs").mkdir()
    focgen.write_rig(
        Rig("r", h, Signals("t", "y", command="u"), Actuator(0.5, 1.0, (2.0,))), tmp_path / "rig.toml"
    )
    rows = np.stack([logged.time, u, read], axis=1)
    np.savetxt(tmp_path / "logs" / "steps.csv", rows, "%.6g", ",", header="t,u,y", comments="")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert guess(tmp_path) == "sensor_drift"
