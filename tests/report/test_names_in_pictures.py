"""Names and units from a log in pictures: whatever they are, they are drawn as they stand.

Red when a name with signs of a formula stops a picture, or is drawn as one.
"""

import subprocess

import pytest

from focgen.children import environment, python
from focgen.report.style import figure, png
from focgen.report.texts import pictured

NAMES = ("$\\frac{$ x", "$$", "a $b$ c", "\x1b[31m", "%s", "\\", "{", "^_$", "\u202e", "$" * 9)


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if turn % 2 else ()) for turn, n in enumerate(NAMES)]
)
def test_a_name_begins_no_formula(name):
    with figure(1, 1, (2.0, 1.5), squeeze=False) as (fig, grid):
        axes = grid[0, 0]
        axes.plot([0.0, 1.0], [0.0, 1.0], label=pictured(name))
        axes.set_title(f"Experiment {pictured(name)}")
        axes.set_xticks([0, 1], [pictured(name), "b"])
        axes.legend()
    assert png(fig).startswith(b"\x89PNG")


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if turn % 2 else ()) for turn, n in enumerate(NAMES)]
)
def test_a_unit_that_nobody_thought_of_is_no_fault(name):
    """What reaches a label without the rule."""
    with figure(1, 1, (2.0, 1.5), squeeze=False) as (fig, grid):
        grid[0, 0].set_xlabel(f"pressure ({name})")
    assert png(fig).startswith(b"\x89PNG")


def test_formulas_of_our_own_stay_formulas():
    with figure(1, 1, (2.0, 1.5), squeeze=False) as (fig, grid):
        title = grid[0, 0].set_title(r"T ($\mathrm{s}^\alpha$)")
    png(fig)
    assert title.get_parse_math()


def test_settings_of_the_folder_one_stands_in_change_no_picture(tmp_path):
    """matplotlib reads a ``matplotlibrc`` there, before the user's own."""
    draw = (
        "import sys; from focgen.report.style import figure, png\n"
        "with figure() as (fig, axes):\n"
        "    axes.plot([0, 1]); axes.set_title('a'); sys.stdout.buffer.write(png(fig))\n"
    )
    command = python("-c", draw)
    sound = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, check=True).stdout
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: red\nlines.marker: o\n")
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True)
    assert done.returncode == 0, done.stderr[-300:]
    assert done.stdout == sound
