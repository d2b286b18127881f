"""The parts of a diagnosis, each against what is known of it.

Red when a step of the diagnosis departs from its closed form, or from what was simulated.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.fitting.predictability import even_share, predictable_share, predicted
from focgen.diagnosis.hypotheses.disturbance import Disturbance, disturbance
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.hypotheses.rivals import Cause
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.excitation import excitation
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.scales import references
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.problem.smooth import freed, strays
from focgen.diagnosis.verdict import unexplained
from focgen.diagnosis.verdict.conclude import _beside
from focgen.diagnosis.verdict.improvement import predict
from focgen.fractional.transfer import TransferFunction
from focgen.rig import kernels
from focgen.rig.effects import library
from tests.diagnosis_rig import RIG, H, _noise, session

_STEADY = Disturbance(kurtosis=3.0, loudest=1.5, slow=1.0, line=0.03)


def actuator(**case):
    """The actuator's problem of a session."""
    logs = session(4, **case)
    return problem_of(RIG, make(logs, "pressure", "curvature"), logs)


def test_a_tone_in_the_noise_is_heard_and_noise_is_none():
    rng = np.random.default_rng(0)
    noise = [_noise(rng, 1500) for _ in range(4)]
    tone = [p + 1.2 * np.sin(2 * np.pi * 3.1 * H * np.arange(len(p)) + i) for i, p in enumerate(noise)]
    assert not disturbance(noise, H, 1.0).tonal and disturbance(tone, H, 1.0).tonal


@pytest.mark.parametrize("pole, response", [(0.9, 1.0), (0.97, 2.0), (0.97, 5.0), (0.99, 5.0)])
def test_noise_of_a_colour_is_no_tone(pole, response):
    """Most of its power is in few lines, and these stand no higher than those beside them."""
    heard = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noise = [lfilter([1.0], [1.0, -pole], rng.normal(size=n)) for n in (1760, 1200, 1080, 2040, 960)]
        heard.append(disturbance(noise, H, response).tonal)
    assert sum(heard) <= 2


def test_a_tone_as_slow_as_the_rig_is_heard_however_fast_the_samples():
    rng, h = np.random.default_rng(0), H / 10
    noise = [_noise(rng, 6000) for _ in range(4)]
    tone = [p + 1.5 * np.sin(2 * np.pi * 0.4 * h * np.arange(len(p)) + i) for i, p in enumerate(noise)]
    assert not disturbance(noise, h, 1.0).tonal and disturbance(tone, h, 1.0).tonal


def test_a_tone_that_goes_with_the_load_is_heard():
    """A pump's ripple has no line in the whole of an experiment. It passed for noise, at nine times that."""
    rng, t = np.random.default_rng(0), np.arange(4000) * H
    noise = [_noise(rng, 4000) for _ in range(3)]
    turns = np.cumsum(2.0 + 0.7 * np.sin(0.1 * t)) * H
    ripple = [p + 1.5 * np.sin(2 * np.pi * (turns + 0.3 * i)) for i, p in enumerate(noise)]
    assert not disturbance(noise, H, 1.0).tonal
    heard = disturbance(ripple, H, 1.0)
    assert heard.tonal and heard.line < 0.5 * heard.astray


def test_ringing_is_predictable_and_noise_is_not():
    logs, rng = session(3), np.random.default_rng(5)
    segment = make(logs, "command", "output")
    noise = rng.standard_normal(len(segment.y))
    clock, rung = H * np.arange(400), np.zeros(len(segment.y))
    for first, last in segment.run.spans:
        steps = np.diff(segment.x[first:last], prepend=0.0) * (np.arange(last - first) > 0)
        rung[first:last] = np.convolve(steps, np.exp(-0.7 * clock) * np.sin(7.0 * clock))[: last - first]
    rung *= 0.5 / np.sqrt(np.mean(rung**2))
    assert predictable_share(segment, noise, 2.0) < 0.01
    assert predictable_share(segment, noise + rung, 2.0) > 0.6 * 0.2


