"""``operator`` and ``band`` in ``controller.toml``: read, written, overridden, refused.

Red when an operator or a band gets lost between file, option and plan.
"""

import re

import pytest

from focgen.codegen.generate import generate
from focgen.control.files import controller_text, read_controller
from focgen.errors import ControllerError
from focgen.fractional.transfer import TransferFunction
from focgen.verification.verify import verify
from tests.controllers import simple


def written(folder, **changes):
    """A controller's file with an exponential memory, and changes to its text."""
    plain = simple(TransferFunction([(1.0, 0.6), (1.0, 0.0)]), memory="exponential", integrator=True)
    path = folder / "controller.toml"
    lines = controller_text(plain).replace("horizon = 1000000\n", "").replace("tolerance = 0.0001\n", "")
    path.write_text("".join(f"{key} = {value}\n" for key, value in changes.items()) + lines)
    return path


def test_the_file_names_operator_and_band_and_the_options_override_it(tmp_path):
    path = written(tmp_path, operator='"continuous"', band=[0.05, 20.0])
    made = generate(path, tmp_path / "own", "q31").manifest
    assert (made["operator"], made["band"], made["tolerance"]) == ("continuous", [0.05, 20.0], 1e-3)
    controller = read_controller(path)
    assert controller_of(controller_text(controller), tmp_path) == controller
    other = generate(path, tmp_path / "other", "q31", band=(0.1, 10.0), tolerance=1e-2).manifest
    assert (other["operator"], other["band"], other["tolerance"]) == ("continuous", [0.1, 10.0], 1e-2)
    gl = generate(path, tmp_path / "gl", "q31", operator="gl").manifest
    assert (gl["operator"], gl["tolerance"], gl["horizon"]) == ("gl", 1e-4, 1_000_000) and "band" not in gl
    short = generate(path, tmp_path / "short", "q31", memory="short", length=50).manifest
    assert short["operator"] == "gl"
    for folder in ("own", "gl"):
        assert verify(tmp_path / folder, 200).targets["host"].sound


def controller_of(text, folder):
    (folder / "again.toml").write_text(text)
    return read_controller(folder / "again.toml")


@pytest.mark.parametrize(
    "changes, said",
    (
        ({"band": [0.05, 20.0]}, 'belongs to operator = "continuous"'),
        ({"operator": '"continuous"', "horizon": 1000}, 'belongs to operator = "gl"'),
        ({"operator": '"oustaloup"'}, "choose one of gl, continuous"),
        ({"operator": '"continuous"', "band": [20.0, 0.05]}, "low < high"),
        ({"operator": '"continuous"', "band": [0.05, 20.0, 30.0]}, "low < high"),
    ),
)
def test_a_file_that_asks_for_what_cannot_be_is_refused(changes, said, tmp_path):
    with pytest.raises(ControllerError, match=re.escape(said)):
        read_controller(written(tmp_path, **changes))
