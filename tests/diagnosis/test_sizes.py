"""The unit of every parameter of the library: that of the signal where its form acts, and of the time.

Red when a parameter is written in another unit than its form works in.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.control.units import units_of_rig
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.verdict.sizes import at_their_ends, unit_of_parameter
from focgen.fractional import TransferFunction
from focgen.rig.effects import form_of, library
from focgen.rig.placed import slot_in
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

COLUMNS = Signals(time="t", command="u_V", pressure="p_bar", curvature="phi_deg", output="y_mV")
RIG = Rig("hinge", 0.01, COLUMNS, Actuator(1.0, 0.6, (20.0,)), sensor=TransferFunction([(3.0, 0.0)]))
SIZES = [
    ("supply_saturation", "hard", "ceiling", "bar"),
    ("transport_delay", "delay", "delay", "s"),
    ("flow_limit", "hard", "rate", "bar/s"),
    ("leak", "turbulent", "loss", "bar^0.5"),
    ("valve_stiction", "play", "band", "V"),
    ("dead_zone", "hard", "threshold", "bar"),
    ("hysteresis", "play", "width", "deg"),
    ("gain_nonlinearity", "exponential", "bend", "1/deg"),
    ("friction", "rising", "speed", "deg/s"),
    ("gain_drift", "linear", "rate", "1/s"),
    ("sensor_drift", "linear", "rate", "mV/s"),
    ("sensor_hysteresis", "play", "width", "deg"),
    ("sensor_saturation", "hard", "limit", "mV"),
    ("creep", "pole", "share", ""),
]


def unit(effect: str, form: str, name: str, rig: Rig = RIG) -> str:
    """The unit of a parameter in the family's own stage."""
    made = form_of(effect, form)
    parameter = next(p for p in made.parameters if p.name == name)
    return unit_of_parameter(parameter, slot_in(made, library()[effect].stage), rig)


@pytest.mark.parametrize("effect, form, name, expected", SIZES)
def test_a_size_is_in_the_unit_of_the_column_where_the_effect_acts(effect, form, name, expected):
    assert unit(effect, form, name) == expected


def test_every_level_and_time_of_the_library_has_a_unit():
    bare = {
        (e.name, f.name, p.name)
        for e in library().values()
        for f in e.forms
        for p in f.parameters
        if (p.level or p.time) and not unit_of_parameter(p, slot_in(f, e.stage), RIG)
    }
    assert bare == set()


def test_friction_is_in_the_unit_of_what_drives_the_plant():
    axis = replace(RIG, actuator=LinearActuator(TransferFunction([(1.0, 0.0)], [(2.0, 2.0), (1.0, 1.0)])))
    assert unit("friction", "coulomb", "force") == "deg"  # of K(p) p
    assert unit("friction", "coulomb", "force", axis) == "bar"


def test_units_over_something_are_turned_over():
    rig = replace(RIG, signals=replace(COLUMNS, curvature="kappa_per_mm"))
    assert unit("gain_nonlinearity", "exponential", "bend", rig) == "mm"
    assert unit("friction", "rising", "speed", rig) == "1/(mm s)"


def test_signals_without_a_column_borrow_a_unit_only_where_nothing_lies_between():
    bare = replace(RIG, signals=replace(COLUMNS, pressure=None, curvature=None))
    assert unit("dead_zone", "hard", "threshold", bare) == "V"  # no regulator is given
    assert unit("hysteresis", "play", "width", bare) == "curvature unit"  # the sensor reads 3 mV a unit
    plain = replace(bare, sensor=TransferFunction([(1.0, 0.0)], [(0.1, 1.0), (1.0, 0.0)]))
    assert units_of_rig(plain)["curvature"] == "mV"


@pytest.mark.parametrize(
    "values, ended",
    [
        ((0.1, 0.4), ("recovering_speed",)),  # ten times as slow: as slow as is looked for
        ((0.11, 0.4), ()),
        ((0.5, 3.0), ("share",)),
        ((0.5, 0.0), ()),  # nothing of it is no end
    ],
)
def test_a_number_at_the_end_of_where_it_is_looked_for_is_said(values, ended):
    """A centripetal pull on a sensor was a lag ten times as slow at 0.95, beside a relaxation of three times
    the reading."""
    speed, share = values
    forms = form_of("sensor_lag", "speed"), form_of("sensor_relaxation", "one_time")
    candidates = [CandidateEffect("seen", form, "sensor") for form in forms]
    vector = np.array([7.0, np.log(speed), share, np.log(2.0)])
    fit = SimpleNamespace(problem=SimpleNamespace(head=1, candidates=candidates), vector=vector)
    assert at_their_ends(SimpleNamespace(effect="seen", fit=fit)) == ended
    assert at_their_ends(SimpleNamespace(effect="another", fit=fit)) == ()
