"""The CSV file of one history: `# key: value` lines, then a line of columns, then one frame a line.

    # alloy: Inconel 625
    # temperature_C: 760
    # stress_MPa: 120
    # control: load
    # strain_measure: engineering
    time_h,strain_pct
    0,0
    0.5,0.013

Keys and columns carry their units (`words.py` lists them, `units.py` their units). A bulge test has the columns
`time_s,amplitude_mm,width_mm,shape` and the keys pressure_1_MPa, pressure_2_MPa, jump_time_h. Anything imposed may
change: `# stress_steps: 0 s 100 MPa; 1 h 120 MPa` jumps, `# temperature_program: 0 s 700 C; 2 h 720 C` is piecewise
linear, and a column of that name was recorded. `_sd` names a standard deviation, `used` (0 or 1) marks frames,
`# geometry apex_thickness_mm: 0.48` measures of the specimen, `# label heat: X7` and unknown keys are labels.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from creepkit.readers.assemble import assemble_history
from creepkit.readers.tables import peek_columns, read_table
from creepkit.readers.words import HeaderVocabulary
from creepkit.records import History


@dataclass(frozen=True)
class HistoryCsvReader:
    """Reader of files that hold one history each.

    columns : columns by which a file of this laboratory is recognised; () accepts every CSV file.
    words : what the laboratory calls things.
    """

    name: str
    title: str
    columns: tuple[str, ...] = ()
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is a CSV file with the columns."""
        if path.suffix.lower() != ".csv" or not path.is_file():
            return False
        return set(self.columns) <= set(peek_columns(path))

    def read(self, path: Path) -> list[History]:
        """Return the one history in the file."""
        table = read_table(path)
        return [assemble_history(path.stem, table.header, table, self.vocabulary, location=str(path), source=str(path))]


HISTORY_CSV = HistoryCsvReader("csv", "one history a file: `# key: value` lines, then columns such as time_s,strain")
