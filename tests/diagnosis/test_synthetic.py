"""Diagnoses of rigs simulated apart from the library.

Red when a simulated effect is missed or called another name, or a sound rig is called faulty.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.hypotheses.bootstrap import threshold
from focgen.diagnosis.hypotheses.explain import candidates_for, explain
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import compose, summary
from focgen.diagnosis.verdict import predicted_improvement as promise
from focgen.diagnosis.verdict.cross_validation import cross_validated_share
from focgen.diagnosis.verdict.improvement import Improvement
from focgen.errors import FocgenError
from focgen.rig.files import read_rig
from focgen.rig.replay import replay
from focgen.rig.rig import UNITY
from tests.diagnosis_rig import RIG, H, session


@pytest.fixture(scope="module")
def drifting(tmp_path_factory):
    """What is said of a gain that drifts, and the folder that it is written into."""
    folder = tmp_path_factory.mktemp("drifting")
    return diagnose(RIG, session(11, drift=6e-4), folder, pictures=False), folder


def named(diagnosis):
    return [[c.effect for c in f.candidates] for f in diagnosis.causes]


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in (1, 2))])
def test_no_gap(seed):
    found = diagnose(RIG, session(seed))
    assert found.verdict in ("none", "parameters") and not found.causes
    assert found.shrink is None and found.where.stage is None


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_parameters_only(seed):
    found = diagnose(RIG, session(seed, T=1.6, alpha=0.55, gain=(0.0025, 0.3)))
    assert found.verdict == "parameters"
    assert found.gap.refitted < 0.6 * found.gap.as_given


@pytest.mark.parametrize(
    "effect, stage, case",
    [
        ("transport_delay", "regulator", {"delay": 4}),
        pytest.param("valve_asymmetry", "regulator", {"vent": 0.8}, marks=pytest.mark.long),
        pytest.param("dead_zone", "actuator", {"zone": 0.045}, marks=pytest.mark.long),
        pytest.param("hysteresis", "actuator", {"slip": 0.35}, marks=pytest.mark.long),
        pytest.param("sensor_nonlinearity", "sensor", {"bend": 20.0}, marks=pytest.mark.long),
    ],
)
def test_one_effect_is_named_in_its_stage(effect, stage, case):
    is_named(diagnose(RIG, session(11, **case)), effect, stage)


def test_a_drift_is_named_in_its_stage(drifting):
    is_named(drifting[0], "gain_drift", "actuator")


def is_named(found, effect, stage):
    """Alone, and as most of the gap."""
    assert found.verdict == "named" and named(found) == [[effect]]
    assert found.where.stage == stage and not found.where.inferred
    assert found.gap.explained < found.gap.refitted <= found.gap.as_given * 1.02
    assert found.shrink > 0.8


@pytest.mark.long
def test_a_gain_that_ends_is_seen_though_own_parameters_bend_to_make_up_for_it():
    """From parameters so bent a dead zone mends more than the gain's own forms do."""
    found = diagnose(RIG, session(1, cap=0.1, roles=("pressure",)))
    assert found.verdict == "named" and named(found) == [["gain_nonlinearity"]]


@pytest.mark.parametrize("camera", [12.0, pytest.param(5.0, marks=pytest.mark.long)])
def test_a_noisy_camera_makes_no_fault_of_the_sensor_behind_it(camera):
    """What the actuator's refit leaves open of the curvature is no effect of the sensor that reads it."""
    found = explain_all(RIG, session(1, camera=camera, noise=0.003), NUMBERS.nats)
    assert not any(e.causes for e in found) and found[-1].predictability.share < 0.01


def test_a_pressure_taken_as_measured_is_not_off_as_a_simulated_one_is():
    """What a regulator's refit leaves open is left open of the pressure that it is simulated to give."""
    logs = session(1)[:1]
    pumped = [log["pressure"] + 0.02 * np.sin(2.0 * np.pi * 0.7 * H * np.arange(len(log))) for log in logs]
    hum = [replace(log, signals={**log.signals, "pressure": p}) for log, p in zip(logs, pumped)]
    simulated, measured = (
        explain_all(RIG, given, NUMBERS.nats, ["transport_delay"])[1].segment for given in (logs, hum)
    )
    assert simulated.input_modes.shape[1] > 0 and np.ptp(simulated.x - np.concatenate(pumped)) > 0.03
    assert measured.input_modes.shape[1] == 0 and np.ptp(measured.x - np.concatenate(pumped)) < 0.02


