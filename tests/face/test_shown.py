"""Results that show themselves: one line, a table that is escaped, figures of the same data, data frames.

Red when a table shows what the result does not hold, or a name in it becomes markup.
"""

import sys
from dataclasses import replace
from html.parser import HTMLParser
from importlib.util import find_spec

import numpy as np
import pytest

import focgen
from focgen.errors import InputError, MissingExtra
from focgen.jsontext import plain
from focgen.report.figures import Area, Axis, Bars, Figure, Line, Panel, Rule
from focgen.report.page import TableOf
from focgen.report.still import still
from focgen.resources import shipped
from focgen.shown import Shown
from focgen.targets.cost import Cost, PerStep
from focgen.trials.rows import Row
from focgen.trials.score import Scores, Summary
from focgen.verification.costs import ControllerCost, Costs
from tests.report_samples import diagnosis, signals

EXAMPLES = shipped("examples")
RIG, LOG, CONTROLLER = EXAMPLES / "rig.toml", EXAMPLES / "logs" / "steps.csv", EXAMPLES / "controller.toml"
NASTY = "<b>&$x$"
KINDS = (
    "Proposal",
    "Identification",
    "Design",
    "Simulation",
    "Generated",
    "Verification",
    "Costs",
    "Diagnosis",
    "Replay",
    "Study",
    "Summary",
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """One of each kind, by its name."""
    folder = tmp_path_factory.mktemp("firmware")
    session = focgen.read_logs(RIG, LOG, to=10.0)[::3]
    found = focgen.identify(replace(focgen.read_rig(RIG), name=NASTY), session, integer=False)
    controller = focgen.read_controller(CONTROLLER)
    made = focgen.generate(controller, folder, length=50)
    small = {"lengths": (20,), "memory": ("short",), "arithmetic": ("f64",), "sample_times": (0.05,)}
    cost = Cost(
        compiler="zig", instructions_per_step=PerStep(310.5, 400.0, 1000, "counted"), flash_bytes=2100
    )
    targets = {"cortex-m4": cost, "avr": Cost(skipped="no compiler")}
    rows = (Row("named", 0.9, (0.8, 0.95), 20, "≥ 0.85", True), Row("set", None, None, 0, "", None))
    scores = Scores("cases", "C", "full", 7, 20, 1, 0, rows, {"leak": {"leak": 3, "creep": 1}}, ())
    return {
        "Proposal": focgen.init(LOG, name="spba"),
        "Identification": found,
        "Design": focgen.design(RIG, setpoints=[0.006, 0.012]),
        "Simulation": focgen.simulate(RIG, controller, [0.006, 0.01]),
        "Generated": made,
        "Verification": focgen.verify(made.folder, samples=200),
        "Costs": Costs((ControllerCost(folder, "spba", "q31", "short", 50, targets, {}),)),
        "Diagnosis": replace(diagnosis(), drawn=signals(200)),
        "Replay": focgen.replay(RIG, session),
        "Study": focgen.study("memory", controller, jobs=1, **small),
        "Summary": Summary((scores,)),
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_result_is_one_line(results, kind):
    line = repr(results[kind])
    assert line.startswith(f"<{kind} ") and line.endswith(">") and "\n" not in line and len(line) < 260
    assert isinstance(results[kind], Shown)


def test_the_lines_hold_the_figures_that_matter(results):
    joint, replayed = results["Identification"].joint, results["Replay"]
    mean = np.mean([one.gof for one in replayed.logs.values()])
    for kind, piece in {
        "Proposal": "spba: command u_V, pressure p_bar",
        "Identification": f"T {joint.T:.4g}, α {joint.alpha:.4g}, GOF",
        "Design": f"settles in {results['Design'].settling_s:.4g} s",
        "Simulation": "2 of 2 set points settle",
        "Generated": f"{results['Generated'].manifest['sizes']['state_bytes']} B state",
        "Verification": "q31, verified, samples equal: host",
        "Costs": "cortex-m4 310",
        "Diagnosis": diagnosis().causes[0].candidates[0].effect,
        "Replay": f"GOF {mean:.3f} of 2 experiments",
        "Study": "1 variants",
        "Summary": "C full: 20 cases, 1 of 1 targets reached",
    }.items():
        assert piece in repr(results[kind]), kind


class _Strict(HTMLParser):
    """What is open, and the text; ends that do not match are a fault."""

    def __init__(self):
        super().__init__()
        self.open, self.text, self.tags = [], [], set()

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.tags.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def cell_of(found):
    page = _Strict()
    page.feed(found._repr_html_())
    assert not page.open and page.tags <= {
        "div",
        "p",
        "small",
        "table",
        "caption",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
    }
    return "".join(page.text), page.tags


@pytest.mark.parametrize("kind", KINDS)
def test_a_notebook_shows_a_sentence_and_a_small_table(results, kind):
    text, tags = cell_of(results[kind])
    assert "table" in tags and len(results[kind]._repr_html_()) < 20_000
    assert text.split(".")[0].strip()


def test_what_a_user_named_is_text_in_a_cell(results):
    found = results["Replay"]
    (_name, one), *_ = found.logs.items()
    nasty = replace(found, logs={NASTY: one}, warnings=("<script>",) * 9)
    text, tags = cell_of(nasty)
    assert NASTY in text and "<script>" in text and "b" not in tags and "5 more" in text


def test_a_long_table_says_what_is_left_out(results):
    (_name, one), *_ = results["Replay"].logs.items()
    text, _ = cell_of(replace(results["Replay"], logs={f"case {i:02}": one for i in range(50)}))
    assert "case 19" in text and "case 20" not in text and "30 more rows in to_frame()" in text


@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_is_drawn(results, kind):
    if kind == "Proposal":
        with pytest.raises(InputError, match=r"Proposal: has no figure; look at its numbers: to_frame\(\)"):
            results[kind].plot()
        return
    for which in range(20):
        try:
            figure = results[kind].plot(which)
        except InputError as end:
            assert which > 0 and f"{kind}.plot: has no figure {which}; choose one of 0 (" in str(end)
            break
        assert figure.axes and (which or figure._repr_png_().startswith(b"\x89PNG"))
    for wrong in (-1, 99, True, "0"):
        with pytest.raises(InputError, match="choose one of"):
            results[kind].plot(wrong)


def test_figures_hold_the_results_own_numbers(results):
    simulation, replayed = results["Simulation"], results["Replay"]
    drawn = [line.get_ydata() for line in simulation.plot().axes[0].lines]
    ends = [y[-1] for y in drawn if len(y) > 2]
    assert all(np.isclose(ends, simulation.running.output[-1, i], rtol=0.02).any() for i in range(2))
    (log, *_), (name, *_) = replayed.experiments, replayed.logs
    top, bottom = replayed.plot().axes
    assert any(np.isclose(line.get_ydata().max(), log["output"].max()) for line in top.lines)
    left = log["output"] - replayed.simulated[name]["output"]
    assert any(np.isclose(np.ptp(line.get_ydata()), np.ptp(left), rtol=0.05) for line in bottom.lines)
    assert top.get_ylabel() == "output (1/mm)" and bottom.get_xlabel() == "time (s)"


def test_frames_hold_every_number(results):
    pandas = pytest.importorskip("pandas")
    frames = {kind: results[kind].to_frame() for kind in KINDS}
    assert all(isinstance(frame, pandas.DataFrame) and len(frame) for frame in frames.values())
    found, design = results["Identification"], results["Design"]
    assert list(frames["Identification"]["T"]) == [fit.T for fit in found.experiments]
    assert list(frames["Identification"]["K_low"]) == [fit.ci95["K"][0] for fit in found.experiments]
    assert frames["Design"]["settling_s"].mean() == pytest.approx(design.settling_s)
    assert list(frames["Proposal"]["role"])[:3] == ["time", "command", "pressure"]
    assert str(results["Proposal"]) == results["Proposal"].text
    assert list(frames["Simulation"]["reference"]) == [0.006, 0.01]
    assert frames["Verification"].loc[0, "mismatches"] == 0
    assert list(frames["Costs"]["skipped"].dropna()) == ["no compiler"]
    assert frames["Costs"]["instructions_per_step"][0] == 310.5
    assert list(frames["Replay"]["rmse"]) == [one.rmse for one in results["Replay"].logs.values()]
    assert frames["Study"].loc[0, "error_step"] == results["Study"].rows[0].errors["step"]
    assert list(frames["Summary"]["score"]) == ["named", "set"]
    sizes = frames["Diagnosis"].dropna(subset="parameter")
    width = diagnosis().causes[0].candidates[0].parameters
    assert list(sizes["parameter"])[: len(width)] == list(width) and sizes["value"].iloc[0] == 0.4


def test_without_the_libraries_the_line_that_installs_them_is_said(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtra, match=r"pip install 'focgen\[frames\]'"):
        results["Replay"].to_frame()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r"pip install 'focgen\[plots\]'"):
        results["Replay"].plot()
    assert repr(results["Replay"]) and results["Replay"]._repr_html_()


def test_what_is_shown_is_not_written():
    """The rigs and signals that a diagnosis carries are files of their own."""
    carried = replace(diagnosis(), drawn=signals(50), refitted=focgen.read_rig(RIG))
    assert plain(carried) == plain(diagnosis()) and carried == diagnosis()


def test_what_holds_samples_has_a_short_line(results):
    experiment = results["Replay"].experiments[0]
    assert repr(experiment).startswith("<Experiment '") and "501 samples every 0.02 s" in repr(experiment)
    found = results["Identification"]
    assert all("array" not in repr(one) for one in (found.joint, *found.experiments, found.stages))


def test_every_mark_is_drawn_as_the_page_draws_it():
    """Bars from where they stand, ends of axes, names along them, dashes; dollar signs begin no formula."""
    x = np.arange(1.0, 4.0)
    marks = (
        Line(NASTY, x, x**2, "model", dash="dotted", dots=6.0),
        Line("alike", x, x, "model", group=NASTY),
        Area("band", x, x - 0.5, x + 0.5, "band"),
        Bars("bars", x, x + 1.0, "good", bottoms=np.full(3, 0.5)),
        Rule(2.0, upright=True),
    )
    panels = (
        Panel(Axis("x $"), Axis("y", low=0.0, high=20.0), marks),
        Panel(Axis("x", log=True), Axis("", places=("one", "two")), (Bars("a", x, x, "bad", across=True),)),
    )
    drawn = still(Figure("Title", "", "", panels, TableOf((), ()), linked=False))
    top, below = drawn.axes
    assert np.array_equal(top.lines[0].get_ydata(), x**2) and top.lines[0].get_linestyle() == ":"
    assert top.get_ylim() == (0.0, 20.0) and top.get_xlabel() == r"x \$"
    assert [(p.get_y(), p.get_height()) for p in top.patches] == [(0.5, h + 0.5) for h in x]
    assert [t.get_text() for t in below.get_yticklabels()] == ["one", "two"] and below.get_xscale() == "log"
    named = [t.get_text() for t in drawn.legends[0].get_texts()]
    assert named == [r"<b>&\$x\$", "band", "bars", "a"]
    assert drawn._repr_png_()


NOTEBOOK = """
import focgen, pandas, tomllib
rig = tomllib.loads(open("rig.toml").read())
frame = pandas.read_csv("logs/steps.csv")
---
found = focgen.replay(rig, frame)
found
---
found.plot()
---
found.to_frame()
---
focgen.replay(frame, rig)
"""


@pytest.mark.long
@pytest.mark.skipif(
    find_spec("nbclient") is None or find_spec("ipykernel") is None, reason="nbclient, ipykernel: extra test"
)
def test_a_real_notebook_shows_them():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in NOTEBOOK.split("---\n")])
    place = {"metadata": {"path": str(EXAMPLES)}}
    client = nbclient.NotebookClient(book, timeout=120, kernel_name="python3", resources=place)
    client.execute()
    _, shown, figure, frame, turned = (cell.outputs for cell in book.cells)
    assert "<table>" in shown[0].data["text/html"] and shown[0].data["text/plain"].startswith("<Replay spba")
    assert len(figure[0].data["image/png"]) > 10_000
    assert "rmse_output" in frame[0].data["text/html"]
    assert "the order is now replay(rig, logs" in "".join(o.text for o in turned if "text" in o)
