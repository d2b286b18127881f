"""Sums that look ahead: the layout against its definition, the C of every core's folder against the
reference.

Red when a sum that looks ahead takes a tap twice, leaves one out, or gives other bits than the portable
form.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focgen.codegen.generate import folder_files, generate
from focgen.codegen.kernels import TARGETS, Kernels, named_sums
from focgen.codegen.lookahead import AHEAD, look_ahead
from focgen.control.files import controller_text
from focgen.errors import InputError, PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.scenario import to_raw
from focgen.verification.compare import compare
from focgen.verification.folder import read_folder
from focgen.verification.host import Library
from tests.c_code import SANITISERS, STRICT, compiler, run, tool
from tests.conftest import paper_controller
from tests.controllers import random_controller, random_scenario

FINGER = Path(__file__).parents[1] / "golden" / "finger.toml"
FIXED = ("q15", "q31")
CORES = {"q15": "cortex-m4", "q31": "cortex-m4", "f32": "cortex-m7"}  # cores whose sums look ahead


def with_length(seed: int, length: int):
    return replace(random_controller(seed, 300), length=length)


def planned(seeds, lengths):
    """Random controllers of given lengths, in every arithmetic that can carry them and looks ahead."""
    found = []
    for seed, length in zip(seeds, lengths):
        for arithmetic in CORES:
            try:
                found.append(build_plan(with_length(seed, length), arithmetic, name=f"k{seed}_{arithmetic}"))
            except PlanError:
                continue
    return found


def compiled(plans, folder: Path, flags=("-std=c99", "-O1", "-ffp-contract=off")) -> Library:
    for plan in plans:
        kernels = Kernels(CORES[plan.arithmetic])
        write_files(folder, folder_files(plan, controller_text(plan.controller).encode(), kernels=kernels))
    return Library(plans, [folder] * len(plans), flags)


# ------------------------------------------------------------------------------------------------ layout


@pytest.mark.parametrize("arithmetic", CORES)
@pytest.mark.parametrize("length", [40, 47, 48, 49, 63, 64, 65, 66, 67, 127, 250, 1000, 1023, 1024])
def test_the_layout_is_the_sum(length, arithmetic):
    """Every weight meets its sample once in each of the four sums, tile by tile, in rising order of time."""
    plan = build_plan(paper_controller(length), arithmetic)
    table = plan.direct
    ahead = look_ahead(table)
    if ahead is None:
        assert length < 50
        return
    flat = [w for block in ahead.weights for w in block]
    met = {i: {} for i in range(AHEAD)}
    for run_ in ahead.runs:
        assert run_.tiles >= 1 and run_.back - run_.tiles >= 1, "only samples that are known"
        for j in range(AHEAD * run_.tiles):
            for i in range(AHEAD):
                lag = i + AHEAD * run_.back - j
                weight = flat[run_.weights + j + 4 - i]
                if weight:
                    assert lag not in met[i]
                    met[i][lag] = (weight, run_.shift)
    near = {} if ahead.near is None else lags_of(ahead.near)
    expected = {lag: entry for lag, entry in lags_of(table).items() if entry[0]}
    for i in range(AHEAD):
        assert {**met[i], **{lag: e for lag, e in near.items() if e[0]}} == expected
        assert list(met[i]) == sorted(met[i], reverse=True)


def lags_of(table):
    """Weight and shift by lag."""
    return {block.first + i: (w, block.align) for block in table.blocks for i, w in enumerate(block.weights)}


@pytest.mark.parametrize("arithmetic", CORES)
def test_the_work_is_shared_evenly(arithmetic):
    ahead = look_ahead(build_plan(paper_controller(1024), arithmetic).direct)
    tiles = [sum(r.tiles for r in ahead.runs[a:b]) for a, b in zip(ahead.slices, ahead.slices[1:])]
    assert len(tiles) == AHEAD and max(tiles) <= 1.15 * sum(tiles) / AHEAD


# --------------------------------------------------------------------------------------------- same bits


LENGTHS = [*range(22, 26), 40, *range(46, 53), *range(61, 69), 95, 99, 100, *range(126, 131), 200, 257]


FEW = (24, 63, 66, 100, 129, 257)  # every remainder of a tile


@pytest.mark.parametrize(
    "seeds",
    [
        [LENGTHS.index(length) for length in FEW],
        *(pytest.param(range(third, 30, 3), marks=pytest.mark.long) for third in range(3)),
    ],
    ids=["few", "0", "1", "2"],
)
def test_random_controllers_agree_in_every_bit(seeds, tmp_path):
    """Lengths about the edges of tiles and blocks, every remainder of a tile in each third of them; resets
    and tracks in the middle of a group.
    """
    lengths = [LENGTHS[seed] for seed in seeds]
    assert {length % AHEAD for length in lengths} == set(range(AHEAD))
    plans = planned(seeds, lengths)
    looking = [p for p in plans if Kernels(CORES[p.arithmetic]).headers(p)]
    assert len(looking) >= 1.8 * len(lengths)
    library = compiled(looking, tmp_path)
    for plan in looking:
        result = compare(plan, library, 4000, seed=2, kernels=Kernels(CORES[plan.arithmetic]))
        assert result.mismatches == 0, f"{plan.name}, {plan.length}: {result.first}"


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in (1, 2))])
def test_resets_and_tracks_at_any_step_of_a_group(seed, tmp_path):
    """The look-ahead and the plain C over the same inputs, with many resets."""
    plans = planned([seed, seed + 10, seed + 20], [64, 77, 130])
    ahead = compiled(plans, tmp_path / "ahead")
    plain = tmp_path / "plain"
    for plan in plans:
        write_files(plain, folder_files(plan, b""))
    reference = Library(plans, [plain] * len(plans))
    for plan in plans:
        physical = random_scenario(plan.controller, seed, lanes=6, samples=700)
        many = tuple(replace(r, sample=s) for r in physical.resets for s in range(r.sample % 50, 700, 53))
        scenario = to_raw(plan, replace(physical, resets=many))
        one, other = ahead.run(plan, scenario), reference.run(plan, scenario)
        assert np.array_equal(one.u, other.u) and np.array_equal(one.d, other.d), plan.name


@pytest.mark.parametrize("part", [0, *(pytest.param(p, marks=pytest.mark.long) for p in (1, 2, 3))])
def test_no_undefined_behaviour(part, tmp_path):
    """Under the sanitizers of gcc, run as a program; each length in an arithmetic of its own here."""
    command, plans = compiler("gcc", *SANITISERS), planned([1, 12, 25], [64, 100, 129])
    for plan in plans[part::4]:
        kernels = Kernels(CORES[plan.arithmetic])
        write_files(tmp_path, folder_files(plan, b"", kernels=kernels))
        name, sched = plan.name, ", k * 7" if plan.schedule else ""
        (tmp_path / f"{name}_main.c").write_text(
            f'#include "{name}.h"\nstatic {name}_state s;\nint main(void) {{ int k; {name}_init(&s);'
            f"for (k = 0; k < 3000; k++) {{ if (k % 301 == 300) {name}_reset(&s, 1, 0, 0);"
            f"(void){name}_step(&s, ({name}_sig)((k * 7919) % 30000), ({name}_sig)(k % 11 * 900){sched}); }}"
            " return 0; }\n"
        )
        sources = [tmp_path / f"{name}_main.c", tmp_path / f"{name}.c"]
        run(*command, "-std=c99", "-O1", *SANITISERS, *sources, "-o", tmp_path / name)
        run(tmp_path / name)


# ----------------------------------------------------------------------------------------------- folders


def folders():
    """Every core in every arithmetic; of the two fixed ones by turns, the other in the long suite."""
    for i, arithmetic in enumerate(("q31", "q15", "f32", "f64")):
        for turn, target in enumerate(TARGETS):
            marks = () if arithmetic[0] == "f" or turn % 2 == i else pytest.mark.long
            yield pytest.param(arithmetic, target, marks=marks)


@pytest.mark.parametrize("arithmetic, target", list(folders()))
def test_a_folder_for_a_core_is_whole(target, arithmetic, tmp_path):
    """It is read back without a difference, and compiles without a warning."""
    made = generate(FINGER, tmp_path, arithmetic, length=100, target=target, name="finger")
    assert read_folder(tmp_path).differences == ()
    assert made.manifest["kernels"]["target"] == target
    forms = {entry["form"] for entry in made.manifest["kernels"]["sums"].values()}
    unit = target in ("cortex-m4", "cortex-m7")
    plain = target == "avr" or arithmetic == "f64" or (arithmetic == "f32" and not unit)
    halves = (target, arithmetic) == ("cortex-m0plus", "q31")
    assert forms == {"plain" if plain else "halves" if halves else "look-ahead"}
    if not plain:
        run(*compiler("gcc"), *STRICT, "-O2", "-c", tmp_path / "finger.c", "-o", tmp_path / "x.o")


@pytest.mark.parametrize("arithmetic", CORES)
def test_what_it_costs_is_in_the_manifest(arithmetic, tmp_path):
    """State and tables, weighed by the compiler."""
    made = generate(FINGER, tmp_path, arithmetic, length=100, target=CORES[arithmetic], name="finger")
    (tmp_path / "size.c").write_text(
        '#include <stdio.h>\n#include "finger.h"\n'
        'int main(void) { printf("%d", (int)sizeof(finger_state)); return 0; }\n'
    )
    run(*compiler("gcc"), "-std=c99", tmp_path / "size.c", "-o", tmp_path / "size.exe")
    sizes = made.manifest["sizes"]
    assert int(run(tmp_path / "size.exe")) == sizes["state_bytes"]
    run(*compiler("gcc"), "-std=c99", "-O0", "-c", tmp_path / "finger.c", "-o", tmp_path / "x.o")
    tables = [line.split() for line in run(tool("nm"), "-S", tmp_path / "x.o").splitlines() if " r " in line]
    assert sum(int(bytes_, 16) for _, bytes_, _, _ in tables) == sizes["table_bytes"]
    sums = made.manifest["kernels"]["sums"]
    assert set(sums) == set(named_sums(made.plan))
    assert all(entry["state_bytes"] > 0 for entry in sums.values())


def test_an_unknown_core_is_refused(tmp_path):
    with pytest.raises(InputError, match="z80.*cortex-m4"):
        generate(FINGER, tmp_path / "out", target="z80")
    assert not (tmp_path / "out").exists()


# ------------------------------------------------------------------------------------------------ faults


FAULTS = {
    "a tile too early": ("foc_tiles.h", "now / 4u + 1u", "now / 4u"),
    "a sum of the step before": ("k.c", "ahead[s->error_now & 3u]", "ahead[(s->error_now + 1u) & 3u]"),
    "no turn": ("foc_ahead_q15.h", "if (step == 0u) {", "if (step == 1u) {"),
    "the block's sum kept": ("foc_ahead_q15.h", "ahead[8u + i] = 0;", ""),
    "the ring's end": ("foc_ahead_q15.h", "if (tiles <= straight) {", "if (tiles <= straight + 1u) {"),
    "a weight beside": ("foc_ahead_q15.h", "d = weights[0];", "d = weights[1];"),
    "no rest": ("foc_ahead_q15.h", "0, slices[4]", "0, slices[3]"),
    "the latest samples": ("foc_ahead_q15.h", "copy[i] = ring[slot];", "copy[i] = ring[0];"),
}


@pytest.mark.parametrize(
    "fault", [pytest.param(f, marks=pytest.mark.long if turn % 2 else ()) for turn, f in enumerate(FAULTS)]
)
def test_a_fault_is_seen(fault, tmp_path):
    file, old, new = FAULTS[fault]
    plan = build_plan(paper_controller(100), "q15", name="k")
    write_files(tmp_path, folder_files(plan, b"", kernels=Kernels("cortex-m4")))
    text = (tmp_path / file).read_text()
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new))
    library = Library([plan], [tmp_path])
    assert compare(plan, library, 2000, seed=0, kernels=Kernels("cortex-m4")).mismatches > 0