def test_what_inputs_still_tell_of_a_pressure_goes_on_into_the_stage_behind():
    """What an explanation lacks of it is no effect of that stage."""
    (log,) = session(1)[:1]
    bent = log["pressure"] * (1.0 - log["pressure"] / 0.18)  # what no number of a regulator makes
    given = replace(log, signals={**log.signals, "pressure": log["pressure"] + 0.011 * bent})
    first, second, *_ = explain_all(RIG, [given], NUMBERS.nats, ["transport_delay"])
    told, simulated = first.predictability.share, first.best.problem.simulate(first.best.vector)
    before, after = (np.mean((given["pressure"] - x) ** 2) for x in (simulated, second.segment.x))
    assert NUMBERS.chance < told < NUMBERS.left and after < (1.0 - 0.9 * told) * before


@pytest.mark.long
def test_a_fault_of_the_sensor_behind_a_noisy_camera_is_found():
    found = diagnose(RIG, session(1, camera=5.0, noise=0.003, bend=20.0))
    assert named(found) == [["sensor_nonlinearity"]] and found.shrink > 0.8


@pytest.mark.parametrize("role", ["pressure", pytest.param("curvature", marks=pytest.mark.long)])
@pytest.mark.parametrize("off", [0.03, pytest.param(0.008, marks=pytest.mark.long)])
def test_gauges_that_disagree_by_a_little_are_no_fault(role, off):
    logs = [replace(log, signals={**log.signals, role: log[role] * (1 + off)}) for log in session(1, T=1.45)]
    found = diagnose(RIG, logs)
    assert found.verdict == "parameters" and not found.causes


@pytest.mark.parametrize("off, fault", [(0.008, False), pytest.param(0.03, True, marks=pytest.mark.long)])
def test_gauges_of_a_stage_that_is_absent_agree_to_a_percent(off, fault):
    """Without a sensor the rig says that the output is the curvature; another camera reads it."""
    bare = replace(RIG, sensor=UNITY)
    read = [log["curvature"] * (1 + off) for log in session(2)]
    logs = [replace(a, signals={**a.signals, "output": y}) for a, y in zip(session(1), read, strict=True)]
    assert bool(diagnose(bare, logs).causes) == fault


def test_the_promise_holds_on_new_experiments(tmp_path):
    found = diagnose(RIG, session(3, slip=0.35)[:4], tmp_path / "out", pictures=False)
    unseen = session(3, slip=0.35)[4:]
    floor = session(3, slip=0.35, noise=0.0)[4:]
    noise = np.mean((unseen[0]["output"] - floor[0]["output"]) ** 2)
    squares = [
        next(iter(replay(tmp_path / "out" / name, unseen).logs.values())).rmse ** 2
        for name in (found.refitted_rig, found.augmented_rig)
    ]
    achieved = (squares[0] - squares[1]) / (squares[0] - noise)
    assert abs(achieved - found.shrink) < 0.1
    assert found.shrink_interval[0] <= achieved <= found.shrink_interval[1] + 0.02
    carried = [
        replay(rig, unseen).logs[unseen[0].name].rmse ** 2 for rig in (found.refitted, found.augmented)
    ]
    assert carried == pytest.approx(squares, rel=1e-9)  # the rigs as objects are those of the files


def test_the_floor_under_a_coarse_reading_is_its_noise():
    logs, step = session(2), 6e-4
    coarse = [
        replace(log, signals={**log.signals, "output": step * np.round(log["output"] / step)}) for log in logs
    ]
    found = diagnose(RIG, coarse)
    assert named(found) == [["sensor_quantization"]]
    assert found.gap.floor == pytest.approx(0.006 * 0.011, rel=0.2)
    assert found.gap.explained > 2.0 * found.gap.floor


def _converted(log, step, uneven, lazy):
    """A log read by a converter whose thresholds lie ``uneven`` off and that comes back ``lazy`` late, of a
    step."""
    y, code, codes = log["output"] / step, 0.0, []
    for value in y:
        if abs(value - code) > 0.5 + lazy / 2:
            code = np.floor(value + 0.5 + uneven * np.sin(11.3 * np.floor(value + 0.5)))
        codes.append(code)
    return replace(log, signals={**log.signals, "output": step * np.array(codes)})


@pytest.mark.long
@pytest.mark.parametrize("uneven, lazy", [(0.15, 0.0), (0.0, 0.25), (0.1, 0.1)])
def test_uneven_and_sluggish_steps_are_no_effect_of_their_own(uneven, lazy):
    coarse = [_converted(log, 9e-4, uneven, lazy) for log in session(4, roles=("pressure",))]
    assert named(diagnose(RIG, coarse)) == [["sensor_quantization"]]


