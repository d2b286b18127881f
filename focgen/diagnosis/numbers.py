"""The numbers that decide a diagnosis: what each means, where it is from, and what half and double of it do.

How the fits are made (tolerances, iterations, how many samples) decides nothing and stands where it is used.
The documentation prints its table from :func:`told`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

_SAME = "nothing changes"


def _number(
    value: float, meaning: str, unit: str, source: str, half: str = _SAME, double: str = _SAME
) -> Any:
    """A field with what :func:`told` says of it."""
    told = {"meaning": meaning, "unit": unit, "source": source, "half": half, "double": double}
    return field(default=value, metadata=told)


@dataclass(frozen=True)
class Numbers:
    """Every number by which a diagnosis decides. Half and double: of 140 steps and 97 causes of 127
    tuning cases, as :mod:`focgen.diagnosis.belief` decides them on the same fits. For the odds of a second
    form and the two levels of evidence: of ten cases diagnosed anew. For what makes a
    verdict ``unknown``: of 23 verdicts on the same explanations."""

    turns: float = _number(
        14.0,
        "independent values of what a form lacks of the rig",
        "count",
        "fitted",
        "2 more missed, 4 fewer right first",
        "4 more false effects, 2 more wrong above 0.9",
    )
    form: float = _number(
        0.2,
        "by what a form is wrong, of what its effects change",
        "root mean square",
        "fitted",
        "2 more false effects, 2 more wrong above 0.9",
        "3 fewer right first, sets larger by a tenth",
    )
    right: float = _number(
        0.1,
        "forms that are as good as right: a third as wrong; each free value of theirs is independent",
        "probability",
        "fitted, on steps of 52 pairs and 81 singles: 4 more pairs found, no more false effects",
        _SAME,
        _SAME,
    )
    free: float = _number(
        0.33,
        "independent values for each free one of a form",
        "count",
        "fitted",
        "1 more wrong above 0.9",
        "1 fewer right first, 1 fewer in the set",
    )
    other: float = _number(
        0.006,
        "by what noise and nominal chain are other than assumed",
        "of the noise's mean square",
        "fitted",
        "1 more wrong above 0.9",
        "at 0.03: 3 of 8 static effects of the trials unknown",
    )
    bent: float = _number(
        0.7,
        "by what a nominal curve is off as likely as an effect bends it, in other ways by a third; "
        "the odds fall with the fourth power",
        "of the noise's root mean square",
        "identified rigs of other physics, healthy: 0.3 in the median, 1.4 at most",
        "at 0.5: 3 healthy rigs of 20 of other physics wrong above 0.9",
        "not measured",
    )
    uneven: float = _number(
        0.5,
        "by what the steps of a coarse converter are uneven or sluggish, at most",
        "of a step, root mean square",
        "converters simulated",
        "1 false effect of 3 coarse converters",
        "not measured",
    )
    stepped: float = _number(
        1.0 / 6.0,
        "by what they are where even steps are simulated",
        "of a step, root mean square",
        "16 rigs with a converter alone leave 0.07 to 0.22, noise and all",
        "not measured",
        "4 of 5 effects behind converters stay hidden, by their odds",
    )
    rare: float = _number(
        3e-4,
        "odds, before the data, that an effect of a family is there",
        "odds",
        "fitted, on steps of 52 pairs and 81 singles",
        "1 pair fewer found",
        "at 0.001: 3 of 40 pairs more found, and a second effect of eleven names in a hair dryer",
    )
    again: float = _number(
        0.1,
        "odds, before the data, that an effect takes two forms of its family",
        "odds",
        "assumed",
        _SAME,
        _SAME,
    )
    behind: float = _number(
        0.5,
        "odds, before the data, that a loop or curve behind all dynamics is the actuator's, not the sensor's",
        "odds",
        "assumed; on rigs of other physics loops were the actuator's in three of four",
        "the actuator's in one of five instead of one of three",
        "either's as likely, and first whichever comes first",
    )
    elsewhere: float = _number(
        0.045,
        "probability that a cause is none of the families",
        "probability",
        "calibration of the trials",
        "1 more wrong above 0.9",
        "no set can hold 95 %: all rivals are in it",
    )
    held: float = _number(
        0.95,
        "probability that the set holds the cause",
        "probability",
        "what a set is to be",
        "at 0.9: sets smaller by a tenth, 1 fewer holds the cause",
        "–",
    )
    chance: float = _number(
        0.01, "what a regression predicts of noise by chance", "of the mean square", "noise simulated"
    )
    left: float = _number(
        0.1,
        "predicted by inputs, and more than a little wrong",
        "of the mean square",
        "identified rigs of other physics: 0.09, where healthy, but for the worst",
        "at 0.07: 2 healthy rigs of other physics unknown",
        "not measured",
    )
    much: float = _number(
        0.15,
        "predicted by inputs, and so much that the rest tells nothing of the noise",
        "of the mean square",
        "tuning cases",
        _SAME,
        "not measured",
    )
    nats: float = _number(
        12.0,
        "evidence that noise does not reach, whichever of all forms is fitted to it",
        "nats",
        "noise simulated; --bootstrap measures it",
        _SAME,
        _SAME,
    )
    kurtosis: float = _number(
        12.0,
        "fourth moment of the innovations, 3 for noise, of what comes in bursts",
        "of the variance squared",
        "healthy rigs: at most 4; single bad readings: 11",
    )
    loudest: float = _number(
        5.0,
        "mean square of the loudest response time over the usual one, of the same; "
        "where the rig moves over where it rests, of what is left",
        "ratio",
        "healthy rigs: at most 4, and 1.5 where it moves; named rightly: once 7.2, of 109 more at most 3.5; "
        "outside: 7.6, 17 and 20",
    )
    tonal: float = _number(
        0.25,
        "power in the strongest line, in the median experiment, of a tone",
        "of the power",
        "healthy rigs: at most 0.13; tones: 0.8",
    )
    low_frequency: float = _number(
        20.0,
        "power at periods beyond eight responses over that at one to four, of slow swings",
        "ratio",
        "healthy rigs: at most 9.5",
        "1 healthy rig unknown",
        _SAME,
    )
    looped: float = _number(
        6.0,
        "the same where a closed loop hides it from the inputs",
        "ratio",
        "closed loops of the tuning seeds",
        _SAME,
        _SAME,
    )
    pushed: float = _number(
        3.0,
        "root mean square over that of what is white, of what pushes the rig",
        "ratio",
        "healthy rigs: at most 2.4",
        _SAME,
        _SAME,
    )
    paced: float = _number(
        80.0,
        "power at two to ten responses over that at an eighth to half a one, of the same",
        "ratio",
        "healthy rigs: at most 40",
        _SAME,
        _SAME,
    )
    stays: float = _number(
        0.5,
        "left by effects that do not explain it: of a disturbance, or of a gap on parts not seen",
        "of the mean square",
        "tuning cases",
        _SAME,
        _SAME,
    )
    unlikely: float = _number(
        0.7,
        "left at most by an actuator far from the one given; how sure a cause beside it may be; how much of "
        "what causes close parts of the session are to foretell in others",
        "of the mean square, of the confidence",
        "tuning cases",
        _SAME,
        _SAME,
    )
    smaller: float = _number(
        0.9,
        "how sure a cause may be beside a larger one of its segment or a number moved far, "
        "with a number at its end, or where parts of the session foretell little of others",
        "of the confidence",
        "fresh rigs: 48 of 50 of the first kind right, 12 of 14 of the third, 11 of 13 of the last",
        "not measured",
        "–",
    )
    vain: float = _number(
        0.2,
        "promised part of a gap: effects that close less do not cause it; "
        "noise in the path of a rig that integrates, though nothing was found, that has another cause",
        "of the gap",
        "tuning cases",
        _SAME,
        _SAME,
    )
    above: float = _number(
        0.82,
        "noise in a gap that tells no more than noise",
        "of its root mean square",
        "tuning cases",
        _SAME,
        _SAME,
    )


NUMBERS = Numbers()


def told() -> list[tuple[str, float, dict[str, str]]]:
    """Name, value and account (meaning, unit, source, half, double) of every number, in order."""
    return [(f.name, float(getattr(NUMBERS, f.name)), dict(f.metadata)) for f in fields(NUMBERS)]
