"""The posterior over effects: what it says of fits whose misfit is known.

Red when misfit counts as evidence for an effect, or a set is not the least that holds what it should.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.belief import further
from focgen.diagnosis.belief.choice import foremost_forms, likeliest
from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.belief.likelihood import Scale, log_likelihood, paid
from focgen.diagnosis.belief.standing import behind, least_set, nominal_off, probabilities, tied_within
from focgen.diagnosis.belief.unknown import is_none
from focgen.diagnosis.fitting.fit import WHITE, Weighing, fit
from focgen.diagnosis.hypotheses import accept, explain, rivals
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria
from focgen.diagnosis.hypotheses.nuisances import uncertain
from focgen.diagnosis.hypotheses.rivals import Rival, _needed
from focgen.diagnosis.hypotheses.search import Ranking
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict import nominal, unexplained
from focgen.diagnosis.verdict.confidence import nominal_instead, tied
from focgen.diagnosis.verdict.nominal import likelier_nominal
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.severity import VISIBLE

_COUNT, H = 10_000, 0.05
QUIET = dict.fromkeys(("bursts", "low_frequency", "tonal", "pushed"), False)
SLOW = QUIET | {"low_frequency": True}


class _Fit(SimpleNamespace):
    __hash__ = object.__hash__


class _Ground(Ground):
    def _kept(self, of):
        """The fit made anew, which a test gives, or ``of`` where that could not do better."""
        return getattr(of, "kept", of)


def _fit(square, effects=(), predictable_share=0.0, size=None, **more):
    """A fit that leaves the mean square ``square``, in units of the noise's."""
    candidates = tuple(SimpleNamespace(effect=name, form=SimpleNamespace(rarer=False)) for name in effects)
    made = _Fit(
        innovations=np.zeros(_COUNT),
        sse=_COUNT * square,
        weighed=np.full(4, np.sqrt(square)),
        problem=SimpleNamespace(candidates=candidates, families=tuple(effects)),
        size=len(effects) if size is None else size,
        prior_penalty=0.0,
        predictable_share=predictable_share,
    )
    vars(made).update(more)
    return made


def _ground(base, tried, changed=0.0, **around):
    """``base``, whose effects change a mean square of ``changed``, and what was tried beside it."""
    bare = SimpleNamespace(**{**vars(base), "problem": SimpleNamespace(candidates=(), families=())})
    ground = Ground.of(bare, bare, tried, None, Surroundings(**around))
    return _Ground(base, ground.floor, 0.5 * _COUNT * changed, ground.scale, None)


def test_evidence_saturates_between_good_forms():
    scale = Scale().of(1e6)
    best = log_likelihood(0.0, scale)
    near, far = (best - log_likelihood(part * scale, scale) for part in (0.1, 10.0))
    assert 0.0 < near < 0.1 * NUMBERS.turns and far == pytest.approx(NUMBERS.turns * np.log(11.0))


def test_below_its_scale_evidence_grows_like_the_likelihood():
    scale = Scale().of(0.0)
    assert log_likelihood(0.0, scale) - log_likelihood(0.01, scale) == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize("closed, there", [(0.003, False), (0.2, True)])
def test_a_second_effect_is_more_than_the_misfit_of_the_first(closed, there):
    """The first changes a hundred times the noise's mean square; a second closes a part of that gap."""
    gap = 100.0
    base, second = _fit(1.0 + closed * gap, ["leak"]), _fit(1.0, ["leak", "resonance"])
    _, odds = likeliest(_ground(base, [second], gap), [second])
    assert (odds > 0.0) == there
    alone, only = _fit(1.0 + closed * gap), _fit(1.0, ["resonance"])
    assert likeliest(_ground(alone, [only]), [only])[1] > 0.0


