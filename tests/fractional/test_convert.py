"""To and from scipy.signal and python-control.

Red when a conversion there and back changes a response.
"""

import sys

import control
import numpy as np
import pytest
from scipy import signal

from focgen.errors import MissingExtra
from focgen.fractional.convert import from_control, from_scipy, to_control, to_scipy
from focgen.fractional.transfer import TransferFunction

WHOLE = TransferFunction([(2, 1), (0.5, 0)], [(1, 3), (53.39, 1), (1528, 0)])
FRACTIONAL = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)])
OMEGA = np.geomspace(0.01, 100, 9)


def test_there_and_back():
    assert from_control(to_control(WHOLE)) == WHOLE
    assert from_scipy(to_scipy(WHOLE)) == WHOLE
    scaled = WHOLE * TransferFunction([(1, 0)], [(4, 0)])
    assert from_control(to_control(scaled)) == scaled


def test_they_respond_alike():
    truth = WHOLE.frequency_response(OMEGA)
    assert signal.freqresp(to_scipy(WHOLE), OMEGA)[1] == pytest.approx(truth, rel=1e-12)
    assert to_control(WHOLE)(1j * OMEGA) == pytest.approx(truth, rel=1e-12)


@pytest.mark.parametrize("transfer", [TransferFunction([(3, 0)], [(1, 1)]), TransferFunction([(3, -1)])])
def test_an_integrator_however_written(transfer):
    assert to_control(transfer)(2j) == pytest.approx(3 / 2j)
    assert from_scipy(to_scipy(transfer)) == TransferFunction([(3, 0)], [(1, 1)])


def test_no_power_of_s_is_cancelled_on_the_way():
    made = to_control(TransferFunction([(2, 1)], [(1, 3), (4, 1)]))
    assert made.num[0][0].tolist() == [2.0, 0.0] and made.den[0][0].tolist() == [1.0, 0.0, 4.0, 0.0]


def test_zero_and_constants():
    assert from_scipy(to_scipy(TransferFunction([(2.5, 0)]))) == TransferFunction([(2.5, 0)])
    assert from_control(to_control(TransferFunction([]))).num == ()


@pytest.mark.parametrize("form", ["to_tf", "to_zpk", "to_ss"])
def test_every_form_of_scipy(form):
    system = getattr(signal.lti([1.0, 2.0], [1.0, 3.0, 4.0]), form)()
    truth = TransferFunction([(1, 1), (2, 0)], [(1, 2), (3, 1), (4, 0)]).frequency_response(OMEGA)
    assert from_scipy(system).frequency_response(OMEGA) == pytest.approx(truth, rel=1e-12)


def test_state_space_of_control():
    system = control.ss([[-2.0]], [[1.0]], [[3.0]], [[0.5]])
    assert from_control(system)(1j) == pytest.approx(3 / (1j + 2) + 0.5)


@pytest.mark.parametrize("convert", [to_scipy, to_control])
def test_the_fractional_order_is_named(convert):
    with pytest.raises(ValueError, match="order 0.6 is not a whole number"):
        convert(FRACTIONAL)


def test_what_is_not_one_continuous_channel_is_refused():
    two = [[1.0], [2.0]]
    with pytest.raises(ValueError, match="discrete"):
        from_scipy(signal.dlti([1.0], [1.0, 0.5]))
    with pytest.raises(ValueError, match="discrete"):
        from_control(control.tf([1.0], [1.0, 0.5], 0.1))
    with pytest.raises(ValueError, match="2 outputs"):
        from_scipy(signal.lti([[-1.0]], [[1.0]], two, [[0.0], [0.0]]))
    with pytest.raises(ValueError, match="2 outputs"):
        from_control(control.ss([[-1.0]], [[1.0]], two, [[0.0], [0.0]]))


def test_without_python_control(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(MissingExtra, match=r"pip install 'focgen\[control\]'"):
        to_control(WHOLE)


DELAY = 0.3


def test_a_fractional_response_is_exact_in_python_control():
    data = FRACTIONAL.to_frd(OMEGA, delay=DELAY)
    truth = np.exp(-1j * OMEGA * DELAY) / (1.32 * (1j * OMEGA) ** 0.6 + 1.0)
    assert isinstance(data, control.FrequencyResponseData) and np.array_equal(data.omega, OMEGA)
    assert np.ravel(data.complex) == pytest.approx(truth, rel=1e-14)
    series = data * to_control(WHOLE)
    assert np.ravel(series.complex) == pytest.approx(truth * WHOLE.frequency_response(OMEGA), rel=1e-12)


def test_where_no_frequencies_are_given_they_surround_the_corners():
    data = FRACTIONAL.to_frd()
    corner = (1.0 / 1.32) ** (1.0 / 0.6)
    assert data.omega[[0, -1]] == pytest.approx([corner / 100.0, corner * 100.0])
    gain = np.abs(np.ravel(data.complex))
    assert gain[0] > 0.9 and gain[-1] < 0.1
    assert len(TransferFunction([(3, 0)]).to_frd().omega) == len(data.omega)


def test_bode_and_nyquist_draw_the_exact_response():
    import matplotlib

    matplotlib.use("Agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.close("all")  # python-control draws into the figure that is there
    truth = FRACTIONAL.frequency_response(OMEGA) * np.exp(-1j * OMEGA * DELAY)
    drawn = FRACTIONAL.bode(OMEGA, DELAY, dB=False, deg=True, Hz=False)
    gain, phase = drawn.axes[0, 0].lines[0], drawn.axes[1, 0].lines[0]
    assert np.allclose(gain.get_ydata(), np.abs(truth), rtol=1e-12)
    assert np.allclose(np.exp(1j * np.radians(phase.get_ydata())), truth / np.abs(truth), atol=1e-9)
    curve = FRACTIONAL.nyquist(OMEGA, DELAY)
    points = [line.get_xydata() @ (1.0, 1.0j) for line in curve.axes[0, 0].lines]
    assert all(min(np.abs(p - z).min() for p in points if len(p)) < 1e-9 for z in truth)
    pyplot.close("all")


@pytest.mark.parametrize(
    "omega", [[], [1.0, np.inf], [0.0, 1.0], [2.0, 1.0], [1.0, np.nan], [[1.0, 2.0]], [-1.0, 1.0]], ids=str
)
def test_frequencies_that_cannot_be_used_are_refused(omega):
    with pytest.raises(ValueError, match="rising numbers above 0 rad/s"):
        FRACTIONAL.to_frd(omega)
    with pytest.raises(ValueError, match="delay is -1"):
        FRACTIONAL.to_frd(OMEGA, delay=-1)


def test_what_has_no_coefficients_is_refused():
    with pytest.raises(ValueError, match="FrequencyResponseData has no coefficients"):
        from_control(FRACTIONAL.to_frd(OMEGA))
    with pytest.raises(ValueError, match="list is no system of scipy.signal"):
        from_scipy([1.0, 2.0])
    for transfer in (FRACTIONAL, FRACTIONAL * WHOLE):
        with pytest.raises(ValueError, match=r"its frequency response is to_frd"):
            to_control(transfer)


def test_several_channels_are_refused_either_way():
    two_in = control.ss([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]])
    with pytest.raises(ValueError, match="2 inputs and 1 outputs"):
        from_control(two_in)
    with pytest.raises(ValueError, match="2 inputs and 1 outputs"):
        from_scipy(signal.StateSpace([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]))
