"""What every test may use: the rig and the controller of the paper, and the folder of open logs."""

import gc
import os
from pathlib import Path

import pytest

from focgen.control.controller import Controller, ControllerRanges, GainSchedule, Units
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Ranges, Rig, Signals


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden", action="store_true", help="write tests/golden anew from what is generated"
    )


@pytest.fixture(autouse=True, scope="session")
def _no_test_waits_for_the_disk():
    """No test takes the machine's power away. That a file is synced, and when, shows by the call
    (`trust/test_lost.py`); some thousand times a test would wait for the disk and see nothing of it.
    """
    own = os.fsync
    os.fsync = lambda handle: os.fstat(handle) and None  # which still refuses a handle that is none
    yield
    os.fsync = own


_OPEN_DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "open"


@pytest.fixture
def open_data() -> Path:
    """The folder of logs measured by others, which are not part of the project."""
    if not _OPEN_DATA.is_dir():
        pytest.skip("the open logs (../shared/data/open) are not on this machine")
    return _OPEN_DATA


def paper_rig() -> Rig:
    """Eq. (1), (2) and (5); the line K(p) is ours, since the paper shows it in a figure only."""
    return Rig(
        name="spba",
        sample_time=0.01,
        signals=Signals("t_s", "kappa_per_mm", "u_V", "p_bar", "kappa_cam_per_mm", "ref_per_mm", "run"),
        actuator=Actuator(1.32, 0.6, (0.0015, 0.345)),
        regulator=TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)]),
        sensor=TransferFunction([(10, 0)], [(1, 1), (10, 0)]),
        ranges=Ranges((0.0, 10.0), (0.0, 0.25), (0.0, 0.02)),
    )


def paper_controller(length: int = 1000, **changes) -> Controller:
    """Eq. (6) with eq. (7)'s K_o over our line K(p), from 0.05 to 0.25 bar."""
    points = tuple(0.05 + 0.02 * i for i in range(11))
    gains = tuple((85.66 * p + 6.692) / (0.0015 + 0.345 * p) for p in points)
    values = dict(
        name="spba",
        sample_time=0.01,
        transfer=TransferFunction([(1.32, 0.6), (1.0, 0.0)]),
        gain=GainSchedule(points, gains),
        integrator=True,
        ranges=ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 10.0), (0.0, 0.25)),
        length=length,
        units=Units("1/mm", "V", "bar"),
    )
    return Controller(**{**values, **changes})


@pytest.fixture(name="paper_rig")
def _paper_rig() -> Rig:
    return paper_rig()


@pytest.fixture(name="paper_controller")
def _paper_controller() -> Controller:
    return paper_controller()


def pytest_collection_finish():
    """What was collected lives to the end: looking for garbage passes it by."""
    gc.collect()
    gc.freeze()
