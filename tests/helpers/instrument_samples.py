"""Small records of instruments as bytes, {name: content}: the group's own and what other data loggers write."""

from __future__ import annotations

import numpy as np

_ROWS = 40


def _pressure(k: int) -> float:
    """bar; a ramp, a plateau, a second ramp."""
    return float(np.interp(k, (0, 8, 12, 22, 26, 40), (0.0, 0.0, 40.0, 40.0, 70.0, 70.0)))


def plate_record(rows: int = _ROWS) -> str:
    """The rig's record: remarks, names, ten rows a second; pressures of three dimples in PSIG, temperatures in C."""
    names = ["A1", "B2", "D1"]
    head = ",".join(
        ["time"]
        + [f"{name}: Press.(PSIG)" for name in names]
        + ["Chamber Press(Torr)", "RF-Tank(V)"]
        + [f"{name}: Temp.(C)" for name in names]
        + ["Thermocouple1", "Temp Setpoint", "Press Setpoint"]
    )
    lines = ["Default User,Sample 1,(250809) - static,put run notes here...", head]
    for k in range(rows):
        psi = 14.5037738 * _pressure(k)
        stamp = f"8/18/2025  18:51:{22 + (k + 9) // 10:02d}.{(947365 + 100000 * k) % 1000000:06d}"
        values = [4.0 + 0.1 * k, 10.0, psi, 0.12, 3.9, 757.2, 767.1, 777.3 - 0.1 * k, 27.1, 961.7, 0.0]
        lines.append(",".join([stamp, *(f"{x:.3E}" for x in values)]))
    return "\n".join(lines) + "\n"


def _table(head: str, rows: list[list[str]], delimiter: str = ",", top: str = "") -> str:
    return top + "\n".join([head, *(delimiter.join(cells) for cells in rows)]) + "\n"


def _clock(seconds: float) -> str:
    seconds %= 86400
    return f"{int(seconds // 3600):02d}:{int(seconds // 60 % 60):02d}:{seconds % 60:06.3f}"


def samples() -> dict[str, bytes]:
    """The content of every sample file by its name."""
    k = range(_ROWS)
    texts = {
        "plate.csv": plate_record(),
        "elapsed.csv": _table(
            "time_s,pressure_bar,temperature_C", [[f"{2 * i}", f"{_pressure(i)}", f"{750 + 0.1 * i:.1f}"] for i in k]
        ),
        "midnight.txt": _table(
            "Time\tP1 [psig]\tT1 [°F]",
            [[_clock(86380 + i), f"{100 + i}", f"{1382 + i}"] for i in k],
            "\t",
            "Logger 7\nchannel 1 of 2\n",
        ),
        "iso.csv": _table(
            "timestamp,Pressure (kPa),Temp (K)",
            [[f"2025-08-18T18:51:{i:02d}+02:00", f"{1000 * i}", "1033.15"] for i in k],
        ),
        "unix.csv": _table(
            "unix_ms,p_psia,T_degC", [[f"{1755561113266 + 200 * i}", f"{14.7 + i}", "760.5"] for i in k]
        ),
        "german.csv": _table(
            "Datum;Uhrzeit;Druck [bar];Temp [°C]",
            [["18.08.2025", _clock(3600 + i).replace(".", ","), f"{i},5", f"760,{i % 10}"] for i in k],
            ";",
            "Messung 12;;;\n",
        ),
        "dropouts.csv": _table(
            "t_min,P (MPa(g)),TC1 (C)",
            [[f"{0.5 * i}", "-999" if i == 5 else f"{0.2 * i:.2f}", "OL" if i in (7, 8) else "749.9"] for i in k],
        ),
        "units_below.csv": _table(
            "Time,Pressure,Temperature", [["s", "barg", "°C"], *([f"{i}", f"{_pressure(i)}", "750"] for i in k)]
        ),
        "us_dates.csv": _table(
            "Date,Time,P_psig,T_F", [["3/14/2025", f"{_clock(7200 + i)[:8]} PM"[1:], f"{i}", "1400"] for i in k]
        ),
        "blanks.txt": _table(
            "time p_bar T_C", [[f"2025-08-18 {_clock(100 + i)}", f"{i}", "755"] for i in k], "  ", "# a remark\n"
        ),
    }
    texts["us_dates.csv"] = texts["us_dates.csv"].replace(",2:", ",02:").replace(" PM", " PM")
    files = {name: text.encode("utf-8") for name, text in texts.items()}
    files["western.txt"] = texts["midnight.txt"].encode("cp1252")
    files["utf16.csv"] = texts["elapsed.csv"].encode("utf-16")
    files["mark.csv"] = b"\xef\xbb\xbf" + texts["iso.csv"].encode()
    return files