@pytest.mark.parametrize(
    "left, values, there", [(1.0, 1, True), (1.0, 5, False), (1.5, 1, False), (1.0, 2, True)]
)
def test_what_leaves_nothing_by_few_values_is_no_misfit_of_the_first(left, values, there):
    """It closes a fortieth of the gap, which a form may well be wrong by; but then it would leave as much."""
    base, second = _fit(1.0 + 2.5, ["leak"]), _fit(left, ["leak", "resonance"], size=1 + values)
    best = min([second, _fit(1.0, ["leak", "resonance"])], key=lambda f: f.sse)
    ground = _ground(base, [best], 100.0)
    assert (likeliest(ground, [second])[1] > 0.0) == there


def test_what_is_right_by_chance_is_there_and_not_chosen_for_it():
    """Of two forms one leaves nothing but noise, the other a five-hundredth of the gap more."""
    base, exact, near = _fit(50.0), _fit(1.0, ["leak"]), _fit(1.1, ["creep"])
    ground = _ground(base, [exact, near])
    assert ground.odds(exact) - ground.odds(near) > 3.0
    assert 0.0 < ground.compared(exact) - ground.compared(near) < 1.0


def test_of_a_family_the_likeliest_form_is_asked_and_not_the_one_that_leaves_least():
    """A force that falls with the way was `contact`, 0.95: a curve of five values stood for its family."""
    gap = _fit(13.2, predictable_share=0.89)
    curve = _fit(1.18, ["gain_nonlinearity"], 0.27, 5)
    falls = _fit(1.25, ["gain_nonlinearity"], 0.12, 2)
    contact, creep = _fit(1.37, ["contact"], 0.26, 2), _fit(9.0, ["creep"], 0.8, 1)
    rough = _fit(1.0, ["creep"], 0.0, 1)  # on means of samples, or in another colour
    ground = _ground(gap, [curve, falls, contact, creep])
    assert foremost_forms(ground, [curve, contact, creep, falls]) == [falls, contact]
    best = {"gain_nonlinearity": curve, "contact": contact, "creep": creep}
    ranking = Ranking(gap, np.ones(1), best, dict.fromkeys(best, 1e3), {}, (rough, falls), (falls,))
    assert ranking.on_all == (curve, contact, creep, falls)
    asked = AcceptanceCriteria(12.0, None, None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accept, "counted", lambda of, base: 1e3)
        patch.setattr(accept, "_goes_round", lambda base, winner: False)
        assert accept.select([ranking], asked) is falls


def test_nominal_parameters_a_little_off_are_asked_whether_they_have_to_be():
    """With 11 nats of them a delay paid for all, and a lag beside it with 14 for none."""
    kept = _fit(1.01, ["leak", "resonance"], prior_penalty=1.0)
    fits = [_fit(1.0, ["leak", "resonance"], prior_penalty=11.0, **more) for more in ({}, {"kept": kept})]
    as_moved, asked = (_ground(_fit(16.0, ["leak"]), [f], 100.0).odds(f) for f in fits)
    assert asked == pytest.approx(as_moved + 10.0, abs=0.5)


def test_the_likeliest_is_one_that_something_is_explained_by():
    """What owes its odds to nominal parameters alone does not keep out what closes the gap."""
    base, strained = _fit(20.0, ["leak"], prior_penalty=30.0), _fit(20.0, ["leak", "creep"])
    closes = _fit(2.0, ["leak", "resonance"], prior_penalty=30.0)
    best, odds = likeliest(_ground(base, [strained, closes], 100.0), [strained, closes])
    assert best is closes and odds > 0.0


def test_a_refit_that_is_strained_asks_for_no_effect():
    """Own parameters closer to those given choose among two effects, and are no reason for either."""
    base, tried = _fit(1.002), [_fit(1.0, ["leak"]), _fit(1.0, ["creep"])]
    base.prior_penalty, tried[0].prior_penalty = 20.0, 20.0
    best, odds = likeliest(_ground(base, tried), tried)
    assert best is tried[1] and odds < 0.0


