"""Faults in an exponential memory's C, one at a time: the samples show each of them.

Red when a fault in modes passes unseen.
"""

import re
import shutil

import numpy as np
import pytest

from focgen.codegen.generate import generate
from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.verification.verify import verify
from tests.conftest import paper_controller
from tests.controllers import simple
from tests.verification.test_mutations import Fault, neighbour, sow

ARITHMETICS = ("q31", "q15", "f32")
FIXED, SLOW = ("q31", "q15"), ("q31", "q15", "f32")
SAMPLES = 4000
ASKED = {"memory": "exponential", "tolerance": 1e-3, "horizon": 10**6}

FAULTS = (
    Fault("the present sample in place of the past one", "@.c", r"(past = .*), 1\)\];", r"\1, 0)];"),
    Fault("a mode left out", "@.c", r"(numerator_means, )(\d+), past", r"\1\2 - 1, past"),
    Fault("slow modes left out", "@.c", r"sum \+= (foc_\w+\()+.*numerator_slow_modes[^;]*;", "", SLOW),
    Fault(
        "reset forgets the means",
        "@.c",
        r"s->numerator_means\[i\] = [^;]*;",
        "s->numerator_means[i] = 0;",
    ),
    Fault("reset keeps the slow means", "@.c", r"s->numerator_slow_means\[i\] = [^;]*;", "(void)i;"),
    Fault("reset keeps the rests", "@.c", r"s->numerator_slow_rests\[i\] = [^;]*;", "", ("f32",)),
    Fault("a mean with a bit less", "@.c", r"(numerator_means, \d+, past,\s+)(\d+), ", r"\1\2 - 1, ", FIXED),
    Fault("a drive with a bit less", "@.c", r"(means, \d+, past,\s+\d+,\s+)(\d+)", r"\1\2 + 1", FIXED),
    Fault(
        "slow rates as the fast ones",
        "@.c",
        r"(slow_means, \d+,\s+past,\s+\d+,\s+\d+,\s+)18\)",
        r"\g<1>17)",
        ("q31",),
    ),
    Fault("a bank's scale", "@.c", r"(means, \d+,\s+past[^;]*\), )(\d+)\);", r"\1\2 + 1);", FIXED),
    Fault("means stand still", "foc_memory.h", r"means\[i\] (\+)?= [^;]*;", ""),
    Fault(
        "drive truncated",
        "foc_memory.h",
        r"foc_shift(\d\d)\(now - means\[i\], to_drive\)",
        "((now - means[i]) >> to_drive)",
        FIXED,
    ),
    Fault(
        "drive after the update",
        "foc_memory.h",
        r"(sum \+= modes\[i\]\.weight) \* drive",
        r"\1 * (u - means[i])",
        ("f32",),
    ),
    Fault("rests not taken up", "foc_memory.h", r"rests\[i\] = step - [^;]*;", "rests[i] = 0.0f;", ("f32",)),
    Fault(
        "compensation the other way",
        "foc_memory.h",
        r"step - \(mean - means\[i\]\)",
        "(mean - means[i]) - step",
        ("f32",),
    ),
    Fault("weights in double", "foc_memory.h", r"float sum = 0\.0f;", "double sum = 0.0;", ("f32",)),
)

BOTH = (
    Fault("change is the sample", "@.c", r"(change = [^-;]*) - [^;]*;", r"\1;"),
    Fault("change over two samples", "@.c", r"(change = .*), 2\)\];", r"\1, 1)];"),
    Fault("denominator's modes left out", "@.c", r"sum \+= (foc_\w+\()+.*denominator_modes_1[^;]*;", ""),
    Fault(
        "rest of the filtered error",
        "@.c",
        r"s->denominator_means_2\[i\] = [^;]*;",
        "s->denominator_means_2[i] = 0;",
    ),
    Fault("means of the error in the denominator", "@.c", r"past = s->filtered\[", "past = s->error["),
)


def both():
    """Orders below and above 1, above and below the line."""
    transfer = TransferFunction([(0.01, 1.4), (0.3, 0.5), (1.0, 0.0)], [(0.004, 1.7), (0.1, 0.9), (1.0, 0.0)])
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-30.0, 30.0))
    return simple(transfer, name="both", ranges=ranges)


