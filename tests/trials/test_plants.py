"""The suite "plants": axes, oscillating plants and dry friction, against motions known otherwise.

Red when a plant moves otherwise than is known of it.
"""

import json

import numpy as np
import pytest
from scipy.signal import lsim

from focgen.fractional.transfer import TransferFunction
from focgen.rig.files import read_rig
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals
from focgen.trials.cases import draw_truth
from focgen.trials.designs import Truth
from focgen.trials.forms import Spans
from focgen.trials.forms_plants import FRICTION
from focgen.trials.machine import Machine, Setting, simulate
from focgen.trials.make import make
from focgen.trials.plants import AXIS, FIRST, MODE, SECOND, draw_kind, draw_plant, effects_on, forms_on
from focgen.trials.plants_cases import _set_up
from focgen.trials.plants_moves import moves, unseen_moves
from focgen.trials.severity import Trial, surviving
from focgen.trials.vocabulary import OUTSIDE, VOCABULARY

H = 0.0025
SIGNALS = Signals("t", "y", command="u")
F = 0.3


def motion(den, command, *parameters, gain=1.0, bias=0.0, form="dry_block"):
    """Curvature (n,) of gain/den behind a command, under friction."""
    plant = LinearActuator(TransferFunction([(gain, 0.0)], den), bias=bias)
    machine = Machine(Rig("x", 0.02, SIGNALS, plant), (Setting(form, tuple(parameters)),))
    return simulate(machine, [command], [0.0], H)[0].curvature


def test_friction_stops_a_mass_on_a_spring_by_twice_its_play_each_half_turn():
    """Let go at x0 = 1/2: each half turn ends 2 F/k nearer, and the last within F/k, where it stays."""
    u = np.r_[np.full(8000, 0.5), np.zeros(12000)]  # pushed out slowly enough to have come to rest
    y = motion([(1.0, 2.0), (0.2, 1.0), (16.0, 0.0)], u * 16.0, F)
    start = y[8000]
    assert start == pytest.approx(0.5, abs=F / 16.0 + 1e-3)
    steps = np.diff(y[8000:])
    going = np.flatnonzero(steps)
    turns = going[np.flatnonzero(np.diff(np.sign(steps[going]))) + 1]
    decay = np.exp(-0.1 * np.pi / np.sqrt(16.0 - 0.01))  # of a half turn, about the place friction shifts
    expected, side, ends = start, 1.0, []
    while abs(expected) > F / 16.0:
        expected = -decay * (expected - side * F / 16.0) + side * F / 16.0
        side = -side
        ends.append(expected)
    found = [*y[8000 + turns], y[-1]]
    assert len(ends) > 5 and found == pytest.approx(ends, abs=2e-3)
    assert np.ptp(y[-4000:]) == 0.0


def test_a_pushed_axis_glides_at_what_is_left_of_its_force_and_stops_in_time():
    """m v' + c v = u + zero − F: exact exponentials up to where it stops, then nothing moves."""
    m, c, zero = 0.5, 1.0, 0.1
    u = np.r_[np.full(2000, 1.0), np.zeros(4000)]
    y = motion([(m, 2.0), (c, 1.0)], u, F, bias=zero)
    t = H * np.arange(2001)
    speed = (1.0 + zero - F) / c * (1.0 - np.exp(-t * c / m))
    assert np.diff(y[:2000]) / H == pytest.approx(0.5 * (speed[1:] + speed[:-1])[:1999], abs=4e-3)
    slow, fall = speed[-1], (F - zero) / c
    stop = m / c * np.log(1.0 + slow / fall)
    at = 2000 + round(stop / H)
    assert y[at] - y[2000] == pytest.approx(m / c * slow - fall * stop, abs=4e-3)
    assert np.ptp(y[at + 8 :]) == 0.0 and np.all(np.diff(y[2000 : at - 8]) > 0)


@pytest.mark.parametrize("alpha", [None, 1.0 - 1e-9, 0.6])
def test_friction_on_a_lag_is_a_play_where_motion_is_slow(alpha):
    """Up and down a slow ramp the output lies F below and above the drive, first order or fractional."""
    rise = np.linspace(0.0, 1.0, 16000)
    u, T = np.r_[rise, rise[::-1]], 0.02
    if alpha is None:
        y = motion([(T, 1.0), (1.0, 0.0)], u, F)
    else:
        rig = Rig("x", 0.02, SIGNALS, Actuator(T, alpha, (1.0,)))
        y = simulate(Machine(rig, (Setting("dry_block", (F,)),)), [u], [0.0], H)[0].curvature
    play, now = np.zeros(len(u)), 0.0
    for k, x in enumerate(u):
        now = min(max(now, x - F), x + F)
        play[k] = now
    assert np.abs(y - play).max() < 6e-3


