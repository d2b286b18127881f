"""Every form of every effect does what the effect's name says, by checks that know nothing of its formula.

Red when a form does something else than its effect's name says.
"""

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.forms import Drawn, Spans
from focgen.trials.machine import Machine, Session
from focgen.trials.severity import Trial, calibrate
from focgen.trials.vocabulary import OUTSIDE, VOCABULARY

H = 0.005
FULL = 2.0
RIG = Rig(
    "bench",
    0.02,
    Signals("t", "y", command="u", pressure="p", curvature="z"),
    Actuator(0.5, 0.8, (0.2, 0.3)),
    TransferFunction([(0.1 * 900.0, 0.0)], [(1.0, 2.0), (54.0, 1.0), (900.0, 0.0)]),
    TransferFunction([(12.0, 0.0)], [(1.0, 1.0), (12.0, 0.0)]),
)
TOP = 0.1 * FULL
DRIVE = float(RIG.actuator.drive(TOP))
SPANS = Spans(FULL, TOP, DRIVE, DRIVE, DRIVE, 1.013, 600.0)
ALL = [(effect, form) for effect, (_, forms) in VOCABULARY.items() for form in forms]


def hold(level, seconds):
    return np.full(round(seconds / H), level * FULL)


def ramp(start, stop, seconds):
    return np.linspace(start, stop, round(seconds / H)) * FULL


def triangle(period, cycles=2, low=0.0, high=1.0):
    rise = ramp(low, high, period / 2)
    return np.concatenate([np.concatenate([rise, rise[::-1]])] * cycles)


LEVELS = np.concatenate([hold(x, 6.0) for x in (0.3, 0.0, 0.6, 0.0, 1.0, 0.6, 0.3, 0.0)])


def play(settings, *commands, clock=0.0, rest=20.0):
    """Traces of the commands as one session."""
    session, traces = Session(Machine(RIG, tuple(settings)), H), []
    for command in commands:
        traces.append(session.run(command, clock))
        clock += len(command) * H + rest
    return traces


def setting_of(effect, form, target=0.08, seed=3):
    """The form at mid severity on steps and slow ramps."""
    rng = np.random.default_rng([seed, len(form.name)])
    drawn = Drawn(
        effect, VOCABULARY[effect][0], form, form.draw(rng, SPANS), form.memory(rng) if form.memory else None
    )
    trial = Trial([LEVELS, triangle(20.0)], [0.0, 200.0], H)
    setting, gap = calibrate(drawn, RIG, trial, target)
    assert 0.0 < gap <= 1.35 * target  # a stiction's gap jumps with its band
    return setting


def settled(trace_signal, at):
    return trace_signal[round(at / H) - 1]


def rise_time(signal, share=0.63):
    """Seconds until ``share`` of the final value is passed for good."""
    return (np.flatnonzero(signal < share * signal[-1]).max() + 1) * H