@pytest.mark.long
def test_an_effect_beside_a_converter_is_found():
    """Its steps are no more than noise: a note tells of them, and no cause."""
    coarse = [_converted(log, 4e-4, 0.1, 0.1) for log in session(5, vent=0.8, roles=())]
    found = diagnose(RIG, coarse)
    assert named(found) == [["valve_asymmetry"]]
    assert any("move in steps of 0.0004" in note for note in found.notes)


@pytest.mark.long
def test_a_curve_that_stands_for_two_effects_is_told_apart():
    logs = session(6, zone=0.03, roles=())
    clipped = [
        replace(log, signals={**log.signals, "output": np.minimum(log["output"], 0.0045)}) for log in logs
    ]
    found = named(diagnose(RIG, clipped))
    assert len(found) == 2
    assert any("dead_zone" in names for names in found) and any(
        "sensor_saturation" in names for names in found
    )


def test_what_brings_the_whole_output_no_closer_is_not_named(monkeypatch):
    """A bend that the sensor has is kept, the opposite one is not."""
    monkeypatch.setattr(summary, "_comes_in", lambda e, square: False)  # its own segment fits, turned or not
    logs = session(11, bend=20.0)
    explanations = explain_all(RIG, logs, NUMBERS.nats, ["sensor_nonlinearity"])
    rigs = compose.compose(RIG, explanations, logs)
    (found,) = rigs.placed
    turned = replace(found, values=(-found.values[0], *found.values[1:]))
    assert found.values[0] > 0
    assert summary._no_closer(RIG, logs, rigs, explanations) == []
    worse = replace(rigs, placed=(turned,))
    assert summary._no_closer(RIG, logs, worse, explanations) == [explanations[-1]]
    # but it is there: without it the output is off by far more than noise
    sorted_out = [summary.sorted_out(RIG, logs, of, explanations, False) for of in (rigs, worse)]
    assert [s.unknown for s in sorted_out] == [[], [explanations[-1]]]


@pytest.mark.parametrize("fault, kept", [("of the valve", True), ("of the gauge", False)])
def test_a_bend_behind_a_pressure_that_nothing_explains_is_kept_unless_its_gauge_made_it(fault, kept):
    """A valve that sticks in a way of its own left a tenfold error, and the rubber behind it was nothing."""
    logs = session(11, bend=20.0 if kept else 0.0, roles=("pressure",))
    found = []
    for log in logs:
        pressure = np.asarray(log["pressure"])
        at_fault = {"pressure": pressure * (1.0 + 0.5 * pressure / np.max(pressure))}
        another = {"command": np.roll(log["command"], 400)}  # than the one that the valve answered
        found.append(replace(log, signals={**log.signals, **(another if kept else at_fault)}))
    explanations = explain_all(RIG, found, NUMBERS.nats, ["sensor_nonlinearity", "gain_nonlinearity"])
    explanations = [replace(explanations[0], best=explanations[0].nominal), *explanations[1:]]
    assert explanations[-1].causes
    rigs = compose.compose(RIG, explanations, found)
    assert summary._no_closer(RIG, found, rigs, explanations) == ([] if kept else [explanations[-1]])


class _Explained:
    """Of an explanation what tells whether it is at odds with another one: what it leaves of its level."""

    def __init__(self, left, exit="output"):
        self.causes, self.segment = (), SimpleNamespace(pace=0.0, level_out=2.0, exit=exit)
        problem = SimpleNamespace(candidates=[])
        self.best = SimpleNamespace(weighed=np.array([left, -left]), problem=problem)


@pytest.mark.parametrize(
    "left, exit, at_odds",
    [(0.22, "output", False), (0.23, "output", True), (0.22, "curvature", True)],  # that is in another unit
)
def test_effects_that_leave_more_than_none_are_at_odds_unless_the_last_one_explains_what_was_read(
    left, exit, at_odds
):
    """A fifth of the mean square that the chain leaves without them is 0.2, and the level is 2."""
    each = [_Explained(1.0), _Explained(left, exit)]
    squares = {"explained": np.array([1.2]), "as given": np.array([1.0]), "refitted": np.array([1.1])}
    told = summary.Summary(None, [(e, None) for e in each], {}, squares, 0.01, None)
    assert summary._at_odds(told) == (each if at_odds else [])


