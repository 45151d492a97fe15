"""ExtractionOptions and ImposedOptions: what is said of a camera's frames and of an instrument's record."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, quoted
from creepkit.limits import CELSIUS as CELSIUS_LIMITS
from creepkit.limits import GIGAPASCAL as GIGAPASCAL_LIMITS
from creepkit.limits import MEGAPASCAL, MILLIMETRE, SECONDS
from creepkit.options import CELSIUS, GIGAPASCAL, Options, option


@checked
@dataclass(frozen=True)
class ExtractionOptions(Options, title="options of an extraction"):
    """What is said of frames and of what they show; mm, s.

    columns : {quantity: column} of files of no known format. interval : between frames whose files hold no times.
    times : a file of these. names : of what is found. centers : in mm, in the axes of the frames. window : radius of
    the fitted window. rings : radii of means in the place of a fit. rest : first and last frame at rest, "0-39".
    subset : side of a subset, whose smoothing is taken out.
    """

    format: str | None = option(None, "Camera format; by default by the head.")
    columns: Mapping[str, str] | None = option(None, "Columns x, y, z, u, v, w of no known format.", example="x=X_mm")
    interval: float | None = option(None, "Between frames whose files hold no times.", SECONDS, unit="s")
    times: Path | None = option(None, "Times of frames, a column in s, or in ms since 1970.")
    names: tuple[str, ...] = option((), "Names of what is found, as the record has them.")
    centers: tuple[tuple[float, ...], ...] = option(
        (), "Centre in mm, in the frames' axes; for several, repeat it.", unit="mm", flag="center", metavar="X,Y"
    )
    window: float | None = option(None, "Radius of the fitted window.", MILLIMETRE, unit="mm", flag="window")
    rings: tuple[float, ...] = option((), "Radii: means on rings in place of a fit.", unit="mm", flag="rings")
    rest: str | None = option(None, "Frames at rest, where they are not to be found.", key="rest_frames", flag="rest")
    subset: float = option(0.0, "Side of a subset, taken out.", MILLIMETRE, unit="mm", flag="subset")

    def check(self) -> None:
        """HistoryError for what contradicts itself, before frames are read."""
        for first, second in (("columns", "format"), ("interval", "times"), ("window", "rings")):
            if getattr(self, first) and getattr(self, second):
                raise HistoryError(f"{first} and {second} were given, of which one is enough; leave one of them out")
        named = ", ".join(self.names)
        if len({*self.names}) < len(self.names):
            raise HistoryError(f"names {named}: stand there twice; each test piece has its own")
        if any("/" in name or name[:1] == "." for name in self.names):
            raise HistoryError(f"names {named}: give them without a folder")
        if self.names and self.centers and len(self.names) != len(self.centers):
            raise HistoryError(
                f"names {named}: are {len(self.names)}, and centers {len(self.centers)}; give one of each"
            )
        if any(len(center) != 2 for center in self.centers):
            raise HistoryError("a center has two numbers, x and y in mm, as in 12.5,-3")
        _ = self.frames_at_rest

    @property
    def frames_at_rest(self) -> slice | None:
        """The frames at rest; HistoryError for a text that is not as 0-39."""
        if self.rest is None:
            return None
        first, _, last = self.rest.partition("-")
        whole = (first + last).isascii() and first.isdecimal() and last.isdecimal()
        if not (whole and int(first) <= int(last) < 10**9):
            raise HistoryError(
                f"rest is {quoted(self.rest)}: write the first and the last frame at rest, counted from 0, as in 0-39"
            )
        return slice(int(first), int(last) + 1)


@checked
@dataclass(frozen=True)
class ClockOptions(Options, title="options of the clocks of camera and record"):
    """What is known of the lag of a record's clock on the camera's; s. camera_start : of the camera's time zero."""

    lag: float | None = option(None, "By which the record's clock is ahead, where it is known.", unit="s", flag="lag")
    search: tuple[float, ...] = option(
        (), "Least and largest lag, where several fit.", unit="s", flag="search", example="-10,10"
    )
    camera_start: str | None = option(None, "The camera's time zero, as 2025-08-18T18:51:53-05:00.")

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Of the search; HistoryError for another number of them, or beside a lag."""
        if not self.search:
            return None
        if self.lag is not None:
            raise HistoryError("search contradicts lag: a lag that is known is not sought; leave one of them out")
        if len(self.search) != 2:
            raise HistoryError(f"search has {len(self.search)} numbers; give the least and the largest lag, as -10,10")
        return self.search[0], self.search[1]

    @property
    def start(self) -> float | None:
        """Unix time of the camera's time zero, s."""
        text, start = self.camera_start, None
        if text is None:
            return None
        with suppress(ValueError):
            start = datetime.fromisoformat(text)
        if start is None or start.tzinfo is None:
            raise HistoryError(f"camera_start '{quoted(text)}' is not known; write \"2025-08-18T18:51:53-05:00\"")
        return start.timestamp()


@checked
@dataclass(frozen=True)
class ImposedOptions(Options, title="options of a test under a camera"):
    """What was imposed on a test piece: by an instrument's record, or constant; MPa, K. modulus : of the history."""

    record: Path | None = option(None, "Instrument record of loads, temperatures.")
    channels: tuple[str, ...] = option((), "Load, then thermocouples, for no known format.", example="P1,T1")
    load: float | None = option(None, "Constant load, for no record.", MEGAPASCAL, unit="MPa")
    temperature: float | None = option(None, "Constant temperature, for no record.", CELSIUS_LIMITS, **CELSIUS)
    modulus: float | None = option(None, "Young's modulus, for the history.", GIGAPASCAL_LIMITS, **GIGAPASCAL)