def loop_area(x, y):
    """Enclosed area of the last half, by the shoelace formula."""
    x, y = x[len(x) // 2 :], y[len(y) // 2 :]
    return abs(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


# ---- one check an effect: (setting) -> None ----


def transport_delay(s):
    wave = hold(0.5, 2.0), FULL * (0.5 + 0.4 * np.sin(2 * np.pi * 0.2 * np.arange(6000) * H))
    with_, without = (play(e, np.concatenate(wave))[0].pressure for e in ([s], []))
    lags = np.arange(0, 200)
    best = lags[
        np.argmax([np.corrcoef(with_[2000:], without[2000 - lag : -lag or None])[0, 1] for lag in lags])
    ]
    assert best * H == pytest.approx(s.parameters[0], abs=2 * H)
    ratio = np.std(with_[2000:]) / np.std(without[2000:])
    assert ratio == pytest.approx(1.0, abs=2e-3)  # a delay takes nothing from the amplitude


def slow_regulator(s):
    up = play([s], hold(1.0, 10.0))[0].pressure
    half = play([s], hold(0.5, 10.0))[0].pressure
    assert np.allclose(up, 2 * half, atol=1e-9)  # linear
    both = play([s], np.concatenate([hold(1.0, 10.0), hold(0.0, 10.0)]))[0].pressure
    assert np.allclose(TOP - both[2000:], up[: len(both) - 2000], atol=2e-4)  # down as up
    assert rise_time(up) > 1.5 * rise_time(play([], hold(1.0, 10.0))[0].pressure)


def valve_asymmetry(s):
    both = play([s], np.concatenate([hold(1.0, 15.0), hold(0.0, 15.0)]))[0].pressure
    up, down = rise_time(both[:3000], 0.9), rise_time(TOP - both[3000:], 0.9)
    assert max(up, down) > 1.5 * min(up, down)


def valve_stiction(s):
    band = s.parameters[0] / FULL
    small = np.concatenate([hold(0.5, 3.0), hold(0.5 - 0.4 * band, 3.0), hold(0.5, 3.0)])
    stuck, free = (play(e, small)[0].pressure for e in ([s], []))
    moved = np.ptp(stuck[700:])
    assert moved < 0.1 * np.ptp(free[700:])  # a small reversal does nothing
    large = play([s], np.concatenate([hold(0.5, 3.0), hold(0.5 - 2 * band, 3.0)]))[0].pressure
    assert np.ptp(large[590:]) > 0.5 * band * TOP


def flow_limit(s):
    trace = play([s], np.concatenate([hold(1.0, 20.0), hold(0.0, 20.0)]))[0].pressure
    free = play([], np.concatenate([hold(1.0, 20.0), hold(0.0, 20.0)]))[0].pressure
    rate, nominal = np.diff(trace) / H, np.diff(free) / H
    assert rate.max() < 0.5 * nominal.max() and rate.min() > 0.5 * nominal.min()
    assert rate.max() == pytest.approx(-rate.min(), rel=0.25)
    small = play([s], hold(0.02, 10.0))[0].pressure  # small moves are hardly touched
    assert rise_time(small) < 0.4 * rise_time(trace[:4000])


def supply_saturation(s):
    ceiling = s.parameters[0]
    with_, free = (
        play(e, np.concatenate([triangle(60.0, 1), hold(1.0, 20.0)]))[0].pressure for e in ([s], [])
    )
    assert with_.max() < ceiling + 1e-9 < 0.99 * TOP
    low = free < 0.5 * ceiling
    assert np.allclose(with_[low], free[low], atol=0.003 * TOP)


def leak(s):
    levels = [settled(play([s], hold(x, 10.0))[0].pressure, 10.0) for x in (0.25, 0.5, 1.0)]
    lost = np.array([0.25, 0.5, 1.0]) * TOP - levels
    assert np.all(lost > 0) and np.all(np.diff(lost) > 0)


def hysteresis(s):
    areas = [
        [loop_area(t.pressure, t.curvature) for t in play(e, triangle(40.0), triangle(640.0))]
        for e in ([s], [])
    ]
    (fast, slow), (fast_free, slow_free) = areas
    assert slow_free < 0.25 * fast_free  # the viscous loop closes
    assert slow > 0.8 * (fast - fast_free) and slow > 4 * slow_free  # the other stays
    ends = play([s], np.concatenate([triangle(100.0, 1), triangle(20.0, 1, 0.0, 0.4)]))[0]
    assert np.ptp(ends.curvature) > 0


def creep(s):
    with_, free = (play(e, hold(0.8, 120.0))[0].curvature for e in ([s], []))
    later = settled(with_, 120.0) - settled(with_, 20.0)
    assert later > 1.5 * (settled(free, 120.0) - settled(free, 20.0))


def unloading_asymmetry(s):
    both = np.concatenate([hold(1.0, 40.0), hold(0.0, 40.0)])
    with_, free = (play(e, both)[0].curvature for e in ([s], []))
    assert np.allclose(with_[:8000], free[:8000], atol=0.06 * DRIVE)
    half = [np.flatnonzero(z[8000:] < 0.5 * z[7999])[0] * H for z in (with_, free)]
    assert half[0] > 1.3 * half[1]


def softening(s):
    cycle = triangle(20.0, 1)
    first, second, third = (
        t.curvature for t in play([s], cycle, cycle, cycle)
    )  # rests between: it outlives them
    gained = np.abs(second - first).max(), np.abs(third - second).max()
    assert gained[0] > 0.01 * DRIVE and gained[1] < 0.95 * gained[0]
    small_before, _, small_after = (
        t.curvature for t in play([s], triangle(20.0, 1, 0, 0.4), cycle, triangle(20.0, 1, 0, 0.4))
    )
    assert small_after.max() > small_before.max() + 0.005 * DRIVE


def static_curve(s, signal):
    """The signal settled at seven levels, reached from below and from above."""
    levels = np.linspace(0.1, 1.0, 7)
    up = [settled(getattr(play([s] if s else [], hold(x, 40.0))[0], signal), 40.0) for x in levels]
    down = [
        settled(
            getattr(play([s] if s else [], np.concatenate([hold(1.0, 3.0), hold(x, 80.0)]))[0], signal), 83.0
        )
        for x in levels
    ]
    return levels, np.array(up), np.array(down)


def gain_nonlinearity(s):
    levels, up, down = static_curve(s, "curvature")
    _, free, free_down = static_curve(None, "curvature")
    assert np.allclose(up - down, free - free_down, atol=0.03 * DRIVE)  # no memory of its own
    bent = up / free
    assert np.ptp(bent) > 0.02
    _, line = levels, np.polynomial.Polynomial.fit(levels * TOP, up / (levels * TOP), 1)
    assert np.abs(up / (levels * TOP) - line(levels * TOP)).max() > 0.005 * DRIVE / TOP


def dead_zone(s):
    threshold = s.parameters[0]
    drive = RIG.actuator.drive(np.linspace(0, TOP, 400))
    level = np.linspace(0, 1, 400)[np.searchsorted(drive, 0.5 * threshold)]
    free = settled(play([], hold(level, 20.0))[0].curvature, 20.0)
    assert settled(play([s], hold(level, 20.0))[0].curvature, 20.0) < 0.15 * free
    assert settled(play([s], hold(1.0, 20.0))[0].curvature, 20.0) > 0.4 * DRIVE


def contact(s):
    knee = s.parameters[1]
    with_, free = (play(e, triangle(200.0, 1))[0].curvature for e in ([s], []))
    below = free < 0.95 * knee
    rising = np.arange(len(free)) < len(free) // 2
    assert np.allclose(with_[below & rising], free[below & rising], atol=1e-9)
    slopes = [np.gradient(z)[round(95.0 / H)] for z in (with_, free)]
    assert slopes[0] < 0.9 * slopes[1]


def resonance(s):
    with_, free = (play(e, hold(0.8, 8.0))[0].curvature for e in ([s], []))
    rest = (with_ - free)[60:]
    crossings = np.flatnonzero(np.diff(np.sign(rest)))
    assert len(crossings) >= 6
    period = 2 * np.median(np.diff(crossings)) * H
    assert 2 * np.pi / period == pytest.approx(s.parameters[1], rel=0.25)
    early, late = np.abs(rest[:400]).max(), np.abs(rest[-400:]).max()
    assert late < 0.8 * early


def gain_drift(s):
    early, late = (play([s], LEVELS, clock=c)[0].curvature for c in (0.0, 500.0))
    free = play([], LEVELS)[0].curvature
    high = free > 0.3 * DRIVE
    ratio = late[high] / early[high]
    assert abs(np.median(ratio) - 1) > 0.02
    assert np.ptp(late[high] / free[high]) < 0.05  # one gain at every level


def sensor_nonlinearity(s):
    trace = play([s], triangle(400.0, 1))[0]
    half = len(trace.output) // 2
    grid = np.linspace(0.2, 0.9, 8) * trace.curvature.max()
    up = np.interp(grid, trace.curvature[:half], trace.output[:half])
    down = np.interp(grid, trace.curvature[half:][::-1], trace.output[half:][::-1])
    assert np.allclose(up, down, atol=0.01 * DRIVE)
    assert np.abs(up - grid).max() > 0.03 * DRIVE


def sensor_hysteresis(s):
    fast, slow = (loop_area(t.curvature, t.output) for t in play([s], triangle(40.0), triangle(320.0)))
    free = loop_area(*(lambda t: (t.curvature, t.output))(play([], triangle(320.0))[0]))
    assert slow > 0.6 * fast and slow > 5 * free


def sensor_relaxation(s):
    trace, free = (play(e, np.concatenate([hold(0.9, 120.0)]))[0] for e in ([s], []))
    over = trace.output - free.output
    peak = over.max()
    assert peak > 0.01 * DRIVE and settled(over, 120.0) < 0.25 * peak
    assert np.allclose(trace.curvature, free.curvature)


def sensor_lag(s):
    with_, free = (play(e, hold(1.0, 60.0))[0] for e in ([s], []))
    assert rise_time(with_.output, 0.5) > rise_time(free.output, 0.5) + 0.05
    assert settled(with_.output, 60.0) == pytest.approx(settled(free.output, 60.0), rel=5e-3)
    half = play([s], hold(0.0, 1.0), hold(1.0, 60.0))[1].output
    assert np.allclose(half, with_.output, atol=1e-9)  # nothing outlives a rest


def sensor_drift(s):
    traces = [play([s], hold(x, 20.0), clock=400.0)[0] for x in (0.0, 0.8)]
    free = [play([], hold(x, 20.0))[0] for x in (0.0, 0.8)]
    shifts = [settled(a.output - b.output, 20.0) for a, b in zip(traces, free)]
    assert abs(shifts[0]) > 0.01 * DRIVE and shifts[0] == pytest.approx(
        shifts[1], rel=1e-6
    )  # an offset, not a gain
    start = play([s], hold(0.0, 2.0), clock=0.0)[0].output
    assert np.abs(start).max() < 0.05 * abs(shifts[0]) + 0.01 * DRIVE


def sensor_quantization(s):
    session = Session(Machine(RIG, (s,)), H)
    output = session.run(triangle(60.0), 0.0).output
    read = session.read(output)
    steps = np.diff(np.unique(np.round(read, 9)))
    assert len(np.unique(np.round(read, 9))) < 0.02 * len(read)
    assert steps.min() > 0.5 * s.parameters[0] and np.abs(read - output).max() < 0.8 * s.parameters[0]


def sensor_saturation(s):
    with_, free = (play(e, triangle(100.0, 1))[0].output for e in ([s], []))
    limit = s.parameters[0]
    assert with_.max() <= limit * 1.0001 < 0.98 * free.max()
    low = free < 0.8 * limit
    assert np.allclose(with_[low], free[low], atol=0.02 * DRIVE)


@pytest.mark.parametrize("effect, form", ALL, ids=lambda x: getattr(x, "name", x))
def test_form_does_what_the_name_says(effect, form):
    globals()[effect](setting_of(effect, form))


@pytest.mark.parametrize(
    "effect, form",
    [pytest.param(*one, marks=pytest.mark.long if turn % 2 else ()) for turn, one in enumerate(ALL)],
    ids=lambda x: getattr(x, "name", x),
)
def test_stages_before_the_effect_do_not_feel_it(effect, form):
    stage = VOCABULARY[effect][0]
    with_, free = (play(e, LEVELS)[0] for e in ([setting_of(effect, form)], []))
    before = {"regulator": (), "actuator": ("pressure",), "sensor": ("pressure", "curvature")}[stage]
    for signal in before:
        assert np.array_equal(getattr(with_, signal), getattr(free, signal))


def test_every_effect_has_two_forms():
    assert len(VOCABULARY) == 23 and all(len(forms) >= 2 for _, forms in VOCABULARY.values())


@pytest.mark.parametrize("target", [0.03, 0.08])
@pytest.mark.parametrize(
    "effect, form", [("hysteresis", 0), ("leak", 1), ("sensor_lag", 0), ("sensor_drift", 1)]
)
def test_severity_is_the_gap(effect, form, target):
    stage, forms = VOCABULARY[effect]
    setting = setting_of(effect, forms[form], target)
    traces = [play(e, LEVELS, triangle(20.0), rest=200.0 - len(LEVELS) * H) for e in ([setting], [])]
    name = {"regulator": "pressure", "actuator": "curvature", "sensor": "output"}[stage]
    with_, free = (np.concatenate([getattr(t, name) for t in pair]) for pair in traces)
    assert np.sqrt(np.mean((with_ - free) ** 2)) / np.ptp(free) == pytest.approx(target, rel=0.05)


@pytest.mark.parametrize("name", OUTSIDE)
def test_outside_effects_stay_finite_and_start_at_rest(name):
    stage, (form,) = OUTSIDE[name]
    drawn = Drawn(name, stage, form, form.draw(np.random.default_rng(1), SPANS), None)
    wave = np.tile(LEVELS, 4)
    trace = play([drawn.at(np.sqrt(form.low * form.high))], wave)[0]
    assert np.all(np.isfinite(trace.output)) and abs(trace.output[0]) < 1e-12
    assert np.abs(trace.output - play([], wave)[0].output).max() > 1e-3 * DRIVE