@pytest.mark.parametrize("left, there", [(1.1, True), (15.0, False)])
def test_a_fit_that_strains_nominal_parameters_is_asked_whether_it_has_to(left, there):
    """The second effect is 50 nats off. Kept close it leaves a little more, or nearly all of the gap."""
    kept = _fit(left, ["leak", "resonance"], prior_penalty=1.0)
    second = _fit(1.0, ["leak", "resonance"], prior_penalty=50.0, kept=kept)
    base = _fit(16.0, ["leak"])
    best, odds = likeliest(_ground(base, [second], 100.0), [second])
    assert best is second and (odds > 0.0) == there


def test_so_is_what_was_found_without_it():
    """Kept close, what was found without the effect leaves hardly more: an effect has nothing to mend."""
    strained = _fit(2.0, ["leak"], prior_penalty=40.0)
    second = _fit(1.2, ["leak", "resonance"], predictable_share=0.2 / 1.2 + NUMBERS.chance)
    odds = [
        _ground(base, [second], 100.0).odds(second)
        for base in (strained, _fit(2.0, ["leak"], prior_penalty=40.0, kept=_fit(2.1, ["leak"])))
    ]
    assert odds[0] > 30.0 and odds[1] < 10.0


def test_a_fit_kept_close_to_what_was_given_moves_less_and_leaves_more():
    """A pump twice as slow as given: its time moves as far as it may, and what is known holds it back."""
    regulator = TransferFunction([(1.0, 0.0)], [(0.4, 1.0), (1.0, 0.0)])
    rig = Rig("bench", H, Signals("t", "y", "u", pressure="p"), Actuator(0.8, 0.9, (1.0,)), regulator)
    rng, asked = np.random.default_rng(1), np.repeat([0.0, 3.0, 1.0, 5.0, 2.0, 0.0], 100)
    slow = lfilter([1 - np.exp(-H / 0.8)], [1.0, -np.exp(-H / 0.8)], asked)
    roles = {"command": asked, "pressure": slow + 0.01 * rng.normal(size=600), "output": slow}
    logs = [Experiment("steps", H, roles)]
    bare = uncertain(rig, make(logs, "command", "pressure"), logs)
    free = fit(bare, bare.nominal(), WHITE, 20)
    ground = Ground.of(free, free, [free], WHITE, Surroundings())
    kept = ground._kept(free)
    assert 0.0 < kept.prior_penalty < 0.9 * free.prior_penalty
    assert kept.sse > free.sse and kept.problem.candidates == free.problem.candidates


def test_what_takes_nothing_but_noise_away_is_no_effect():
    base = _fit(1.002)
    tried = [_fit(1.0, ["leak"], size=size) for size in (1, 5)]
    assert likeliest(_ground(base, tried), tried)[1] < 0.0


def test_free_values_are_paid_for_and_the_less_the_more_the_form_is_wrong():
    right, wrong = (paid(2, 1e5, misfit, Scale().of(1e5)) for misfit in (0.0, 1e5))
    assert paid(1, 1e5, 0.0, Scale().of(1e5)) == pytest.approx(right / 2) and 0 < wrong < right
    assert paid(2, 0.0, 0.0, Scale().of(0.0)) == 0.0


def test_free_values_that_the_experiments_cannot_show_are_not_counted():
    base, simple, rich = _fit(2.0), _fit(1.0, ["leak"]), _fit(1.0, ["softening"], size=5)
    ground = _ground(base, [simple, rich])
    assert ground.odds(rich) < ground.odds(simple) - 2.0
    assert ground.odds(rich, 1) == pytest.approx(ground.odds(simple))


def test_what_a_chain_is_off_by_is_no_effect_and_what_the_trials_call_visible_is():
    """Thousands of samples show clearly what is below a sixteenth of the noise, root mean square."""
    tried = _fit(1.0, ["leak"])
    for square, there in ((0.06**2, False), (VISIBLE**2, True)):
        assert (likeliest(_ground(_fit(1.0 + square), [tried]), [tried])[1] > 0.0) == there