CONTROLLERS = {"spba": paper_controller(), "both": both()}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound")
    for name, controller in CONTROLLERS.items():
        for arithmetic in ARITHMETICS:
            generate(controller, folder / f"{name}_{arithmetic}", arithmetic, **ASKED)
            assert verify(folder / f"{name}_{arithmetic}", SAMPLES).holds
    return folder


def cases():
    """Every other fault in one arithmetic, by turns; the others are in the long suite."""
    for name, faults in (("spba", FAULTS), ("both", BOTH)):
        for turn, fault in enumerate(faults):
            for i, arithmetic in enumerate(fault.where):
                here = turn % 2 == 0 and i == turn // 2 % len(fault.where)
                marks = () if here else pytest.mark.long
                yield pytest.param(name, arithmetic, fault, id=f"{name}-{arithmetic}-{fault}", marks=marks)


@pytest.mark.parametrize("name, arithmetic, fault", list(cases()))
def test_a_fault_shows_in_the_samples(sound, tmp_path, name, arithmetic, fault):
    folder = shutil.copytree(sound / f"{name}_{arithmetic}", tmp_path / "broken")
    sow(folder, name, fault)
    found = verify(folder, SAMPLES, edited=True)
    assert found.targets["host"].mismatches > 0 and not found.agrees and len(found.differences) == 1


def tenth_more(number: str) -> str:
    return f"{float(number[:-1]) * 1.1:.9g}f" if number.endswith("f") else str(int(number) * 11 // 10)


@pytest.mark.parametrize(
    "mode, which, arithmetic",
    [
        pytest.param(*case, arithmetic, marks=() if i == j else pytest.mark.long)
        for i, case in enumerate([(0, 1), (-1, 1), (-1, 2)])
        for j, arithmetic in enumerate(ARITHMETICS)
    ],
)
def test_one_rate_or_weight_wrong(sound, tmp_path, arithmetic, mode, which):
    """A rate by its last digit, of the slowest mode, too: what it keeps shows, though no output does. The
    slowest one's weight by a tenth: its last digit is far below that of anything that is kept.
    """
    folder = shutil.copytree(sound / f"spba_{arithmetic}", tmp_path / "broken")
    path = folder / "spba.c"
    text = path.read_text()
    rows = list(re.finditer(r"\{ *([-\d.e]+f?), *([-\d.e]+f?)\}, /\* [\d.e+]+ s \*/", text))
    begin, end = rows[mode].span(which)
    wrong = neighbour(text[begin:end]) if which == 1 else tenth_more(text[begin:end])
    path.write_text(text[:begin] + wrong + text[end:])
    assert verify(folder, SAMPLES, edited=True).targets["host"].mismatches > 0


def test_the_memory_of_another_version_is_not_the_one_that_was_proved(sound, tmp_path):
    folder = shutil.copytree(sound / "spba_q31", tmp_path / "broken")
    with open(folder / "foc_memory.h", "a") as runtime:
        runtime.write("/* improved */\n")
    found = verify(folder, 500, edited=True)
    assert found.targets["host"].mismatches == 0 and found.differences and not found.holds


@pytest.mark.parametrize(
    "key, value", [("tolerance", 1e-2), ("horizon", 10**5), ("memory", "short"), ("states", 3)]
)
def test_a_manifest_that_tells_of_another_memory(sound, tmp_path, key, value):
    import json

    folder = shutil.copytree(sound / "spba_q15", tmp_path / "broken")
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps({**manifest, key: value}))
    assert not verify(folder, 500).holds


def test_rates_are_the_plan_s_own(sound):
    """What the comments beside the table say: the time constants of the poles in the plan."""
    from focgen.verification.folder import read_folder

    read = read_folder(sound / "spba_q31")
    text = (sound / "spba_q31" / "spba.c").read_text()
    said = [float(t) for t in re.findall(r"\}, /\* ([\d.e+]+) s \*/", text)]
    poles = np.array(read.plan.memories[0].poles)
    np.testing.assert_allclose(said, -0.01 / np.log(poles), rtol=1e-3)