def test_a_few_large_moves_do_not_hide_what_inputs_predict_of_the_rest():
    """Three dips that no regression foretells make most of the mean square, and none of the session."""
    segment = actuator().segment
    rng, count = np.random.default_rng(5), len(segment.y)
    noise, t = 0.01 * rng.normal(size=count), np.arange(count)
    dips = sum(s * np.exp(-(((t - p) / 25.0) ** 2)) for p, s in ((400, 1.0), (2100, -0.8), (4300, 1.2)))
    rest = 0.01 * np.tanh(3.0 * (segment.asked - 0.5))
    assert predictable_share(segment, rest + dips + noise, 1.0) < NUMBERS.chance
    assert even_share(segment, rest + dips + noise, 1.0) > 10.0 * NUMBERS.chance
    assert even_share(segment, noise, 1.0) < NUMBERS.chance


@pytest.mark.parametrize("size", [0.0, 0.3, 1.0])
def test_what_inputs_predict_of_a_residual_is_given_without_its_noise(size):
    """What a level has bent, as far as it holds elsewhere; of noise alone nothing."""
    segment = make(session(3), "command", "output")
    bent = size * segment.asked * (1.0 - segment.asked)
    left = bent + np.random.default_rng(5).standard_normal(len(bent))
    share = predictable_share(segment, left, 2.0)
    made = predicted(segment, left, 2.0, share)
    assert np.mean((made - bent) ** 2) <= min(30.0 / len(bent), np.mean(bent**2))
    assert share > 0.0 or not np.any(made)


def test_a_slow_swing_is_seen():
    rng = np.random.default_rng(1)
    noise = [_noise(rng, 3000) for _ in range(4)]
    swing = [p + 3.0 * np.sin(2 * np.pi * H * np.arange(len(p)) / 60.0) for p in noise]
    assert not disturbance(noise, H, 1.0).low_frequency and disturbance(swing, H, 1.0).low_frequency


