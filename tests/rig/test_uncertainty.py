"""[uncertainty] of a rig: in the file, its corners, and the rig in one of them.

Red when an uncertainty is read wrongly, or a corner is not that of the file.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.rig import LinearActuator, read_rig, write_rig
from focgen.rig.corners import EXACT, corners, differences, moved, without_gain
from focgen.rig.rig import UNITY, Actuator, Delays, Relative, Uncertainty
from tests.conftest import paper_rig

HEAD = 'name = "r"\nsample_time = 0.02\n[signals]\ntime = "t"\noutput = "y"\ncommand = "u"\n'


def read(tmp_path, text):
    (tmp_path / "rig.toml").write_text(HEAD + text)
    return read_rig(tmp_path / "rig.toml")


def test_the_defaults_are_those_of_the_documentation(tmp_path):
    found = read(tmp_path, "").uncertainty
    assert found.regulator == Relative(0.02, 0.1) and found.sensor == Relative(0.02, 0.1)
    assert found.actuator == Relative(0.2, 0.2, 0.1)


def test_what_is_given_takes_the_place_of_its_default_only(tmp_path):
    found = read(tmp_path, "[uncertainty]\nactuator = { alpha = 0.03 }\nsensor = { gain = 0, time = 0.5 }\n")
    expected = Uncertainty(actuator=Relative(0.2, 0.2, 0.03), sensor=Relative(0.0, 0.5))
    assert found.uncertainty == expected


def test_it_is_written_only_where_given(tmp_path):
    path = tmp_path / "rig.toml"
    write_rig(paper_rig(), path)
    assert "uncertainty" not in path.read_text()
    given = replace(paper_rig(), uncertainty=Uncertainty(sensor=Relative(0.01, 0.3)))
    write_rig(given, path)
    assert read_rig(path) == given
    assert "[uncertainty.sensor]" in path.read_text() and "uncertainty.actuator" not in path.read_text()


FAULTS = {
    "negative": ("actuator = { gain = -0.1 }", "is -0.1"),
    "all of it": ("actuator = { time = 1.0 }", "is 1"),
    "percent": ("sensor = { gain = 5 }", "below 1"),
    "not a number": ('sensor = { gain = "2 %" }', "not a finite number"),
    "no order there": ("regulator = { alpha = 0.1 }", "unknown key 'alpha'"),
    "no such stage": ("camera = { gain = 0.1 }", "unknown key 'camera'"),
    "no table": ("actuator = 0.2", "not a table"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_where_what_and_remedy(tmp_path, fault):
    text, expected = FAULTS[fault]
    with pytest.raises(RigError) as caught:
        read(tmp_path, f"[uncertainty]\n{text}\n")
    assert expected in str(caught.value) and "[uncertainty]" in caught.value.where and caught.value.remedy


# --------------------------------------------------------------------------------------------------- corners


def test_every_combination_of_times_and_orders_with_the_lowest_and_the_highest_gain():
    found = corners(paper_rig())
    assert found[0] == EXACT and len(found) == 1 + 2 * 2**4  # the times of three stages, and alpha
    for off in found[1:]:
        gains = {np.sign(part.gain) for part in vars(off).values()}
        assert len(gains) == 1 and abs(off.actuator.gain) == 0.2 and abs(off.actuator.alpha) == 0.1
        assert abs(off.regulator.time) == abs(off.sensor.time) == 0.1
    assert len(set(found)) == len(found)


def test_what_a_stage_has_not_got_is_not_uncertain():
    plain = LinearActuator(TransferFunction([(1.0, 0.0)], [(1.0, 0.7), (1.0, 0.0)]))
    rig = replace(paper_rig(), actuator=plain, regulator=UNITY, sensor=TransferFunction([(2.0, 0.0)]))
    assert {(stage, key) for off in corners(rig) for stage, key, _ in differences(off)} == {
        ("actuator", "gain"),
        ("actuator", "time"),
        ("sensor", "gain"),
    }
    late = replace(rig, actuator=None, delays=Delays(regulator=0.1))
    moves = {(stage, key) for off in corners(late) for stage, key, _ in differences(off)}
    assert moves == {("regulator", "gain"), ("regulator", "time"), ("sensor", "gain")}


def test_a_rig_that_is_known_has_no_corners():
    known = replace(paper_rig(), uncertainty=Uncertainty(*[Relative(0.0, 0.0)] * 3))
    assert corners(known) == (EXACT,)


def test_a_rig_that_is_not_off_is_the_rig():
    late = replace(paper_rig(), delays=Delays(0.1, 0.2, 0.3))
    assert moved(late, EXACT) == late
    slow = TransferFunction([(1.0, 0.0)], [(1.0, 0.7), (1.0, 0.0)])
    plain = replace(late, actuator=LinearActuator(slow, 0.5))
    assert moved(plain, EXACT) == plain


def test_time_stretched_is_frequency_compressed():
    """R(s f) and the delay times f: the response at ω is what it was at f ω."""
    off = Uncertainty(Relative(0.1, 0.25), Relative(-0.2, -0.5), Relative(0.0, -0.1))
    linear = LinearActuator(TransferFunction([(1.0, 0.3), (1.0, 0.0)], [(1.0, 1.3), (2.0, 0.0)]), 0.5)
    rig = replace(paper_rig(), actuator=linear, delays=Delays(0.1, 0.2, 0.3))
    found, omega = moved(rig, off), np.geomspace(0.1, 100.0, 20)
    for stage, gain, factor in (("regulator", 1.1, 1.25), ("sensor", 1.0, 0.9)):
        a, b = getattr(found, stage), getattr(rig, stage)
        expected = gain * b.frequency_response(factor * omega)
        np.testing.assert_allclose(a.frequency_response(omega), expected, rtol=1e-12)
        assert getattr(found.delays, stage) == pytest.approx(factor * getattr(rig.delays, stage))
    expected = 0.8 * linear.dynamics.frequency_response(0.5 * omega)
    np.testing.assert_allclose(found.actuator.dynamics.frequency_response(omega), expected, rtol=1e-12)
    assert found.delays.actuator == pytest.approx(0.1) and found.actuator.offset == 0.5


def test_an_actuator_keeps_its_form():
    off = Uncertainty(actuator=Relative(0.2, -0.2, 0.1))
    found = moved(paper_rig(), off).actuator
    assert found.T == pytest.approx(1.32 * 0.8) and found.alpha == pytest.approx(0.66)
    assert found.gain == pytest.approx((0.0018, 0.414))
    fast = replace(paper_rig(), actuator=Actuator(1.0, 1.9, (1.0,)))
    assert moved(fast, off).actuator.alpha == pytest.approx(1.95)  # beyond 2 it would be unstable


def test_gains_multiply():
    off = Uncertainty(Relative(0.1, 0.2), Relative(0.2, 0.3, 0.1), Relative(-0.5, 0.1))
    factor, besides = without_gain(off)
    assert factor == pytest.approx(1.1 * 1.2 * 0.5)
    assert besides == Uncertainty(Relative(0.0, 0.2), Relative(0.0, 0.3, 0.1), Relative(0.0, 0.1))