@pytest.mark.parametrize("around", [{"hidden": 0.2}, {"lost": np.zeros(_COUNT)}])
def test_an_uneven_converter_and_an_input_that_lost_something_hide_small_effects(monkeypatch, around):
    monkeypatch.setattr(further, "answer", lambda of, lost, weighing: 0.2 * _COUNT)
    base, better = _fit(1.1), _fit(1.0, ["leak"])
    assert likeliest(_ground(base, [better]), [better])[1] > 0.0
    assert likeliest(_ground(base, [better], **around), [better])[1] < 0.0


def test_what_an_input_has_lost_counts_in_the_colour_of_the_noise():
    """A slow loss of a tenth of what slow noise is: as it stands it hides a hundredth, and in the noise's
    colour next to nothing; a quick one the more."""
    n, t = 2000, np.arange(2000) * H
    u = np.repeat([0.0, 1.0, 0.5, 0.8], n // 4)
    y = u + lfilter([0.01], [1.0, -0.95], np.random.default_rng(3).standard_normal(n))
    logs = [Experiment("steps", H, {"command": u, "pressure": y, "output": y})]
    rig = Rig(Actuator(0.5, 1.0, (1.0,)), H, Signals(time="t", output="y"))
    problem = uncertain(rig, make(logs, "command", "pressure"), logs)
    slow, quick = (0.003 * np.sin(2.0 * np.pi * f * t) for f in (0.05, 5.0))

    def hidden(lost, weighing):
        bare = fit(problem, problem.nominal(), weighing, 0)
        floor = bare.sse
        around, alone = Surroundings(lost=lost), Surroundings()
        noise = float(np.mean(bare.weighed**2))
        return around.nats(bare, noise, floor, weighing) - alone.nats(bare, noise, floor, weighing)

    coloured = Weighing(np.array([1.0, -0.95]))
    assert hidden(slow, WHITE) == pytest.approx(hidden(quick, WHITE), rel=0.05)
    assert hidden(slow, coloured) < 0.2 * hidden(slow, WHITE) < hidden(quick, coloured)


def test_to_leave_less_for_being_deaf_to_noise_of_the_input_is_no_merit(monkeypatch):
    """Noise of 0.1 in the output comes from the input: one form keeps it out, one mends as much of a gap."""
    base, deaf, better = _fit(1.1), _fit(1.0, ["sensor_lag"]), _fit(1.0, ["leak"])
    answers = {base: 0.1, deaf: 0.0, better: 0.1}
    monkeypatch.setattr(further, "answer", lambda of, *_: _COUNT * answers[of])
    ground = replace(_ground(base, [deaf, better]), noise=np.zeros(_COUNT))
    assert likeliest(ground, [better])[1] > 0.0 > likeliest(ground, [deaf])[1]
    assert ground.misfit(deaf) == pytest.approx(ground.misfit(base)) and ground.misfit(better) == 0.0


def test_an_answer_to_the_input_is_that_of_the_simulation():
    """A stage that is 1 hands on what its input is off by."""
    u, off = np.repeat([0.0, 1.0, 0.5], 200), np.linspace(0.0, 0.1, 600)
    y = u + 0.01 * np.random.default_rng(3).standard_normal(600)
    logs = [Experiment("steps", H, {"command": u, "pressure": y, "output": y})]
    rig = Rig(Actuator(0.5, 1.0, (1.0,)), H, Signals(time="t", output="y"))
    problem = uncertain(rig, make(logs, "command", "pressure"), logs)
    bare = fit(problem, problem.nominal(), WHITE, 0)
    assert further.answer(bare, off, WHITE) == pytest.approx(np.sum((off * problem.segment.weight) ** 2))
    assert further.answer(bare, 0.0 * off, WHITE) == 0.0


def test_the_set_is_the_least_that_holds_what_is_asked():
    sure = probabilities([20.0, 19.0, 12.0, -3.0])
    assert list(least_set(sure)) == [0, 1] and np.sum(sure) == pytest.approx(1.0 - NUMBERS.elsewhere)
    assert sure[0] / sure[1] == pytest.approx(np.e)
    assert list(least_set(probabilities([9.0, 30.0]))) == [1]


def test_of_two_families_the_second_is_in_the_set_within_what_the_pictures_show():
    for nearer, held in ((0.99, [0, 1]), (1.01, [0])):
        nats = 0.5 * (nearer * tied_within()) ** 2
        assert behind(30.0 - nats, 30.0) == pytest.approx(nearer * tied_within())
        assert list(least_set(probabilities([30.0, 30.0 - nats]))) == held


def test_an_effect_that_may_not_be_there_is_less_sure():
    assert probabilities([0.0])[0] == pytest.approx(0.5 * (1.0 - NUMBERS.elsewhere))
    assert probabilities([np.inf])[0] == pytest.approx(1.0 - NUMBERS.elsewhere)


def test_nats_behind_are_squares_of_standard_deviations():
    assert behind(3.0, 5.0) == pytest.approx(2.0) and behind(5.0, 3.0) == pytest.approx(-2.0)


def test_what_no_form_makes_is_none_of_the_library():
    """The bound on the misfit, a part of what the effects change, solved by hand."""
    bound = NUMBERS.form * NUMBERS.rare ** (-1.0 / NUMBERS.turns) - NUMBERS.form**2
    assert is_none(1.01 * bound, 1.0) and not is_none(0.99 * bound, 1.0)
    assert is_none(0.1, 0.0) and not is_none(0.0, 0.0)


def _rival(effect, odds, change):
    return Rival(effect, "actuator", 0.0, 0.0, None, odds, change)


def test_an_effect_that_changes_less_than_the_noise_is_not_sure_however_clear_it_is():
    """The nominal chain may be off by as much: its curve, and by a third of that in other ways."""
    bent, whole = NUMBERS.bent, 1.0 - NUMBERS.elsewhere
    for part, sure in ((0.5, 1 / 17), (1.0, 1 / 2), (2.0, 16 / 17)):
        for name, alike in (("gain_nonlinearity", bent), ("hysteresis", bent / 3)):
            assert tied([_rival(name, 300.0, part * alike)])[1] == pytest.approx([sure * whole])
    assert tied([_rival("hysteresis", 300.0, 2 * bent)])[1] > 0.999 * whole
    assert tied([_rival("sensor_quantization", 300.0, 0.1)])[1] == pytest.approx([whole])


def test_the_chain_is_as_likely_as_the_effect_it_would_be_and_no_more():
    """Where an effect with memory is much the likelier, a rival's curve takes nothing from it."""
    rivals = [_rival("hysteresis", 40.0, 20.0), _rival("gain_nonlinearity", 20.0, 0.4)]
    assert tied(rivals)[1] == pytest.approx([1.0 - NUMBERS.elsewhere])
    alike = [_rival("hysteresis", 40.0, 20.0), _rival("contact", 40.0, NUMBERS.bent)]
    assert tied(alike)[1] == pytest.approx([(1.0 - NUMBERS.elsewhere) / 3] * 2)


def test_what_the_nominal_chain_as_good_as_surely_is_leaves_the_effects():
    """At a quarter of what is as likely the chain holds all that a set is to hold."""
    faint, clear = 0.25 * NUMBERS.bent, 0.6 * NUMBERS.bent
    assert _needed(_rival("contact", 300.0, faint)) == _needed(_rival("creep", 300.0, faint / 3)) == -np.inf
    assert _needed(_rival("contact", 300.0, clear)) == _needed(_rival("creep", 300.0, faint)) == 300.0
    assert nominal_instead(_rival("contact", 300.0, NUMBERS.bent)) == pytest.approx(0.5)
    assert nominal_instead(_rival("sensor_quantization", 300.0, faint)) == 0.0
    assert nominal_off(np.inf, True) == -np.inf


@pytest.mark.parametrize(
    "first, after, judged", [(0.1, 0.1, "noise"), (0.3, 0.3, "white"), (0.1, 0.3, "white")]
)
def test_a_colour_goes_with_the_effects_that_it_was_made_with(monkeypatch, first, after, judged):
    """What a third effect leaves, which is not there, is no noise: judged in its colour, a softening that
    halved what is left was worth nothing beside a slow release."""
    found = {"all": 2, "fewer": 1}
    of = {n: SimpleNamespace(problem=SimpleNamespace(candidates=[0] * c)) for n, c in found.items()}
    of["all"].predictable_share, of["fewer"].predictable_share = first, after
    kept = of["fewer"] if first != after else of["all"]
    monkeypatch.setattr(explain, "_dropped", lambda best, weighing, *_: kept)
    monkeypatch.setattr(explain, "foretelling", lambda best, weighing, known: best)
    monkeypatch.setattr(explain, "realigned", lambda best, weighing: best)
    last = SimpleNamespace(base=of["all"], ar=np.array([1.0, -0.9]))
    best, weighing = explain._sifted(last, SimpleNamespace(threshold=12.0, granted=False), ())
    assert best is kept
    assert (weighing is WHITE) == (judged == "white")


def test_what_changes_nothing_tells_nothing_of_a_chain_that_is_off():
    """An obstacle out of reach, sure not to be there, made a drift beside it impossible: 4e-16."""
    alone = probabilities([8.3], [-2.2])[0]
    assert alone > 0.8
    for obstacle in (-8.2, -0.01, 0.01):  # of which the last two have evidence, whatever they change
        beside = probabilities([8.3, obstacle], [-2.2, nominal_off(1e-9, True)])[0]
        assert beside == pytest.approx(alone, abs=0.01) if obstacle < -8.0 else 0.3 < beside < alone


def test_what_is_likelier_not_there_is_not_named_beside_an_effect(monkeypatch):
    monkeypatch.setattr(nominal, "is_unknown", lambda e: False)
    gone, clear = (
        SimpleNamespace(rivals=[_rival("contact", odds, 9.0 * NUMBERS.bent)]) for odds in (-3.0, 30.0)
    )
    found = likelier_nominal([SimpleNamespace(causes=(gone, clear), unknown=False)])
    assert [c for _, c in found] == [gone]


def test_beside_an_effect_what_is_likelier_the_nominal_chain_is_not_named(monkeypatch):
    """Alone it stays, for it is all there is to say; of several the surest stays."""
    monkeypatch.setattr(nominal, "is_unknown", lambda e: e.unknown)
    faint, fainter, clear = (
        SimpleNamespace(rivals=[_rival("contact", 300.0, part * NUMBERS.bent)]) for part in (0.8, 0.7, 3.0)
    )

    def left_out(*causes, unknown=False):
        return [c for _, c in likelier_nominal([SimpleNamespace(causes=causes, unknown=unknown)])]

    assert left_out(faint) == left_out(clear) == []
    assert left_out(faint, clear) == [faint] and left_out(fainter, faint) == [fainter]
    assert left_out(faint, clear, unknown=True) == []
    even = SimpleNamespace(rivals=[replace(_rival("softening", 300.0, 1.4), form=2.0)])
    assert nominal_instead(even.rivals[0]) == 0.5
    assert left_out(even) == [] and left_out(even, clear) == [even]


@pytest.mark.parametrize("part_of_whole", [True, False])
def test_what_is_not_named_for_the_nominal_chain_is_no_disturbance(monkeypatch, part_of_whole):
    """An obstacle beside a creep, which may as well be the form of the chain: what the obstacle alone leaves
    swings slowly, what both leave is noise. It was `unknown`."""
    monkeypatch.setattr(unexplained, "disturbed", lambda e: SimpleNamespace(**(SLOW if e.slow else QUIET)))
    monkeypatch.setattr(unexplained, "is_restless", lambda e: False)
    monkeypatch.setattr(unexplained, "is_rounded", lambda causes: False)
    for other in (
        "from_outside",
        "another",
        "is_late",
        "are_apart",
        "is_uneven",
        "is_taken_up",
        "is_unsteady",
    ):
        monkeypatch.setattr(unexplained, other, lambda e: False)
    common = {"converter": None, "segment": SimpleNamespace(closed=False), "amiss": 0.0, "nominal": _fit(9.0)}
    both = SimpleNamespace(causes=(1, 2), best=_fit(1.0), slow=False, whole=None, **common)
    obstacle = SimpleNamespace(
        causes=(1,), best=_fit(6.0), slow=True, whole=both if part_of_whole else None, **common
    )
    assert unexplained.is_unknown(obstacle) != part_of_whole


@pytest.mark.parametrize("part, off", [(0.25, True), (0.6, False)])
def test_what_left_for_the_nominal_chain_is_kept_in_mind(monkeypatch, part, off):
    """A bent spring of a quarter of what the chain is off by leaves; one that was in vain leaves no trace."""
    odds = 300.0 if off else -1.0
    curve = SimpleNamespace(rivals=[replace(_rival("contact", odds, part * NUMBERS.bent), separation=0.0)])
    with_it, without = _fit(1.0, ("contact",)), _fit(9.0)
    left = {with_it: (curve,), without: ()}
    monkeypatch.setattr(rivals, "_causes", lambda best, beside: left[best])
    monkeypatch.setattr(rivals, "without_family", lambda *_: without)
    beside = SimpleNamespace(granted=False, weighing=None, known=())
    found = rivals.reexamined(with_it, beside)
    assert found.best is without and not found.causes
    assert (found.off is not None) == off
    assert not off or (found.off.best is with_it and found.off.causes == (curve,))


def test_of_two_forms_that_are_not_needed_the_family_keeps_one(monkeypatch):
    """An exhaust at 37 nats was lost with the second lag that a fit had put beside it."""
    both, one = (_fit(1.0, ("valve_asymmetry",) * forms, cost=0.0) for forms in (2, 1))
    odds = {both: -3.5, one: 32.0}
    rival = {of: replace(_rival("valve_asymmetry", nats, 2.0), separation=0.0) for of, nats in odds.items()}
    monkeypatch.setattr(rivals, "_causes", lambda best, _: (SimpleNamespace(rivals=[rival[best]]),))
    monkeypatch.setattr(rivals, "left_out", lambda *_: one)
    found = rivals.reexamined(both, SimpleNamespace(granted=False, weighing=None, known=()))
    assert found.best is one and len(found.causes) == 1


@pytest.mark.parametrize("explained", [True, False])
def test_what_the_nominal_chain_is_off_by_is_not_unknown(monkeypatch, explained):
    """Without the curve, slow swings were left that nothing explains; with it, noise."""
    whole = SimpleNamespace(causes=("a curve",), whole=None)
    judged = []
    monkeypatch.setattr(unexplained, "disturbed", judged.append)
    monkeypatch.setattr(unexplained, "_is_disturbed", lambda e, left: e is whole and not explained)
    whole.converter, whole.segment = None, SimpleNamespace(closed=False, withheld=0.0)
    whole.amiss = 0.0
    doubts = ("from_outside", "another", "is_late", "are_apart", "is_uneven", "is_taken_up", "is_unsteady")
    for asked in doubts:
        monkeypatch.setattr(unexplained, asked, lambda e: False)
    monkeypatch.setattr(unexplained, "is_rounded", lambda causes: False)
    bare = SimpleNamespace(causes=(), whole=whole, amiss=1.0)
    assert unexplained.is_unknown(bare) == (not explained)
    assert judged == [whole]
