"""A diagnosis in sentences: each says what the numbers say, in the log's units.

Red when a sentence says another number, unit or certainty than the diagnosis.
"""

from dataclasses import replace

from focgen.diagnosis.model import Candidate, Diagnosis, Estimate, Found, Gap, NextExperiment, PlainFit, Where
from focgen.report.diagnosis_summary import diagnosis_text
from focgen.report.results.findings import _candidates

UNITS = {"command": "V", "pressure": "bar", "curvature": "1/mm", "output": "1/mm"}
CEILING = Candidate(
    "supply_saturation",
    "regulator",
    0.9,
    "hard",
    {
        "ceiling": Estimate(0.152, (0.151, 0.153), "bar"),
        "width": Estimate(0.1, (-3.0, 3.2), "bar"),
    },
    0.0,
)
FOUND = Diagnosis(
    verdict="named",
    where=Where("regulator", False, {"regulator": 0.9}, {}),
    causes=(Found("regulator", (CEILING,), 0.8, (0.7, 0.9)),),
    gap=Gap(0.002, 0.0018, 0.0005, 0.0004, "kappa_per_mm", {}),
    shrink=0.85,
    shrink_interval=(0.8, 0.9),
    refitted_rig="refitted.toml",
    augmented_rig="augmented.toml",
    next_experiment=None,
    unexplained={},
    notes=("a note",),
    fits=(PlainFit("creep", 0.55), PlainFit("leak", 0.9)),
)


def test_where_which_with_its_size_how_far_and_what_next():
    text = diagnosis_text(FOUND, UNITS, "gap")
    assert "Where: the regulator with 90% of the gap, seen in its own signals." in text
    assert "supply_saturation in the regulator (ceiling 0.152 ± 0.001 bar), 90% confident" in text
    assert "width" not in text  # its interval says nothing
    assert "off by 0.002 1/mm as given" in text and "85% (80% to 90%)" in text
    assert "focgen replay augmented.toml LOG" in text and "note: a note" in text and "nearest" not in text


def test_what_brings_the_output_no_closer_is_said_to():
    cause = replace(FOUND.causes[0], shrink=-0.9)
    text = diagnosis_text(
        replace(FOUND, causes=(cause,), shrink=-0.9, shrink_interval=(-1.0, -0.6)), UNITS, "gap"
    )
    assert "0% of the gap" in text and "-90%" not in text
    assert "On new experiments it brings the output no closer (-100% to -60%)." in text


def test_what_nothing_explains_is_said_with_the_nearest_family_once():
    left = {
        "command to pressure": {"depends_on": ["level"], "low_frequency": True},
        "pressure to output": {
            "depends_on": ["nothing"],
            "slow_swings": False,
            "tonal": True,
            "bursts": True,
        },
    }
    text = diagnosis_text(
        replace(FOUND, verdict="unknown", causes=(), unexplained=left, shrink=None), UNITS, "gap"
    )
    assert "it goes with level, slow swings that no input predicts" in text
    assert "it goes with a tone that no input predicts, bursts that no input predicts" in text
    assert "depends on nothing" not in text and text.count("nearest: creep, which by itself leaves 55%") == 1


def test_beside_what_was_found_the_nearest_family_is_not_said_for_all_places_at_once():
    left = {"pressure to output": {"depends_on": ["time"]}}
    text = diagnosis_text(replace(FOUND, unexplained=left), UNITS, "gap")
    assert (
        "something from pressure to output that no effect of the library explains; it goes with time" in text
    )
    assert "nearest" not in text


def test_healthy_and_refitted_rigs_name_no_effect():
    healthy = replace(FOUND, verdict="none", causes=(), where=Where(None, False, {}, {}), shrink=None)
    assert "Which: no effect." in diagnosis_text(healthy, UNITS, "gap")
    refitted = replace(FOUND, verdict="parameters", causes=())
    assert "the rig's own numbers were off, and refitted.toml" in diagnosis_text(refitted, UNITS, "gap")


def test_the_next_experiment_is_said_with_the_file_that_makes_it():
    what = "steps, on the command from 0 to 2 V"
    asked = NextExperiment("telling leak from contact", what, 5.0, {"file": "a.csv"})
    text = diagnosis_text(replace(FOUND, next_experiment=asked), UNITS, "gap")
    assert f"Next: record {what} (its input: a.csv), for telling leak from contact." in text
    assert "check the promise" not in text


def test_a_cause_that_is_not_likely_is_said_not_to_be():
    faint = replace(FOUND.causes[0], candidates=(replace(CEILING, confidence=0.4),))
    texts = [diagnosis_text(replace(FOUND, causes=c), UNITS, "gap") for c in ((faint,), FOUND.causes)]
    assert ["likelier it is something else, as the notes say" in text for text in texts] == [True, False]


def test_an_effect_is_told_by_its_sizes_where_it_has_any():
    sized = replace(CEILING, sizes={"share lost at the highest input": Estimate(12.0, (11.0, 13.0), "%")})
    text = diagnosis_text(
        replace(FOUND, causes=(replace(FOUND.causes[0], candidates=(sized,)),)), UNITS, "gap"
    )
    assert "in the regulator (share lost at the highest input 12 ± 1 %), 90% confident" in text
    assert "ceiling" not in text


def test_the_table_has_each_number_once():
    known = Estimate(0.152, (0.14, 0.16), "bar")
    both = replace(CEILING, sizes={"ceiling": known, "further lag": Estimate(1.0, (0.9, 1.1), "s")})
    cause = replace(FOUND.causes[0], candidates=(both, replace(CEILING, parameters={})))
    rows = _candidates(replace(FOUND, causes=(cause,)))
    assert [row["parameter"] for row in rows] == ["ceiling", "further lag", "width", None]
    assert rows[0]["low"] == 0.14  # the size's, which allows for the form