@pytest.mark.parametrize("away, sharp", [(2.0, False), (12.0, True), (40.0, True)])
def test_a_reading_that_falls_away_for_moments_is_heard(away, sharp):
    rng = np.random.default_rng(1)
    noise = [_noise(rng, 1500) for _ in range(3)]
    falls = [p - away * (np.isin(np.arange(1500) // 6, rng.choice(250, 8))) for p in noise]
    assert disturbance(falls, H, 1.0).bursts == sharp and not disturbance(noise, H, 1.0).bursts


@pytest.mark.parametrize("size, heard", [(7.0, False), (11.0, True)])
def test_single_readings_far_off_are_heard_though_no_stretch_is_loud(size, heard):
    rng = np.random.default_rng(4)
    spikes = [rng.standard_normal(1500) for _ in range(3)]
    for p in spikes:
        p[90::180] += size
    found = disturbance(spikes, H, 1.0)
    assert found.loudest < 10.0 and found.bursts == heard


@pytest.mark.parametrize(
    "kurtosis, loudest, heard", [(14.0, 5.7, True), (10.0, 5.7, False), (14.0, 4.0, False)]
)
def test_bursts_are_peaked_and_loud(kurtosis, loudest, heard):
    assert replace(_STEADY, kurtosis=kurtosis, loudest=loudest).bursts == heard


def test_innovations_are_those_of_the_formula():
    rng = np.random.default_rng(2)
    y, made, weight = rng.normal(size=(3, 50))
    rest = np.zeros(50, np.uint8)
    rest[[0, 23]] = 1
    ar = np.array([1.0, -0.5, 0.2])
    expected = []
    for part in ((y - made) * weight)[:22].reshape(-1, 2), ((y - made) * weight)[23:49].reshape(-1, 2):
        expected.append(np.convolve(part.mean(axis=1), ar)[: len(part)])
    assert np.allclose(
        kernels.innovations(y, made, weight, rest, 2, ar), np.concatenate(expected), atol=1e-12
    )


def test_products_are_those_of_the_matrix():
    rows = np.random.default_rng(3).normal(size=(5, 700))
    assert np.allclose(kernels.products(rows), rows @ rows.T)


def test_columns_are_out_of_step_by_half_a_sample_to_a_whole_one():
    """More where the rig is slow: half a sample is excluded by no log."""
    logs, slow = session(2), replace(RIG.actuator, T=30.0)
    fast = replace(RIG, actuator=replace(RIG.actuator, T=0.05))
    slack = {
        name: problem_of(rig, make(logs, "command", "output"), logs).slack
        for name, rig in {"slow": replace(RIG, actuator=slow), "fast": fast}.items()
    }
    assert slack == {"slow": 1.0, "fast": 0.5}


def test_thinned_samples_fit_the_same_parameters():
    problem = actuator(T=1.6)
    whole = fit(problem, problem.nominal(), WHITE)
    thin = fit(problem.thinned(3), problem.nominal(), WHITE)
    assert abs(np.exp(whole.vector[0]) - 1.6) < 0.03
    assert np.allclose(thin.vector[:2], whole.vector[:2], atol=0.01)


def test_parameters_far_from_those_given_are_doubted_but_not_without_end():
    own = actuator().nominals
    near, far, absurd = (
        own.start() + np.r_[shift, np.zeros(len(own.start()) - 1)] for shift in (0.1, 0.7, 7.0)
    )
    assert (
        own.prior_penalty(own.start())
        == 0
        < own.prior_penalty(near)
        < 0.5
        < 2
        < own.prior_penalty(far)
        < own.prior_penalty(absurd)
        < 8
    )


def test_a_signal_is_freed_of_its_noise_where_its_model_holds():
    problem, clean = actuator(), actuator(noise=0.0).segment.y
    found = fit(problem, problem.nominal(), WHITE)
    made = found.problem.simulate(found.vector)
    noisy = np.sqrt(np.mean((problem.segment.y - clean) ** 2))
    for left, noise, part in ((0.0, True, 0.5), (0.0, False, 0.9), (0.2, True, 1.0)):
        got = freed(problem.segment, made, np.zeros(len(made)), left, noise)
        assert np.sqrt(np.mean((got - clean) ** 2)) < part * noisy


def test_what_a_freed_signal_may_be_off_by_is_as_large_as_what_stays_in_it():
    """What is smoothed keeps noise of a known size; what is simulated has lost what inputs predict."""
    problem, clean = actuator(), actuator(noise=0.0).segment.y
    segment, none = problem.segment, np.zeros(len(clean))
    for left in (0.2, 0.5):
        unsure = strays(segment, clean, 1.0, left, True)
        off = np.std(freed(segment, clean, none, left, True) - clean)
        assert np.std(unsure.noise) == pytest.approx(np.sqrt(1.0 - left) * off, rel=1e-6)
        assert np.array_equal(unsure.lost, none)
    unsure = strays(segment, clean, 1.0, 0.04, True)
    assert np.array_equal(unsure.noise, none)
    assert np.mean(unsure.lost**2) == pytest.approx(0.04 * np.mean((segment.y - clean) ** 2))
    assert np.mean(np.diff(unsure.lost) ** 2) < 0.2 * np.mean(unsure.lost**2)  # slow


def test_a_hum_is_no_noise_to_be_freed_of():
    problem, t = actuator(noise=0.0), np.arange(len(actuator(noise=0.0).segment.y)) * H
    hum = 0.02 * problem.segment.level_out * np.sin(2.0 * np.pi * t)
    made = problem.segment.y
    humming = replace(problem.segment, y=made + hum)
    kept, lost = (np.std(freed(humming, made, 0.0 * hum, 0.0, noise) - made) for noise in (False, True))
    assert kept > 0.9 * np.std(hum) and lost < 0.1 * np.std(hum)


def test_the_promise_is_less_sure_where_the_gap_is_little_more_than_noise():
    left = np.full(5, 1.05)
    loud, quiet = (predict(np.full(5, gap), left, left, 1.0) for gap in (1.5, 50.0))
    width = [p.interval[1] - p.interval[0] for p in (loud, quiet)]
    assert width[0] > 2 * width[1]
    assert predict(np.ones(5), np.ones(5), np.ones(5), 1.0) is None


def test_levels_that_are_only_passed_are_not_repeated():
    def step(level):
        return level * -np.expm1(-np.arange(600) * 0.02 / 0.1)

    def seen(*levels):
        x = np.concatenate([p for v in levels for p in (step(v), v - step(v))])
        return excitation([x + 0.01 * np.random.default_rng(0).standard_normal(len(x))], 0.02, 1.0)

    rising, mixed, highest_first = seen(0.3, 0.6, 0.9), seen(0.5, 1.0, 0.5), seen(1.0, 0.3, 0.5)
    assert (rising.repeats, rising.revisits) == (0, 0)
    assert (mixed.repeats, mixed.revisits) == (1, 1)
    assert (highest_first.repeats, highest_first.revisits) == (2, 0)


def test_a_promise_stands_within_its_interval_however_much_worse_the_output_is():
    """What was found in a pressure may bring the output no closer; a promise of -104 % stood below -100 %."""
    found = predict(np.full(5, 1.2), np.full(5, 1.6), np.full(5, 1.7), 1.0)
    low, high = found.interval
    assert -1.0 <= low <= found.value <= high < 0.0


def test_what_fits_lose_on_parts_they_did_not_see_is_not_promised():
    gap, left = np.full(5, 20.0), np.full(5, 1.1)
    sure, unsure = (predict(gap, left, blind, 1.0) for blind in (left, np.full(5, 3.0)))
    assert sure.value - unsure.value == pytest.approx((3.0 - 1.1) / 19.0)
    assert sure.value == pytest.approx((20.0 - 1.1) / 19.0 - 0.04 / np.sqrt(20.0))
    assert unsure.interval[0] < sure.interval[0] - 0.05


def test_a_slow_sine_stays_slow_in_a_log_that_is_rounded_or_noisy():
    t, rng = np.arange(3000) * 0.02, np.random.default_rng(0)
    slow = 0.5 - 0.4 * np.cos(2 * np.pi * t / 30.0)
    noisy = [slow, slow + 0.01 * rng.standard_normal(len(t)), np.round(slow * 25) / 25]
    assert all(excitation([x], 0.02, 1.0).fastest > 0.5 for x in noisy)
    steps, small = (0.5 + size * (t > 30.0) for size in (0.4, 0.04))
    assert all(excitation([x], 0.02, 1.0).fastest == pytest.approx(0.02) for x in (steps, small))
    assert excitation([np.full(50, 0.3)], 0.02, 1.0).fastest == np.inf


def _explained(monkeypatch, ratio, share, left=_STEADY, effects=(), closed=False):
    """A segment of which effects leave ``ratio`` of the gap, as the disturbance ``left``, of which inputs
    predict ``share``."""
    monkeypatch.setattr(unexplained, "disturbed", lambda e: left)
    monkeypatch.setattr(unexplained, "from_outside", lambda e: False)
    monkeypatch.setattr(unexplained, "another", lambda e: None)
    monkeypatch.setattr(unexplained, "are_apart", lambda e: False)
    monkeypatch.setattr(unexplained, "is_late", lambda e: False)
    monkeypatch.setattr(unexplained, "is_uneven", lambda e: False)
    monkeypatch.setattr(unexplained, "is_taken_up", lambda e: False)
    monkeypatch.setattr(unexplained, "is_unsteady", lambda e: False)
    monkeypatch.setattr(unexplained, "is_restless", lambda e: False)
    nominal, best = (SimpleNamespace(weighed=np.full(4, np.sqrt(v))) for v in (1.0, ratio))
    return SimpleNamespace(
        segment=SimpleNamespace(pace=0.0, closed=closed, withheld=0.0),
        converter=None,
        whole=None,
        amiss=share,
        nominal=nominal,
        best=best,
        causes=[SimpleNamespace(rivals=[SimpleNamespace(effect=effect)]) for effect in effects],
    )


@pytest.mark.parametrize(
    "ratio, share, unknown", [(0.74, 0.19, True), (0.41, 0.37, False), (0.74, 0.05, False)]
)
def test_what_effects_explain_too_little_of_is_unknown(monkeypatch, ratio, share, unknown):
    assert unexplained.is_unknown(_explained(monkeypatch, ratio, share, effects=["leak"])) == unknown


@pytest.mark.parametrize(
    "effect, closed, bursts, share, unknown",
    [
        ("resonance", True, True, 0.2, True),
        ("resonance", True, True, 0.05, False),
        ("resonance", True, False, 0.2, False),
        ("resonance", False, True, 0.2, False),
        ("hysteresis", True, True, 0.2, False),
    ],
)
def test_what_knocks_in_a_closed_loop_is_no_mode(monkeypatch, effect, closed, bursts, share, unknown):
    left = replace(_STEADY, kurtosis=20.0, loudest=6.0) if bursts else _STEADY
    explained = _explained(monkeypatch, 0.4, share, left, [effect], closed)
    assert unexplained.is_unknown(explained) == unknown


@pytest.mark.parametrize(
    "effects, closed, slow, kurtosis, ratio, unknown",
    [
        (["leak"], True, 9.0, 3.0, 0.55, True),
        (["leak"], True, 9.0, 3.0, 0.4, False),
        (["leak"], True, 5.0, 3.0, 0.5, False),
        (["leak"], False, 9.0, 3.0, 0.5, False),
        ([], True, 9.0, 3.0, 1.0, False),
        (["leak"], True, 1.0, 13.0, 0.55, True),
        (["leak"], True, 1.0, 13.0, 0.4, False),
        (["sensor_quantization"], True, 9.0, 13.0, 0.9, False),
    ],
)
def test_what_a_closed_loop_hides_from_inputs_is_unknown(
    monkeypatch, effects, closed, slow, kurtosis, ratio, unknown
):
    left = replace(_STEADY, slow=slow, kurtosis=kurtosis, loudest=6.0)
    assert unexplained.is_unknown(_explained(monkeypatch, ratio, 0.0, left, effects, closed)) == unknown


def test_a_reading_that_stops_tells_how_far_the_actuator_went():
    logs = [
        replace(log, signals=log.signals | {"output": log["output"].clip(max=0.004)}) for log in session()
    ]
    hidden = [
        replace(log, signals={r: v for r, v in log.signals.items() if r != "curvature"}) for log in logs
    ]
    doubled = replace(RIG, sensor=TransferFunction([(12.0, 0.0)], [(1.0, 1.0), (6.0, 0.0)]))
    levels = [references(rig, make(hidden, "pressure", "output"), hidden).levels for rig in (RIG, doubled)]
    assert [found["response"] for found in levels] == pytest.approx([0.004, 0.002])
    seen = references(RIG, make(logs, "pressure", "curvature"), logs).levels
    assert seen["response"] == max(np.abs(log["curvature"]).max() for log in logs) > 0.008


@pytest.mark.parametrize(
    "stage, late, entry, exit, off",
    [
        ("regulator", ("pressure", "curvature", "output"), "command", "pressure", 0.005),
        ("sensor", ("output",), "curvature", "output", 0.005),
        ("regulator", ("output",), "command", "output", 0.5 * H),  # the sums of that rig's actuator are early
    ],
)
def test_a_delay_is_not_shared_with_columns_out_of_step(stage, late, entry, exit, off):
    logs = [replace(log, signals=_later(log.signals, late, 3)) for log in session(3, noise=1e-4)]
    bare = problem_of(RIG, replace(make(logs, entry, exit), between=False), logs)
    delay = bare.with_candidates(
        [CandidateEffect("transport_delay", library()["transport_delay"].forms[0], stage)]
    )
    found = fit(delay, np.r_[bare.nominal(), delay.starts(delay.candidates[0])[1]], WHITE)
    assert found.vector[len(delay.nominal_start)] == 0.0 < bare.bounds()[1][len(bare.nominal_start)]
    assert delay.values(found.vector)[0][0] == pytest.approx(3 * H, abs=off)


def _later(signals, roles, samples):
    """The signals, those of ``roles`` later by so many samples."""
    return {
        role: np.r_[np.zeros(samples), y][: len(y)] if role in roles else y for role, y in signals.items()
    }


def cause(share, wanders=False, effect="leak"):
    """A cause that closes ``share``, of one form."""
    form = SimpleNamespace(wanders=wanders)
    problem = SimpleNamespace(candidates=[SimpleNamespace(effect=effect, form=form)])
    rival = SimpleNamespace(effect=effect, fit=SimpleNamespace(problem=problem))
    return Cause((rival,), 0.0, share)


def test_a_cause_beside_a_larger_one_is_less_sure():
    """What the larger one's form lacks looks like it on rigs of others. A wander is never the larger one, and
    steps are seen in the readings."""
    large, small, wander = cause(0.8), cause(0.2), cause(0.9, wanders=True)
    both, alone = SimpleNamespace(causes=(large, small)), SimpleNamespace(causes=(small,))
    assert _beside(both, large) == _beside(alone, small) == 1.0
    assert _beside(both, small) == NUMBERS.smaller
    steps = cause(0.1, effect="sensor_quantization")
    assert _beside(SimpleNamespace(causes=(large, steps)), steps) == 1.0
    followed = SimpleNamespace(causes=(wander, small))
    assert _beside(followed, small) == 1.0 and _beside(followed, wander) == NUMBERS.smaller
