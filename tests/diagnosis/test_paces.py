"""Regulators that fill and vent through one lag in ways of their own, made here step by step.

Red when what changes a regulator's own equation is taken for anything else.
"""

import numpy as np
import pytest
from scipy.signal import lsim

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.replay import placed_in
from focgen.rig.rig import LinearActuator, Rig, Signals

H, SAMPLES, PARTS = 0.02, 3000, 20

# what is asked of a chamber that lags by 1 s, its flow towards that, and where it stops
AS_IT_IS = (lambda u: u, lambda gap: gap, np.inf)


def orifice(gap, scale=0.3):
    """Turbulent above a difference of ``scale``, laminar below."""
    return 2.0 * gap / (1.0 + np.sqrt(1.0 + 4.0 * abs(gap) / scale))


KINDS = {
    "vents at half the pace": (AS_IT_IS[0], lambda gap: gap if gap > 0.0 else 0.5 * gap, np.inf),
    "vents at 0.8 of the pace": (AS_IT_IS[0], lambda gap: gap if gap > 0.0 else 0.8 * gap, np.inf),
    "vents faster": (AS_IT_IS[0], lambda gap: gap if gap > 0.0 else 1.4 * gap, np.inf),
    "vents through a throat": (AS_IT_IS[0], lambda gap: gap if gap > 0.0 else 0.6 * orifice(gap), np.inf),
    "vents with the root": (AS_IT_IS[0], lambda gap: gap if gap > 0.0 else -0.5 * (-gap) ** 0.5, np.inf),
    "fills and vents through throats": (
        AS_IT_IS[0],
        lambda gap: (1.2 if gap > 0.0 else 0.6) * orifice(gap),
        np.inf,
    ),
    "a narrow supply": (AS_IT_IS[0], lambda gap: min(gap, 0.2), np.inf),
    "narrow ways": (AS_IT_IS[0], lambda gap: min(max(gap, -0.2), 0.2), np.inf),
    "a relief valve": (*AS_IT_IS[:2], 0.6),
    "an exhausted supply": (lambda u: min(u, 0.6), *AS_IT_IS[1:]),
}
FOUND = {
    "vents at half the pace": ("valve_asymmetry", "venting_speed", 0.5),
    "vents at 0.8 of the pace": ("valve_asymmetry", "venting_speed", 0.8),
    "vents faster": ("valve_asymmetry", "venting_speed", 1.4),
    "vents through a throat": ("valve_asymmetry", "venting_speed", 0.6),
    "vents with the root": ("valve_asymmetry", "", 0.0),
    "fills and vents through throats": ("valve_asymmetry", "venting_speed", 0.5),
    "a narrow supply": ("valve_asymmetry", "rate", 0.2),
    "narrow ways": ("flow_limit", "rate", 0.2),
    "a relief valve": ("supply_saturation", "ceiling", 0.6),
    "an exhausted supply": ("supply_saturation", "ceiling", 0.6),
}


def lag(gain, time):
    return TransferFunction([(gain, 0.0)], [(time, 1.0), (1.0, 0.0)])


def pumped(seed, kind, more=0.0):
    """Random holds of a command, the pressure, and what a lag makes of it: as measured. ``more``: the pump
    gives that share more from the middle on."""
    asked, flow, most = KINDS[kind]
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 1.0, SAMPLES // 150), 150)
    u[:50] = 0.0
    p, y, found = 0.0, 0.0, []
    for command in u * (1.0 + more * (np.arange(SAMPLES) >= 1650)):
        found.append((p, y))
        for _ in range(PARTS):
            p = min(p + H / PARTS * flow(asked(command) - p), most)
            y += H / PARTS * (2.0 * p - y) / 0.4
    pressure, output = np.array(found).T + np.array([[0.005], [0.01]]) * rng.standard_normal((2, SAMPLES))
    return {"command": u, "pressure": pressure, "output": output}


QUICK = {"vents through a throat", "narrow ways", "an exhausted supply"}


def by_turns():
    """Every kind with the pressure logged and without; the short suite has one kind of each effect, with the
    pressure. Without it, it takes twice as long."""
    for seed, kind in enumerate(KINDS):
        for pressure in ("p", None):
            quick = pressure and kind in QUICK
            yield pytest.param(seed, kind, pressure, marks=() if quick else pytest.mark.long)