def test_breaking_away_takes_more_than_gliding_on():
    m, c, more = 0.2, 1.0, 0.2
    rise = np.linspace(0.0, 1.0, 8000)
    y = motion([(m, 2.0), (c, 1.0)], rise, F, more, 0.02, form="stribeck_block")
    moved = np.flatnonzero(np.diff(y) > 0)[0]
    assert rise[moved] == pytest.approx(F + more, abs=2e-3)
    later = np.diff(y)[-1] / H
    assert later == pytest.approx((1.0 - F) / c, abs=0.06)  # what is above par[0] alone, less the lag


@pytest.mark.parametrize("kind", [AXIS, MODE, FIRST, SECOND])
def test_plants_move_as_their_transfer_function_says(kind):
    rig, full = draw_plant(np.random.default_rng(4), kind, "A", 0.02)
    actuator = rig.actuator
    bare = Rig("x", 0.02, SIGNALS, actuator)
    u = full * np.repeat([0.0, 1.0, -0.5 if kind == AXIS else 0.5], 800)
    y = simulate(Machine(bare), [u], [0.0], H)[0].curvature
    order = int(max(t.order for t in actuator.dynamics.den))
    den = np.zeros(order + 1)
    for term in actuator.dynamics.den:
        den[order - int(term.order)] = term.coefficient
    late = np.r_[u[0], u[:-1]] + actuator.bias  # the command acts one step late
    _, exact, _ = lsim(([actuator.dynamics.num[0].coefficient], den), late, H * np.arange(len(u)))
    assert np.abs(y - exact).max() < 5e-4 * np.ptp(exact)


def test_an_axis_comes_back_and_stays_within_its_reach():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        for made in (*moves(rng, 0.02), *unseen_moves(rng, 0.02)):
            assert np.abs(made.levels).max() <= 1.1 and np.abs(np.cumsum(made.levels)).max() * 0.02 < 3.5, (
                made.name
            )


def test_the_zero_of_a_drive_is_a_number_of_the_rig_and_no_effect():
    """What another zero changes survives no refit; what friction changes does."""
    plant = LinearActuator(TransferFunction([(1.0, 0.0)], [(0.4, 2.0), (1.0, 1.0)]))
    rig, other = (Rig("x", 0.02, SIGNALS, LinearActuator(plant.dynamics, bias=b)) for b in (0.0, 0.05))
    rng = np.random.default_rng(1)
    commands = [np.repeat(e.levels, 2) for e in moves(rng, 0.02)]
    trial = Trial(commands, list(np.arange(len(commands)) * 40.0), 0.01)
    base, shifted = (trial.signals(r)["output"] for r in (rig, other))
    rubbed = trial.signals(rig, [Setting("dry_block", (0.05,))])["output"]
    left = [
        surviving(rig, trial, {"output": y - base}, {"output": 0.01})["output"] for y in (shifted, rubbed)
    ]
    assert left[0] < 1e-6 and left[1] > 1.0


def test_plants_have_the_effects_that_mean_something_there():
    named = {*VOCABULARY, *OUTSIDE, "friction"}
    for kind in (AXIS, MODE, FIRST, SECOND):
        assert set(effects_on(kind)) <= named and "friction" in effects_on(kind)
        assert all(forms_on(kind, effect) for effect in effects_on(kind))
    assert "resonance" not in effects_on(MODE) and "supply_saturation" not in effects_on(AXIS)
    kinds = [draw_kind(("resonance",), np.random.default_rng(seed)) for seed in range(30)]
    assert set(kinds) <= {FIRST, SECOND}
    spans = Spans(1.0, 1.0, 1.0, 2.0, 2.0, 1.0, 100.0)
    for form in FRICTION:
        force = form.draw(np.random.default_rng(0), spans)
        assert force(0.2)[0] == pytest.approx(0.2) and all(p > 0.0 for p in force(0.2))


@pytest.mark.parametrize("kind", [MODE, pytest.param(FIRST, marks=pytest.mark.long), SECOND])
def test_every_form_can_be_weak_on_every_plant(kind):
    """A share of a pressure is no share of a curvature: one such form departed by seven spans."""
    rng = np.random.default_rng(8)
    stage = _set_up(kind, "C", rng)
    for effect in ("creep", "resonance", "softening", "gain_nonlinearity", "hysteresis", "dead_zone"):
        for form in forms_on(kind, effect):
            _, facts = draw_truth(Truth(effect, form.name, 0.03), stage, rng)
            assert facts["gap"] < 0.035, form.name


def test_cases_are_made_and_the_same_again(tmp_path):
    for name in ("one", "again"):
        make(tmp_path / name, cases=2, seed=3, signals="A", suite="plants", kinds=("none", "parameters"))
    one, again = (
        {p.relative_to(tmp_path / n): p.read_bytes() for p in (tmp_path / n).rglob("*.*")}
        for n in ("one", "again")
    )
    assert one == again
    for number in ("0001", "0002"):
        label = json.loads((tmp_path / "one" / "sealed" / number / "label.json").read_text())["label"]
        rig = read_rig(tmp_path / "one" / "cases" / number / "rig.toml")
        assert rig.actuator.integrates == (label["plant"] == AXIS) and label["suite"] == "plants"
