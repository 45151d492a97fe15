"""Beams of rectangular section in three-point and four-point bending and as cantilevers, under a force or a deflection.

Small deflections of slender beams: sections stay plane, shear adds nothing, rollers do not rub. Each section keeps a
history of its own, see `creepkit.specimens.fibre_beam`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

import creepkit as ck
from creepkit.arrays import Floats
from creepkit.integration import gauss_fibres, gauss_points
from creepkit.specimens.fibre_beam import BeamStations, FibreBeam

FORCE = (ck.Load("force", "force"),)
DISPLACEMENT = (ck.Load("displacement", "length", "displacement of the load point"),)
FORCE_OUTPUT = (ck.Output("force", "force", grows=False, noise=0.1),)
"""0.1 N: a load cell of 500 N of class 0.5 near a tenth of its range."""

DEFLECTION_NOISE = 2e-3
"""mm, of an extensometer with ceramic rods."""


def deflection_of(point: str) -> tuple[ck.Output, ...]:
    """The deflection of a beam at a point of it, said in words."""
    return (ck.Output("deflection", "length", f"deflection of {point}", noise=DEFLECTION_NOISE),)


@dataclass(frozen=True)
class RectangularBeam(FibreBeam):
    """A beam of rectangular section, of the width and height in the direction of the force."""

    width: float = ck.dimension(8.0, (0.1, 500.0), tolerance=0.005)
    height: float = ck.dimension(4.0, (0.05, 500.0), tolerance=0.005)

    def section(self) -> tuple[Floats, Floats]:
        """Gauss points in both halves of the height, (2 fibres,) mm, and their areas, (2 fibres,) mm^2."""
        places, lengths = gauss_fibres(self.height, self.fibres)
        return places, self.width * lengths

    def stretch(self, length: float, largest: float) -> tuple[Floats, Floats]:
        """Moments (stations,) mm, from 0 to the largest, mm, and lengths (stations,) mm of a stretch of the beam."""
        points, weights = gauss_points(self.stations)
        return largest * points, length * weights


@dataclass(frozen=True)
class ThreePointBend(RectangularBeam):
    """A beam on two rollers, pressed in the middle between them."""

    span: float = ck.dimension(40.0, (0.5, 5000.0), tolerance=0.002, long_name="span between the supports")

    name: ClassVar[str] = "three-point-bend"
    title: ClassVar[str] = "Three-point bending under a force in the middle, small deflections"
    outputs: ClassVar[tuple[ck.Output, ...]] = deflection_of("the middle")
    loads: ClassVar[tuple[ck.Load, ...]] = FORCE
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"force": (80.0, 500.0), "modulus": (50e3, 300e3)}
    )
    """Forces, N, whose reference stresses are 25 to 156 MPa."""

    def beam_stations(self) -> BeamStations:
        """Both halves of the span together, with M = F x/2."""
        return BeamStations(*self.stretch(self.span, 0.25 * self.span), largest=0.25 * self.span)


@dataclass(frozen=True)
class FourPointBend(RectangularBeam):
    """A beam on two rollers, pressed by two others that share the force evenly; the deflection is that of those two."""

    span: float = ck.dimension(40.0, (0.5, 5000.0), tolerance=0.002, long_name="span between the supports")
    inner_span: float = ck.dimension(20.0, (0.1, 5000.0), tolerance=0.004, long_name="span between the loads")

    name: ClassVar[str] = "four-point-bend"
    title: ClassVar[str] = "Four-point bending under a force shared by two rollers, small deflections"
    outputs: ClassVar[tuple[ck.Output, ...]] = deflection_of("the load points")
    loads: ClassVar[tuple[ck.Load, ...]] = FORCE
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"force": (150.0, 1000.0), "modulus": (50e3, 300e3)}
    )
    """Forces, N, whose reference stresses are 23 to 156 MPa."""

    def beam_stations(self) -> BeamStations:
        """Both outer stretches together, with M = F x/2, and the inner one, all of it alike."""
        if not self.inner_span < self.span:
            raise ck.errors.SolveError(
                f"specimen '{self.name}': inner_span is {self.inner_span:g} mm; allowed is less than the span of "
                f"{self.span:g} mm"
            )
        arm = 0.5 * (self.span - self.inner_span)
        moments, lengths = self.stretch(2.0 * arm, 0.5 * arm)
        return BeamStations(np.append(moments, 0.5 * arm), np.append(lengths, self.inner_span))


@dataclass(frozen=True)
class FourPointBendMidspan(FourPointBend):
    """Four-point bending whose deflection is read in the middle, where it is larger than under the loading rollers."""

    name: ClassVar[str] = "four-point-bend-midspan"
    title: ClassVar[str] = "Four-point bending, deflection read in the middle, small deflections"
    outputs: ClassVar[tuple[ck.Output, ...]] = deflection_of("the middle")

    def beam_stations(self) -> BeamStations:
        """Those of four-point bending; a unit force in the middle gives x/2 up to there, over the inner stretch too."""
        beam = super().beam_stations()
        inner = 0.25 * (0.5 * (self.span - self.inner_span) + 0.5 * self.span)
        return BeamStations(beam.moments, beam.lengths, virtual=np.append(beam.moments[:-1], inner))


@dataclass(frozen=True)
class Cantilever(RectangularBeam):
    """A beam that is clamped at one end and pressed at the other."""

    span: float = ck.dimension(30.0, (0.5, 5000.0), tolerance=0.002, long_name="span from the clamp to the load")

    name: ClassVar[str] = "cantilever-bend"
    title: ClassVar[str] = "Cantilever under a force at its end, small deflections"
    outputs: ClassVar[tuple[ck.Output, ...]] = deflection_of("the end")
    loads: ClassVar[tuple[ck.Load, ...]] = FORCE
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"force": (25.0, 160.0), "modulus": (50e3, 300e3)}
    )
    """Forces, N, whose reference stresses are 23 to 150 MPa."""

    def beam_stations(self) -> BeamStations:
        """From the load to the clamp, with M = F x."""
        return BeamStations(*self.stretch(self.span, self.span), largest=self.span)


class HeldDeflection:
    """What beams have in common whose deflection is held, in steps or ramps, and whose force is observed."""

    outputs: ClassVar[tuple[ck.Output, ...]] = FORCE_OUTPUT
    loads: ClassVar[tuple[ck.Load, ...]] = DISPLACEMENT
    relaxes: ClassVar[bool] = True


@dataclass(frozen=True)
class ThreePointBendRelaxation(HeldDeflection, ThreePointBend):
    """Three-point bending with the deflection of the middle held, in steps or ramps; its output is the force."""

    name: ClassVar[str] = "three-point-bend-relaxation"
    title: ClassVar[str] = "Three-point bending under a held deflection of the middle, small deflections"
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"displacement": (0.03, 0.25), "modulus": (50e3, 300e3)}
    )


@dataclass(frozen=True)
class FourPointBendRelaxation(HeldDeflection, FourPointBend):
    """Four-point bending with the deflection of the load points held, in steps or ramps; its output is the force."""

    name: ClassVar[str] = "four-point-bend-relaxation"
    title: ClassVar[str] = "Four-point bending under a held deflection of the load points, small deflections"
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"displacement": (0.03, 0.25), "modulus": (50e3, 300e3)}
    )


@dataclass(frozen=True)
class CantileverRelaxation(HeldDeflection, Cantilever):
    """A cantilever with the deflection of its end held, in steps or ramps; its output is the force."""

    name: ClassVar[str] = "cantilever-bend-relaxation"
    title: ClassVar[str] = "Cantilever under a held deflection of its end, small deflections"
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"displacement": (0.05, 0.5), "modulus": (50e3, 300e3)}
    )


@ck.hookimpl
def creepkit_specimens() -> list[FibreBeam]:
    """The beams with their default lengths and settings."""
    return [
        ThreePointBend(),
        FourPointBend(),
        FourPointBendMidspan(),
        Cantilever(),
        ThreePointBendRelaxation(),
        FourPointBendRelaxation(),
        CantileverRelaxation(),
    ]
