"""Newcomers, each with a file of their own kind and no model of anything, by the commands of docs/own-log.md.

Red when a page's command, a reader, or a proposal stops leading from such a file to a verified folder.
"""

import json
import shutil
import subprocess
import tomllib

import pytest

import focgen
from focgen.cli.main import main
from focgen.errors import DesignError, InputError
from focgen.rig.files import read_rig, write_rig
from focgen.rig.rig import UNITY
from tests.newcomers import FILES, experiments
from tests.pages import ROOT, blocks, is_elsewhere, run_shell

GUIDE = ROOT / "docs" / "own-log.md"
NEEDS = {"bench.tdms": "nptdms", "bench.mat": "h5py"}
# What every file says of the rig that made its numbers: seconds, and the size of its largest pressure.
TOPS = {"bench.mat": ("kPa", 25.0), "blind.csv": (None, None)}


QUICK = ("bench.csv", "blind.csv", "bench.mat")


@pytest.fixture(params=[f if f in QUICK else pytest.param(f, marks=pytest.mark.long) for f in FILES])
def file(request, tmp_path):
    """A newcomer's file, in a folder with nothing else."""
    pytest.importorskip(NEEDS.get(request.param, "numpy"))
    FILES[request.param](tmp_path / request.param)
    return tmp_path / request.param


def test_a_file_is_understood(file):
    """Roles, units, clock and runs, without a doubt but that of the ranges."""
    found = focgen.init(file)
    unit, top = TOPS.get(file.name, ("bar", 0.25))
    signals, ranges = found.rig.signals, found.rig.ranges
    assert found.rig.sample_time == 0.02
    assert signals.units.get("pressure") == unit and (ranges.pressure or [None])[-1] == top
    assert signals.units["output"] == "1/mm" and ranges.command == (0.0, 2.5)
    assert [d for d in found.doubts if not d.startswith(("ranges", "no pressure"))] == []
    logs = focgen.read_logs(found.rig, file)
    assert [len(log) for log in logs] == [2800] * 6 and logs[0].time[-1] == pytest.approx(55.98)
    assert signals.pressure is None or "--stages regulator,actuator" in found.next


def test_a_rig_without_a_regulator_says_so_where_its_numbers_cannot_be(tmp_path, capsys):
    """Volts that count as kilopascals reach nothing: the cause is named, and what it takes."""
    text = (ROOT / "examples" / "rig.toml").read_text(encoding="utf-8")
    rig = tomllib.loads(text)
    del rig["regulator"]
    rig["units"] = {"command": "V", "pressure": "kPa"}
    rig["actuator"]["gain"], rig["ranges"]["pressure"] = [1.5e-5, 3.45e-5], [0.0, 25.0]
    write_rig(read_rig(rig), tmp_path / "rig.toml")
    assert main(["design", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "c.toml")]) == 2
    said = capsys.readouterr().err
    assert "no [regulator], so 1 V of the command counts as 1 kPa of the pressure" in said
    assert "--stages regulator,actuator" in said and said.count("\n") == 1
    rig["signals"]["pressure"], rig["units"]["pressure"], rig["ranges"]["pressure"] = "u_bar", "V", [0, 10]
    with pytest.raises(DesignError, match="within the rig's reach"):
        focgen.design(rig)  # the pressure is a voltage, too: nothing to blame


def test_what_is_in_memory_is_shown_on_a_page(tmp_path):
    pytest.importorskip("bokeh")
    files = [ROOT / "examples" / "controller.toml", tmp_path / "c"]
    parts = [focgen.read_controller(files[0]), focgen.generate(*files)]
    page = focgen.report(parts, tmp_path / "a.html").read_text(encoding="utf-8")
    assert page == focgen.report(files, tmp_path / "b.html").read_text(encoding="utf-8")
    rig = focgen.read_rig(ROOT / "examples" / "rig.toml")
    with pytest.raises(InputError, match="takes no float"):
        focgen.report([1.0], tmp_path / "c.html")
    with pytest.raises(InputError, match="second rig"):
        focgen.report([rig, rig], tmp_path / "c.html")