def test_noise_that_stays_in_an_input_is_known_behind_a_stage_that_hums(monkeypatch):
    """Half of the hum's width at least, and nothing behind a stage that does not."""
    told = []

    def explained(*given):
        told.append(given[-1])
        return explain(*given)

    monkeypatch.setattr("focgen.diagnosis.findings.explain", explained)
    for hum in (0.0, 0.01):
        tone = [hum * np.sin(2 * np.pi * 1.3 * H * np.arange(len(log))) for log in session()]
        logs = tuple(
            replace(log, signals={**log.signals, "pressure": log["pressure"] + t})
            for log, t in zip(session(), tone, strict=True)
        )
        explain_all(RIG, logs, NUMBERS.nats, ["transport_delay"])
        first, second = told[:2]
        assert first is None and np.std(second.noise) >= 0.5 * hum and (hum or not np.any(second.noise))
        del told[:]


class Explained:
    """What a verdict asks of a segment: its pace, 0 where errors do not add up, and what it closes."""

    def __init__(self, pace: float, share: float) -> None:
        self.segment, self.share = SimpleNamespace(pace=pace), share


def test_of_a_promise_of_next_to_nothing_segments_that_close_their_own_gap_are_not_in_vain(monkeypatch):
    """Of several as of one; but where errors add up, what is closed at the pace of the rig is no path."""
    monkeypatch.setattr(summary, "cross_validated_share", lambda e: e.share)
    clear, vain, path = Explained(0.0, 0.9), Explained(0.0, 0.1), Explained(0.4, 0.9)

    def found(*explanations):
        return summary._in_vain(SimpleNamespace(causes=[(e, None) for e in explanations]))

    assert found(clear, vain, vain) == [vain]
    assert found(clear) == [] and found(vain) == [vain]
    assert found(clear, path) == [path]


@pytest.mark.long
@pytest.mark.parametrize("share, causes", [(0.9, [["valve_asymmetry"]]), (0.1, [])])
def test_what_is_clear_in_one_segment_stands_whatever_is_left_in_another(share, causes, monkeypatch):
    """The output promises next to nothing; the pressure, logged, closes its own gap, or not even that."""
    monkeypatch.setattr(promise, "predict", lambda *given: Improvement(0.15, (0.0, 0.5)))
    monkeypatch.setattr(summary, "cross_validated_share", lambda *given: share)
    found = diagnose(RIG, session(11, vent=0.8, roles=("pressure",)), to=40.0)
    assert named(found) == causes


@pytest.mark.long
def test_what_was_fitted_beside_an_effect_goes_with_it():
    """An actuator's numbers beside a zone that is left out brought the output further off than no effect."""
    logs = [log.between(0.0, 40.0) for log in session(11, vent=0.8, zone=0.045)]
    found = explain_all(RIG, logs, NUMBERS.nats, ["valve_asymmetry", "dead_zone"])
    rigs, zoned = compose.compose(RIG, found, logs), found[1]
    assert [c.rivals[0].effect for c in zoned.causes] == ["dead_zone"]
    told = summary._summary(RIG, logs, rigs, found, [zoned])
    assert told.rigs.fitted.actuator == told.rigs.refitted.actuator != rigs.fitted.actuator
    assert np.mean(told.squares["explained"]) < np.mean(told.squares["refitted"])


def test_effects_close_their_own_gap_on_parts_not_seen():
    logs = [log.between(0.0, 40.0) for log in session(11, vent=0.8)]
    first, *_ = explain_all(RIG, logs, NUMBERS.nats, ["valve_asymmetry"])
    assert cross_validated_share(first) > 0.95
    parted = [log.between(0.0, 40.0) for log in session(11, vent=0.8)[:2] + session(11)[2:]]
    second, *_ = explain_all(RIG, parted, NUMBERS.nats, ["valve_asymmetry"])
    assert cross_validated_share(second) < 0.8


def pushed(strength: float):
    """What is said of a valve that vents slowly, the output being pushed at random at the pace of the rig."""
    rng, logs = np.random.default_rng(5), []
    for log in session(3, vent=0.8, roles=("pressure",)):
        push = gaussian_filter1d(rng.normal(size=len(log)), 12.0)
        output = log["output"] + strength * push / np.std(push)
        logs.append(replace(log, signals={**log.signals, "output": output}).between(0.0, 40.0))
    return diagnose(RIG, logs, pictures=False)


@pytest.mark.long
def test_where_nothing_explains_the_larger_part_of_a_gap_it_is_unknown():
    found = pushed(0.004)
    assert found.verdict == "unknown" and not found.causes
    assert any("command to pressure: valve_asymmetry may be there as well" in note for note in found.notes)


@pytest.mark.long
def test_a_push_that_no_input_predicts_is_unknown_beside_what_is_clear():
    """Pushes far above the noise of the output."""
    found = pushed(0.0006)
    assert named(found) == [["valve_asymmetry"]]
    assert found.unexplained["pressure to output"]["pushed"]
    assert any("pressure to output: no effect explains" in note for note in found.notes)


