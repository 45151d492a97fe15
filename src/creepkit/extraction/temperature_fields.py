"""Temperatures at a place of a plate: between thermocouples whose places are known, and in infrared images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.cameras.array_files import matlab_table
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import parse_numbers
from creepkit.files.reading import FileKind, read_bytes
from creepkit.readers.table import CellTable, TableRow
from creepkit.readers.text_files import read_text_table
from creepkit.records import ZERO_CELSIUS, InstrumentRecord
from creepkit.records.units import celsius_text

TOLERANCE = 0.004 / 3.0**0.5
"""Standard deviation of a thermocouple, of its temperature in C: a class 1 of IEC 60584-1 is within 0.4 %."""


SLOPES = np.geomspace(1e-3, 10.0, 41)
"""K2/mm that are tried for the variogram: 0.2 to 22 K between places that are 50 mm apart, each alike on a logarithm.
"""


IMAGE_FILE = FileKind("an infrared image", HistoryError, "save temperatures as CSV, .npy or .mat", 200_000_000)


PLANCK = 14387.77
"""Second radiation constant, um K."""


@dataclass(frozen=True)
class TemperatureAt:
    """Temperature at a place. values : (rows,) K over the rows of a record. sd : K, of their mean."""

    values: Floats
    sd: float


def temperature_between(
    record: InstrumentRecord,
    names: Sequence[str],
    places: Mapping[str, tuple[float, float]],
    where: tuple[float, float],
) -> TemperatureAt:
    """The temperature at a place, of the thermocouples of these channels.

    places : {channel: (x, y)} mm; where : mm, in the same axes. With the places of all, ordinary kriging with a linear
    variogram (Cressie, 1993, Statistics for Spatial Data, 3.2), averaged over its slopes by their restricted
    likelihood, and with the tolerance of thermocouples as a nugget: in a row of them straight between neighbours.
    Without places their mean, whose standard deviation is that of one more. HistoryError for places of some.
    """
    if len(names) == 1:
        return TemperatureAt(record.channel(names[0]).values, 0.0)
    rows = np.array([np.interp(record.times, *record.readings(name)) for name in names])
    means = rows.mean(axis=1)
    if not places:
        return TemperatureAt(rows.mean(axis=0), float(np.sqrt(1.0 + 1.0 / len(names)) * np.std(means, ddof=1)))
    for name in names:
        if name not in places:
            raise HistoryError(f"{record.origin}: the place of '{name}' is not stated; state those of all, in mm")
    at = np.array([places[name] for name in names], dtype=float)
    weights, variance = _kriging(at, np.asarray(where, dtype=float), means)
    return TemperatureAt(weights @ rows, float(np.sqrt(variance)))


def _kriging(places: Floats, where: Floats, means: Floats) -> tuple[Floats, float]:
    """(sensors,) weights, and the variance of the prediction, K2."""
    count = len(places)
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    near = np.hypot(*(places - where).T)
    nugget = (TOLERANCE * np.maximum(means - ZERO_CELSIUS, 0.0)) ** 2 * np.eye(count)
    contrasts = np.linalg.svd(np.ones((1, count)))[2][1:]
    seen, predictions = contrasts @ means, []
    for slope in SLOPES:
        covariance = nugget - slope * apart  # generalised, of contrasts alone
        matrix = contrasts @ covariance @ contrasts.T
        log_likelihood = -0.5 * (np.linalg.slogdet(matrix)[1] + seen @ np.linalg.solve(matrix, seen))
        system = np.block([[covariance, np.ones((count, 1))], [np.ones((1, count)), np.zeros((1, 1))]])
        solution = np.linalg.solve(system, np.append(-slope * near, 1.0))
        weights = solution[:count]
        variance = weights @ covariance @ weights + 2.0 * slope * weights @ near
        predictions.append((log_likelihood, weights, float(variance)))
    logs = np.array([one[0] for one in predictions])
    share = np.exp(logs - logs.max())
    share /= share.sum()
    each = np.array([one[1] for one in predictions])
    weights, values = share @ each, each @ means
    variance = float(share @ np.array([one[2] for one in predictions]) + share @ (values - share @ values) ** 2)
    return weights, variance


@dataclass(frozen=True)
class InfraredField:
    """Mean temperatures of the images of an infrared camera, in the axes of a camera's frames.

    kelvin : (rows, columns). change : K, standard deviation of a pixel from image to image, the median. centre : (x, y)
    mm of the middle of the image. spacing : mm between pixels. sd : (rows, columns) K, of the emissivity alone.
    """

    kelvin: Floats
    change: float
    centre: tuple[float, float]
    spacing: float
    sd: Floats

    def at(self, where: tuple[float, float], radius: float) -> tuple[float, float]:
        """Mean temperature, K, within a radius, mm, of a place, and its standard deviation, K."""
        rows, columns = self.kelvin.shape
        x = self.centre[0] + self.spacing * (np.arange(columns) - 0.5 * (columns - 1))
        y = self.centre[1] - self.spacing * (np.arange(rows) - 0.5 * (rows - 1))
        inside = np.hypot(x[None] - where[0], y[:, None] - where[1]) < radius
        if not inside.any():
            raise HistoryError(
                f"the infrared image covers {x[0]:.4g} to {x[-1]:.4g} mm and {y[-1]:.4g} to {y[0]:.4g} mm, "
                f"and a test piece lies at {where[0]:.4g}, {where[1]:.4g} mm; check its centre and its mm a pixel"
            )
        mean = float(np.nanmean(self.kelvin[inside]))
        if not np.isfinite(mean):
            raise HistoryError(f"the infrared image has no reading at {where[0]:.4g}, {where[1]:.4g} mm")
        return mean, float(np.hypot(np.nanmean(self.sd[inside]), self.change))


@dataclass(frozen=True)
class InfraredCamera:
    """How an infrared camera saw a plate.

    centre : (x, y) mm of the middle of its image in the axes of the frames, whose x points right and y up in it.
    spacing : mm a pixel. emissivity : of the surface, sd : its standard deviation; assumed_emissivity : with which the
    camera made its temperatures. surroundings : K, that the surface reflects. wavelength : um, that the camera sees.
    unit : of the numbers, "C" or "K".
    """

    centre: tuple[float, float]
    spacing: float
    emissivity: float
    sd: float = 0.02
    assumed_emissivity: float = 1.0
    surroundings: float = 298.15
    wavelength: float = 10.0
    unit: str = "C"

    def true_kelvin(self, read: Floats, emissivity: float) -> Floats:
        """Temperatures (...,) K of the surface: e S(T) = e0 S(read) + (e - e0) S(surroundings).

        read : (...,) K, what the camera says. emissivity : e. S : Planck's spectral radiance at the camera's
        wavelength, but for a factor.
        """

        def radiance(kelvin: Floats | float) -> Floats:
            return np.asarray(1.0 / np.expm1(PLANCK / (self.wavelength * np.asarray(kelvin))))

        own = self.assumed_emissivity * radiance(read)
        own = (own + (emissivity - self.assumed_emissivity) * radiance(self.surroundings)) / emissivity
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(PLANCK / (self.wavelength * np.log1p(1.0 / own)))

    def read(self, paths: Sequence[Path]) -> InfraredField:
        """The mean of images, files of numbers: .csv, .npy or .mat."""
        images = [self._kelvin(path) for path in paths]
        shapes = {image.shape for image in images}
        if len(shapes) != 1:
            sizes = " and ".join(f"{rows} x {columns}" for rows, columns in sorted(shapes)[:2]) or "none"
            raise HistoryError(f"infrared images have {sizes} pixels; give images of one size")
        mean = np.mean(images, axis=0)
        low, high = (self.true_kelvin(mean, self.emissivity + sign * self.sd) for sign in (1.0, -1.0))
        change = float(np.median(np.std(images, axis=0, ddof=1))) if len(images) > 1 else 0.0
        field = self.true_kelvin(mean, self.emissivity)
        return InfraredField(field, change, self.centre, self.spacing, 0.5 * np.abs(high - low))

    def _kelvin(self, path: Path) -> Floats:
        kelvin = image_of_numbers(path) + (ZERO_CELSIUS if self.unit == "C" else 0.0)
        if not np.nanmin(kelvin) > 0.0 or np.nanmax(kelvin) > 5000.0:
            low, high = float(np.nanmin(kelvin)), float(np.nanmax(kelvin))
            raise HistoryError(
                f"{path}: its temperatures are {celsius_text(low, high)}; say in which unit they are, unit = 'C' or 'K'"
            )
        return np.asarray(kelvin)


def image_of_numbers(path: Path) -> Floats:
    """(rows, columns) of a file of numbers: .npy, .mat with one matrix, or text without heads."""
    ending = path.suffix.lower()
    if ending == ".npy":
        import io

        try:
            values = np.load(io.BytesIO(read_bytes(path, IMAGE_FILE)))
        except (ValueError, EOFError, OSError):
            raise HistoryError(f"{path}: is no array of numbers; save it by numpy.save()") from None
    elif ending == ".mat":
        table = matlab_table(path)
        matrices = [name for name, shape in table.shapes.items() if len(shape) == 2 and min(shape) > 1]
        if len(matrices) != 1:
            raise HistoryError(f"{path}: holds {len(matrices)} matrices; an infrared image is one")
        values = table.load(matrices)[matrices[0]].reshape(table.shapes[matrices[0]])
    else:
        text = read_text_table(path)
        rows = [_pixels(text, row) for row in text.rows]
        if len({row.size for row in rows}) != 1:
            raise HistoryError(f"{path}: its rows differ in length; an infrared image is a matrix of numbers")
        values = np.array(rows)
    if values.ndim != 2 or min(values.shape) < 2 or values.dtype.kind not in "fiu":
        raise HistoryError(f"{path}: holds {quoted(str(values.shape))} numbers; an infrared image is a matrix")
    return np.asarray(values, dtype=float)


def _pixels(table: CellTable, row: TableRow) -> Floats:
    return parse_numbers(row.cells, table.dialect, lambda _: table.location(row.line), "pixel")