def test_offsets_that_the_rest_contradicts_are_told():
    """With the releases, which are slower than the steps, the fits leave the rest; without them, not."""
    log = experiments()[5][::4]
    rig = focgen.init(log).rig
    whole = focgen.identify(rig, log, integer=False)
    (told,) = [warning for warning in whole.warnings if "at rest the fits are off" in warning]
    (replayed,) = list(focgen.replay(whole.rig, log).logs.values())
    assert replayed.gof < whole.gof["rig"]["mean"] - 0.2 and "focgen replay" in told
    loading = focgen.identify(rig, log, to=40.0, integer=False)
    assert not any("at rest" in warning for warning in loading.warnings)


# ------------------------------------------------------------------------------------- the whole way


def guided(file, folder):
    """Run the commands of the guide on a file as they stand there, with the next command that each one names
    where the guide's has the options of another log; returns what they printed, by command."""
    said, following = {}, ""
    for block in blocks(GUIDE):
        for line in block.text.splitlines() if block.language == "sh" else ():
            line = line.replace("examples/logs/steps.csv", file.name)
            if line.startswith("focgen identify"):
                line = following
            if not line or is_elsewhere(line.split()) or "diagnose" in line or "--target" in line:
                continue
            said[line], _ = run_shell(block.__class__(GUIDE, block.line, "sh", line), folder)
            following = next((t[6:] for t in said[line].splitlines() if t.startswith("next: ")), following)
    return said


@pytest.mark.long
def test_a_file_leads_to_a_verified_folder_that_a_build_takes_and_to_a_page(file):
    if shutil.which("cmake") is None:
        pytest.skip("no CMake on this machine")
    folder = file.parent
    said = guided(file, folder)
    (verified,) = [text for line, text in said.items() if line.startswith("focgen verify")]
    assert verified.endswith("verified\n")
    rig = focgen.read_rig(folder / "identified.toml")
    assert rig.actuator.T == pytest.approx(1.96, rel=0.05)  # the releases, which are slower, are in the log
    if rig.signals.pressure:
        per_volt = {"kPa": 10.0, "bar": 0.1}[rig.signals.units["pressure"]]
        assert rig.regulator.dc_gain == pytest.approx(per_volt, rel=0.01)
    else:
        assert rig.regulator == UNITY
    assert (folder / "firmware" / "CMakeLists.txt").is_file() and (folder / "build").is_dir()
    page = (folder / "chain.html").read_text(encoding="utf-8")
    assert "Closed loop" in page and len(page) < 3_000_000


@pytest.mark.long
def test_a_frame_in_a_notebook(tmp_path):
    """The cells of docs/python.md under "From a frame to a page", run by a kernel."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel"), pytest.importorskip("bokeh")
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    part = page.split("## From a frame to a page")[1].split("\n## ")[0]
    (text,) = [block for block in part.split("```")[1::2] if block.startswith("python\n")]
    shutil.copytree(ROOT / "examples" / "logs", tmp_path / "logs")
    cells = [nbformat.v4.new_code_cell(cell) for cell in text.removeprefix("python\n").split("\n\n")]
    book = nbformat.v4.new_notebook(cells=cells)
    path = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3", resources=path).execute()
    shown = [out.data.get("text/html", "") for cell in book.cells for out in cell.outputs if "data" in out]
    assert sum("<table>" in text for text in shown) >= 4 and "holds" in "".join(shown)
    assert (tmp_path / "chain.html").stat().st_size < 3_000_000
    assert json.loads((tmp_path / "firmware" / "manifest.json").read_text())["package"]["for"] == "cmake"
    configured = subprocess.run(["cmake", "-S", "firmware", "-B", "b"], cwd=tmp_path, capture_output=True)
    assert configured.returncode == 0, configured.stderr