@pytest.mark.parametrize("noise, in_vain", [(0.8, True), (0.84, False)])
def test_of_a_gap_little_above_the_noise_little_can_be_promised(noise, in_vain):
    squares = {"refitted": np.array([1.0, 1.0])}
    told = summary.Summary(None, [], {}, squares, noise**2, Improvement(0.1, (0.0, 0.5)))
    assert told.in_vain == in_vain


@pytest.mark.parametrize("explained, more", [(0.6, False), (0.7, True)])
def test_more_is_left_where_less_than_half_above_the_noise_is_closed(explained, more):
    squares = {"refitted": np.array([1.1, 0.9]), "explained": np.array([explained, explained])}
    told = summary.Summary(None, ["one"], {}, squares, 0.25, None)
    assert told.more_is_left == more
    assert not replace(told, causes=[]).more_is_left


@pytest.mark.parametrize("noise, is_there", [(0.4, True), (0.5, False)])
def test_a_path_that_is_off_by_far_more_than_noise_is_not_the_rigs_own_numbers(noise, is_there):
    """Gusts on a rig that integrates are gone from its errors at their pace, and the path keeps them."""
    squares = {"explained": np.array([1.2, 0.8])}
    told = summary.Summary(None, [], {}, squares, noise**2, None)
    assert summary._unaccounted(told) == is_there


def test_told_the_effect_it_considers_nothing_else():
    found = diagnose(RIG, session(11, vent=0.8), only=("sensor_lag", "valve_asymmetry"))
    assert {c.effect for f in found.causes for c in f.candidates} <= {"sensor_lag", "valve_asymmetry"}
    assert found.causes[0].candidates[0].effect == "valve_asymmetry"
    assert {f.effect for f in found.fits} <= {"sensor_lag", "valve_asymmetry"}
    with pytest.raises(FocgenError, match="valve_asymetry"):
        diagnose(RIG, session(11, vent=0.8), only=("valve_asymetry",))


@pytest.mark.long
def test_told_two_effects_it_takes_the_small_one_too():
    """A dead zone so small that it is not believed beside a loop."""
    logs = session(11, slip=0.35, zone=0.006)
    blind = explain_all(RIG, logs, NUMBERS.nats)[1]
    told = explain_all(RIG, logs, NUMBERS.nats, ["hysteresis", "dead_zone"])[1]
    assert [c.rivals[0].effect for c in blind.causes] == ["hysteresis"]
    assert {c.effect for c in told.best.problem.candidates} == {"hysteresis", "dead_zone"}
    assert told.best.sse < blind.best.sse


def test_the_plain_fits_rank_the_true_effect_first(drifting):
    found = drifting[0]
    assert found.fits[0].effect == "gain_drift" and found.fits[0].error < 0.7
    assert [f.error for f in found.fits] == sorted(f.error for f in found.fits)


@pytest.mark.long
def test_missing_signals_make_the_stage_an_inference():
    found = diagnose(RIG, session(5, vent=0.8, roles=()))
    assert found.where.inferred
    assert "valve_asymmetry" in {c.effect for f in found.causes for c in f.candidates}


def test_units_do_not_matter():
    logs = session(11, zone=0.045)
    from focgen.rig.rig import Actuator

    rig = replace(
        RIG,
        actuator=Actuator(1.3, 0.6, (2e-5, 3.4e-5)),
        regulator=type(RIG.regulator)([(10.0, 0.0)], RIG.regulator.den),
    )  # p in mbar·10, curvature as before
    scaled = [
        replace(log, signals={r: s * {"pressure": 100.0}.get(r, 1.0) for r, s in log.signals.items()})
        for log in logs
    ]
    assert named(diagnose(rig, scaled)) == [["dead_zone"]]


def test_session_state_carries_on(drifting):
    rig = read_rig(drifting[1] / "augmented.toml")
    assert [e["name"] for e in rig.effects] == ["gain_drift"]
    assert rig.effects[0]["clock"] > 300


@pytest.mark.long
def test_noise_alone_gathers_little_evidence():
    explained = explain_all(RIG, session(11, zone=0.045), NUMBERS.nats)[1]
    candidates = [c for c in candidates_for(explained.segment, RIG) if c.form.seen is None][::3]
    asked = threshold(explained, candidates, 3, 0.0)
    assert 0 <= asked < 40 < explained.causes[0].gain
    assert threshold(explained, candidates, 2, 1e6) == 1e6
