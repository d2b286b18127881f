"""Which public benchmarks there are: their files, columns, nominal rigs, and what others have published."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Benchmark:
    """``train``, ``test``: files of the data folder; ``made``: the training record has to be made, by that
    function of :mod:`tests.records.made`. ``rig``: the nominal rig's file. ``periods`` of the test are run
    one after the other, and the last one counts. ``unit``, ``scale``: of the errors, by a factor.
    """

    name: str
    train: str
    test: str
    rig: str
    unit: str
    scale: float
    published: str
    made: str = ""
    periods: int = 1


_EMPS = """
name = "EMPS"
sample_time = 0.001
[signals]
time = "t_s"
command = "u_V"
output = "q_m"
[actuator]
num = [[35.15, 0.0]]
den = [[95.0, 2.0], [250.0, 1.0]]
"""

_BOUC_WEN = """
name = "Bouc-Wen"
sample_time = 0.0013333333333333333
[signals]
time = "t_s"
command = "f_N"
output = "y_m"
[actuator]
num = [[1.0, 0.0]]
den = [[2.0, 2.0], [12.0, 1.0], [95000.0, 0.0]]
"""

DRIVES = """
name = "coupled drives"
sample_time = 0.02
[signals]
run = "run"
time = "t_s"
command = "u_V"
output = "y_speed"
[actuator]
num = [[100.0, 0.0]]
den = [[1.0, 2.0], [5.0, 1.0], [50.0, 0.0]]
"""

BENCHMARKS = (
    Benchmark("EMPS", "emps_train.csv", "emps_test.csv", _EMPS, "mm", 1e3, "LSTM 74, RNN 89, GRU 220"),
    Benchmark(
        "Bouc–Wen",
        "bouc_wen_test_multisine.csv",
        "bouc_wen_test_multisine.csv",
        _BOUC_WEN,
        "µm",
        1e6,
        "polynomial state space 54",
        made="bouc_wen",
        periods=2,
    ),
    Benchmark(
        "coupled drives",
        "coupled_electric_drives.csv",
        "coupled_electric_drives.csv",
        DRIVES,
        "–",
        1.0,
        "RNN 0.096, GP-NARX 0.089",
    ),
)
