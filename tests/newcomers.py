"""Files as newcomers have them: the experiments of ``examples/logs/steps.csv``, written by the instruments'
own libraries where these exist, under the names and in the units that such instruments give."""

from pathlib import Path

import numpy as np
import pandas

from tests.pages import ROOT

STEP = 0.02  # s
_LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t,
Multi_Headings\tNo
X_Columns\tOne
Time_Pref\tRelative
***End_of_Header***\t
"""


def experiments() -> list[pandas.DataFrame]:
    """The six steps: t_s, u_V, p_bar, kappa_cam_per_mm and kappa_per_mm of each."""
    log = pandas.read_csv(ROOT / "examples" / "logs" / "steps.csv")
    return [part.drop(columns="run").reset_index(drop=True) for _, part in log.groupby("run", sort=False)]


def waveform_tdms(path: Path) -> None:
    """A group for each run, a waveform for each channel; no column of time."""
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    channels = {"Valve": ("u_V", "V"), "Pressure": ("p_bar", "bar"), "Curvature": ("kappa_per_mm", "1/mm")}
    with TdmsWriter(path) as file:
        for number, part in enumerate(experiments()):
            objects = [RootObject(), GroupObject(f"Step {number + 1}")]
            for name, (column, unit) in channels.items():
                clock = {"wf_increment": STEP, "wf_start_offset": 0.0, "unit_string": unit}
                objects.append(ChannelObject(f"Step {number + 1}", name, part[column].to_numpy(), clock))
            file.write_segment(objects)


def labview_lvm(path: Path) -> None:
    """LabVIEW's text file: decimal commas, one segment for each run."""
    columns = ["t_s", "u_V", "p_bar", "kappa_per_mm"]
    text = _LVM
    for part in experiments():
        head = {
            "Channels": "3",
            "Samples": "\t".join([str(len(part))] * 3),
            "Y_Unit_Label": "V\tbar\t1/mm",
            "X_Dimension": "Time\tTime\tTime",
            "X0": "0,0\t0,0\t0,0",
            "Delta_X": "\t".join([str(STEP).replace(".", ",")] * 3),
        }
        text += "\t\n" + "".join(f"{key}\t{value}\t\n" for key, value in head.items())
        text += "***End_of_Header***\t\t\t\t\nX_Value\tValve\tPressure\tCurvature\tComment\n"
        rows = part[columns].to_csv(sep="\t", decimal=",", index=False, header=False, float_format="%.6f")
        text += rows.replace("\n", "\t\n")
    path.write_text(text, encoding="cp1252", newline="\r\n")


def matlab_7_3(path: Path) -> None:
    """Row vectors as ``save -v7.3`` leaves them (HDF5), in ms and kPa; each run starts its clock anew."""
    import h5py

    log = pandas.concat(experiments())
    vectors = {
        "t_ms": np.round(1000 * log["t_s"]),
        "u_V": log["u_V"],
        "p_kPa": 100 * log["p_bar"],
        "kappa_per_mm": log["kappa_per_mm"],
    }
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in vectors.items():
            data = file.create_dataset(name, data=values.to_numpy()[:, None])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def semicolon_csv(path: Path) -> None:
    """As a spreadsheet of Central Europe saves it, a column for the runs."""
    parts = [part.assign(Versuch=number + 1) for number, part in enumerate(experiments())]
    names = {"t_s": "Zeit [s]", "u_V": "Ventil [V]", "p_bar": "Druck [bar]"}
    names["kappa_per_mm"] = "Krümmung [1/mm]"
    log = pandas.concat(parts)[["Versuch", *names]].rename(columns=names)
    log.to_csv(path, sep=";", decimal=",", index=False, encoding="cp1252", float_format="%.6f")


def no_pressure_csv(path: Path) -> None:
    """Command and answer alone: nobody measured between valve and actuator."""
    log = pandas.concat(experiments())[["t_s", "u_V", "kappa_per_mm"]]
    log.to_csv(path, index=False)


FILES = {
    "bench.tdms": waveform_tdms,
    "bench.lvm": labview_lvm,
    "bench.mat": matlab_7_3,
    "bench.csv": semicolon_csv,
    "blind.csv": no_pressure_csv,
}