@pytest.mark.parametrize("seed, kind, pressure", list(by_turns()))
def test_a_regulator_fills_and_vents_in_a_way_of_its_own(seed, kind, pressure):
    signals = Signals("t", "y", "u", pressure=pressure)
    rig = Rig("pump", H, signals, LinearActuator(lag(1.95, 0.42)), lag(1.01, 1.05))
    log = pumped(seed, kind)
    if not pressure:
        del log["pressure"]
    found = diagnose(rig, [Experiment("holds", H, log)], pictures=False)
    (cause,) = found.causes
    first, effect = cause.candidates[0], FOUND[kind]
    assert (cause.stage, first.effect) == ("regulator", effect[0])
    assert first.confidence > 0.5
    assert not effect[1] or first.parameters[effect[1]].value == pytest.approx(effect[2], rel=0.03)
    assert found.shrink > 0.9


@pytest.mark.parametrize("kind", ["a narrow supply", pytest.param("narrow ways", marks=pytest.mark.long)])
def test_a_rig_of_one_stage_has_a_highest_rate(kind):
    log = pumped(4, kind)
    signals = {"command": log["command"], "output": log["pressure"]}
    rig = Rig("servo", H, Signals("t", "y", "u"), LinearActuator(lag(1.02, 0.95)))
    found = diagnose(rig, [Experiment("holds", H, signals)], pictures=False)
    (cause,) = found.causes
    effect, name, size = FOUND[kind]
    assert cause.candidates[0].effect == effect
    assert cause.candidates[0].parameters[name].value == pytest.approx(size, rel=0.03)


DRIFTS = {
    "gain_drift": lambda p, k: p * (1.0 + 0.1 * (1.0 - np.exp(-k / 1500.0))),
    "sensor_drift": lambda p, k: p + 0.05 * (1.0 - np.exp(-k / 1500.0)),
}


@pytest.mark.long
@pytest.mark.parametrize("effect", ["gain_drift", "sensor_drift"])
def test_a_regulator_drifts_and_is_not_slow(effect):
    """Seen in its own pressure, so that the actuator is not blamed for what moves ahead of it."""
    signals = Signals("t", "y", "u", pressure="p")
    rig = Rig("pump", H, signals, LinearActuator(lag(1.95, 0.42)), lag(1.01, 0.52))
    rng, k = np.random.default_rng(5), np.arange(SAMPLES)
    u = np.repeat(rng.uniform(0.0, 1.0, SAMPLES // 150), 150)
    u[:50] = 0.0
    pressure = DRIFTS[effect](answer(lag(1.0, 0.5), u, True), k)
    output = answer(lag(2.0, 0.4), pressure, False)
    log = {
        "command": u,
        "pressure": pressure + 0.004 * rng.standard_normal(SAMPLES),
        "output": output + 0.008 * rng.standard_normal(SAMPLES),
    }
    found = diagnose(rig, [Experiment("holds", H, log)], pictures=False)
    (cause,) = found.causes
    assert (cause.stage, cause.candidates[0].effect) == ("regulator", effect)


def answer(transfer, x, held):
    """By scipy's simulation of the same equation, the input held or straight between samples."""
    num, den = ([t.coefficient for t in terms] for terms in (transfer.num, transfer.den))
    return lsim((num, den), x, H * np.arange(len(x)), interp=not held)[1]


@pytest.mark.long
def test_what_lasts_is_named_beside_what_changes_at_once():
    """A valve that vents at half the pace, and from 33 s on a pump that gives 5 % more."""
    rig = Rig(
        "pump", H, Signals("t", "y", "u", pressure="p"), LinearActuator(lag(1.95, 0.42)), lag(1.01, 1.05)
    )
    found = diagnose(
        rig, [Experiment("holds", H, pumped(1, "vents at half the pace", more=0.05))], pictures=False
    )
    (cause,) = found.causes
    assert [c.effect for c in cause.candidates] == ["valve_asymmetry"]
    assert cause.candidates[0].parameters["venting_speed"].value == pytest.approx(0.5, rel=0.05)
    (placed,) = placed_in(found.augmented)
    assert placed.values == pytest.approx((cause.candidates[0].parameters["venting_speed"].value,), rel=1e-9)
    (note,) = (n for n in found.notes if "at once" in n)
    assert float(note.split("becomes another: ")[1].split(" s into")[0]) == pytest.approx(33.0, abs=3.0)
