"""The look of pictures: labels of a logarithmic axis stay apart, however narrow its range.

Red when two labels of an axis touch.
"""

import pytest

pytest.importorskip("matplotlib")

from itertools import pairwise

from focgen.report.style import figure, sparse_ticks


@pytest.mark.parametrize(
    "high",
    [
        21.0,
        pytest.param(30.0, marks=pytest.mark.long),
        pytest.param(70.0, marks=pytest.mark.long),
        pytest.param(110.0, marks=pytest.mark.long),
        500.0,
        pytest.param(1900.0, marks=pytest.mark.long),
        pytest.param(2.5e4, marks=pytest.mark.long),
        pytest.param(3e8, marks=pytest.mark.long),
    ],
)
def test_labels_of_a_logarithmic_axis_do_not_overlap(high):
    with figure(1, 2, size=(7.6, 3.9)) as (fig, (left, _)):
        left.plot([20.0, high], [1.0, 2.0])
        left.set_xscale("log")
        sparse_ticks(left.xaxis)
        fig.canvas.draw()
        ticks = [*left.xaxis.get_major_ticks(), *left.xaxis.get_minor_ticks()]
        low, top = left.get_xlim()
        shown = [t.label1 for t in ticks if t.label1.get_text() and low <= t.get_loc() <= top]
        boxes = sorted((label.get_window_extent() for label in shown), key=lambda box: box.x0)
    assert len(boxes) >= 2
    assert all(a.x1 + 2.0 < b.x0 for a, b in pairwise(boxes))
