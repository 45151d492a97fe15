"""Beams of fibres: sections along a span, each of many uniaxial material points, under a force or a deflection.

Plane sections stay plane (Bernoulli), deflections are small, shear and thermal expansion are left out, and supports
give no moment. A change of temperature changes creep and the modulus alone. A subclass says where its sections are and
which moment a unit of force gives them; by virtual work the same moments, integrated over the curvatures, give the
deflection of the point where the force acts. The deflection includes the elastic one.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Floats, frozen, set_fields
from creepkit.errors import SolveError
from creepkit.integration import FibreInput, FibreModel, FibreTest, IntegrationSettings
from creepkit.integration.time_discretisation import SDIRK4_TEXT
from creepkit.language.elastic import STATE_MODULUS
from creepkit.limits import Limits, check_fields, numbers
from creepkit.records import History, NuisanceValues, Prediction, Program, Status
from creepkit.specimens.bar import SEARCH_TOLERANCE
from creepkit.specimens.run import Run, run_from_outputs
from creepkit.specimens.separate_tests import TestResponse, predict_separately
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw, Elastic


LENGTH_CHANGE = 1e-4
"""Relative change of a length, to each side, from which the derivatives of a model's arrays are had."""


MODULUS_PIECE = 25.0
"""K, over which the modulus is taken to be a straight line."""


@dataclass(frozen=True, eq=False)
class BeamStations:
    """The sections of a beam. moments : (stations,) mm, N mm for each N of force; lengths : (stations,) mm of beam.

    A section stands for its length of the beam, all parts that are symmetric to it together. largest : mm, the largest
    moment of the beam for each N, which no station need have; by default that of the stations. virtual : (stations,)
    mm, of a unit force where the deflection is read, the mean over the length; by default where the force acts.
    """

    moments: Floats
    lengths: Floats
    largest: float = 0.0
    virtual: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        virtual = self.virtual if np.size(self.virtual) else self.moments
        object.__setattr__(self, "virtual", frozen(np.atleast_1d(virtual)))
        if not self.largest:
            object.__setattr__(self, "largest", float(np.max(np.abs(self.moments))))
        set_fields(self, moments=frozen(np.atleast_1d(self.moments)), lengths=frozen(np.atleast_1d(self.lengths)))


@dataclass(frozen=True)
class FibreBeam(TestPiece, ABC):
    """A beam under a force, N, observed by the deflection, mm, of the point where it acts; elastic data are needed.

    stations : Gauss points along each stretch of the span over which the moment varies. fibres : in each half of the
    height. tolerance : relative local error of a step. strain_limit : creep strain of the first fibre that breaks.
    max_steps : cap on the steps of a section, beside 20 for each further straight piece of its programs.
    """

    stations: int = 6
    fibres: int = 6
    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000

    takes_values_of_tests: ClassVar[bool] = True
    relaxes: ClassVar[bool] = False
    """Whether the deflection is prescribed and the force observed."""

    def __post_init__(self) -> None:
        allowed = {
            "stations": Limits(1, 100), "fibres": Limits(1, 100), "max_steps": Limits(10, 10_000_000),
            "tolerance": numbers(1e-13, 1e-2), "strain_limit": numbers(1e-6, 10.0),
        }  # fmt: skip
        check_fields(self, allowed, f"{self.name} specimen: ", SolveError)

    def model_text(self, histories: Sequence[History]) -> str:
        """How the beam is simulated, in sentences for a paper."""
        return (
            f"The beam has {len(self.beam_stations().moments)} sections of {len(self.section()[0])} fibres each, all "
            "of them uniaxial material points; plane sections stay plane, deflections are small, shear is left out, "
            "and deflections follow from the curvatures by virtual work. Fibres are integrated together by "
            f"{SDIRK4_TEXT}. The local error of a step is at most {self.tolerance:g}; the beam ruptures where a "
            f"fibre reaches a creep strain of {self.strain_limit:g}."
        )

    @abstractmethod
    def section(self) -> tuple[Floats, Floats]:
        """Places, mm, and areas, mm^2, of the fibres of a section, (fibres,) each; `gauss_fibres` gives good ones."""

    @abstractmethod
    def beam_stations(self) -> BeamStations:
        """The sections along the beam."""

    @property
    def compliance(self) -> float:
        """Elastic deflection for a unit of force, times the modulus, 1/mm: the sum of M m dx/I."""
        _, inertia = self._section_moments()
        beam = self.beam_stations()
        return float(np.sum(beam.moments * beam.virtual * beam.lengths) / inertia)

    def for_search(self) -> Self:
        """The beam at the tolerance of a global search."""
        return self.replace(tolerance=max(self.tolerance, SEARCH_TOLERANCE))

    def refined(self) -> Self:
        """The beam with twice the sections and fibres, at a tenth of the tolerance."""
        return self.replace(stations=2 * self.stations, fibres=2 * self.fibres, tolerance=0.1 * self.tolerance)

    def reference_stress(self, history: History) -> Floats:
        """Stress where the moment is largest under each level of the load, (levels,) MPa: M over the plastic modulus.

        It is that of the skeletal point of a rectangle, which creep changes little: Boyle and Spence, Stress Analysis
        for Creep (1983), chapter 3. Under a prescribed deflection that at first, without creep.
        """
        piece, tested = self.of_test(history, {})
        plastic, _ = piece._section_moments()
        levels = np.unique(np.abs(tested.load_levels))
        levels = levels[levels > 0]
        if self.relaxes:
            levels = levels * piece._modulus(tested).values[0] / piece.compliance
        return np.asarray(levels * piece.beam_stations().largest / plastic)

    def growth_per_strain(self, history: History) -> float:
        """Deflection, mm, or force lost, N, for a unit of creep strain at the reference stress.

        Curvatures are taken to vary along the beam as moments do.
        """
        piece, tested = self.of_test(history, {})
        plastic, inertia = piece._section_moments()
        beam = piece.beam_stations()
        shape = beam.moments / beam.largest
        deflection = float(np.sum(np.abs(beam.virtual * shape) * beam.lengths) * plastic / inertia)
        return deflection * float(piece._modulus(tested).values[0]) / piece.compliance if self.relaxes else deflection

    def reference_strain(self, history: History) -> float:
        """The largest creep strain at the reference stress that a test reached, as far as its output says."""
        piece, tested = self.of_test(history, {})
        output = self.outputs[0]
        if output not in history.outputs:
            return 0.0
        elastic = piece._elastic_output(tested)
        moved = np.abs(history.outputs[output] - elastic)[history.used]
        return float(np.max(moved[np.isfinite(moved)], initial=0.0)) / self.growth_per_strain(history)

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict the output of each history at its times, with exact derivatives.

        theta : (candidates, parameters) internal values.
        """
        kernel = kernels.lower(law, "compiled")

        def respond(row: Floats, k: int, of_test: Mapping[str, float]) -> TestResponse:
            return self._one(kernel, row, histories[k], of_test, sensitivities)

        return predict_separately(respond, theta, histories, nuisances, self.outputs)

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> Run:
        """Run one test: what its history would show at its times, and how it ended."""
        theta = law.to_internal(law.values(values))[0]
        row = self._one(kernels.lower(law, "compiled"), theta, plan, {}, False)
        return run_from_outputs(Run, plan, self.outputs, row.values, row.status, row.end_time, row.reason)

    def _one(
        self, kernel: CompiledLaw, theta: Floats, history: History, nuisances: Mapping[str, float], sensitivities: bool
    ) -> TestResponse:
        """One candidate in one test, with the derivatives to its parameters and to its nuisances."""
        piece, tested = self.of_test(history, nuisances)
        moved = [_input(piece, kind, nuisances, tested) for kind in nuisances] if sensitivities else []
        settings = IntegrationSettings(
            rtol=self.tolerance, strain_limit=self.strain_limit, max_steps=int(self.max_steps)
        )
        modulus, parts = piece._modulus(tested), _models(piece)
        creep, slopes = np.zeros(history.times.size), np.zeros((history.times.size, theta.size + len(moved)))
        status, end, reason = Status.COMPLETE, float(history.times[-1]), ""
        for k, model in enumerate(parts):
            # what the recorded sum gains where an input changes its weights is recorded too
            weights = [model.observed, *(each.observed[k] for each in moved)]
            test = FibreTest(
                model.observing(np.concatenate(weights)),
                (tested.loading.program(),),
                tested.temperature_program(),
                modulus,
                history.times,
                follows_stress=self.relaxes,
            )
            found = integration.integrate_fibres(
                kernel,
                theta,
                test,
                settings=settings,
                jacobian=sensitivities,
                inputs=[each.inputs[k] for each in moved],
            )
            creep = creep + found.recorded[:, 0]
            if found.jacobian is not None:
                slopes = slopes + found.jacobian[:, 0]
                slopes[:, theta.size :] += found.recorded[:, 1:]
            if found.status is not Status.COMPLETE and (not reason or found.end_time < end):
                status, end, reason = found.status, found.end_time, found.reason
        values = piece._elastic_output(tested) + piece._creep_factor(tested) * creep
        if sensitivities:
            slopes = slopes * piece._creep_factor(tested)[:, None]
            for a, each in enumerate(moved):
                slopes[:, theta.size + a] += each.elastic_share * piece._elastic_output(tested)
                slopes[:, theta.size + a] += each.factor_share * piece._creep_factor(tested) * creep
        if not sensitivities:
            return TestResponse(values[:, None], status, end, reason)
        of_nuisances = {kind: slopes[:, None, theta.size + a] for a, kind in enumerate(nuisances)}
        return TestResponse(values[:, None], status, end, reason, slopes[:, None, : theta.size], of_nuisances)

    def _elastic_output(self, tested: History) -> Floats:
        """The output without creep, (times,): mm, or N."""
        modulus, load = self._modulus(tested).at(tested.times), tested.loading.program().at(tested.times)
        return np.asarray(load * modulus / self.compliance if self.relaxes else load * self.compliance / modulus)

    def _creep_factor(self, tested: History) -> Floats:
        """The output for a deflection by creep, (times,): 1, or N/mm."""
        if not self.relaxes:
            return np.ones(tested.times.size)
        return np.asarray(-self._modulus(tested).at(tested.times) / self.compliance)

    def _section_moments(self) -> tuple[float, float]:
        """Plastic section modulus and second moment of area, mm^3 and mm^4."""
        y, areas = self.section()
        y = y - float(areas @ y) / float(areas.sum())
        return float(areas @ np.abs(y)), float(areas @ y**2)

    def _modulus(self, tested: History) -> Program:
        """The modulus over time, MPa; straight between the breakpoints of the temperature."""
        if tested.elastic is None:
            raise SolveError(
                f"{tested.origin}: a {self.name} specimen needs elastic data, for stress spreads over its sections as "
                f"creep and elastic strain share it; {STATE_MODULUS}"
            )
        return _modulus_program(tested.elastic, tested.temperature_program())


@lru_cache(maxsize=4096)
def _modulus_program(elastic: Elastic, temperature: Program) -> Program:
    """The modulus over time, MPa, straight lines over no more than MODULUS_PIECE each."""
    T, times = [temperature.values[:1]], [temperature.times[:1]]
    varies = not isinstance(elastic.E, float)
    for k in range(temperature.times.size - 1):
        change = abs(float(temperature.values[k + 1] - temperature.values[k]))
        straight = not varies or temperature.times[k + 1] == temperature.times[k]
        pieces = 1 if straight else max(1, math.ceil(change / MODULUS_PIECE))
        T.append(np.linspace(temperature.values[k], temperature.values[k + 1], pieces + 1)[1:])
        times.append(np.linspace(temperature.times[k], temperature.times[k + 1], pieces + 1)[1:])
    levels, which = np.unique(np.concatenate(T), return_inverse=True)
    moduli = np.array([float(elastic.at(float(level)).E) for level in levels])
    return Program(np.concatenate(times), moduli[which])


@dataclass(frozen=True, eq=False)
class _BeamInput:
    """A nuisance of a beam: what it changes in each model and in the weights recorded, and relative changes else."""

    inputs: tuple[FibreInput, ...]
    observed: tuple[Floats, ...]
    elastic_share: float
    factor_share: float


@lru_cache(maxsize=512)
def _models(piece: FibreBeam) -> tuple[FibreModel, ...]:
    """The models of fibres of a beam: one for each section under a force, one of all under a deflection.

    They record the deflection by creep that the force alone would allow.
    """
    section = FibreModel.section(*piece.section())
    sections = tuple(_under_force(section, *map(float, one)) for one in zip(*_stations(piece), strict=True))
    if not piece.relaxes:
        return sections
    # Held at its point of load, the beam springs back elastically by what creep would add: one more mode.
    whole, compliance = FibreModel.side_by_side(sections), piece.compliance
    strain = whole.stress / compliance
    return (
        FibreModel(
            np.zeros_like(strain),
            strain,
            np.concatenate([whole.modes, -strain.T], axis=1),
            np.concatenate([whole.projection, whole.observed]),
            whole.observed,
        ),
    )


def _stations(piece: FibreBeam) -> tuple[Floats, Floats, Floats]:
    beam = piece.beam_stations()
    if beam.moments.shape != beam.lengths.shape or beam.moments.ndim != 1 or not (beam.lengths > 0).all():
        raise SolveError(
            f"specimen '{piece.name}': beam_stations() gave {beam.moments.size} moments and {beam.lengths.size} "
            "lengths; as many of both are needed, and lengths above zero"
        )
    return beam.moments, beam.virtual, beam.lengths


def _under_force(section: FibreModel, moment: float, virtual: float, length: float) -> FibreModel:
    """A section that the force of its beam bends, for a length of it; it records its part of the deflection."""
    return FibreModel(
        moment * section.stress[1:],
        section.strain[1:],
        section.modes,
        section.projection,
        virtual * length * section.projection[1:],
    )


@lru_cache(maxsize=512)
def _length_input(piece: FibreBeam, name: str) -> _BeamInput:
    """A length: the arrays of a model are smooth functions of it."""
    length = float(getattr(piece, name))
    change = LENGTH_CHANGE * length
    changes: list[dict[str, Any]] = [{name: length + sign * change} for sign in (1.0, -1.0)]
    above, below = (replace(piece, **each) for each in changes)
    up, down = _models(above), _models(below)
    compliance = math.log(above.compliance / below.compliance) / (2.0 * change)
    return _BeamInput(
        tuple(FibreInput.of_difference(a, b, 2.0 * change) for a, b in zip(up, down, strict=True)),
        tuple((a.observed - b.observed) / (2.0 * change) for a, b in zip(up, down, strict=True)),
        -compliance if piece.relaxes else compliance,
        -compliance if piece.relaxes else 0.0,
    )


def _input(piece: FibreBeam, kind: str, nuisances: Mapping[str, float], tested: History) -> _BeamInput:
    """What a nuisance parameter changes, at its value, in the test as its nuisances say."""
    if kind == "modulus":
        return _uniform_input(piece, 0.0, 1.0 / (1.0 + nuisances[kind]))
    if kind == "temperature":
        T = float(np.mean(tested.temperature_program().values))  # a modulus that varies with it follows it
        low, high = (piece._modulus(tested.replace(temperature=T + s)).values[0] for s in (-0.5, 0.5))
        return _uniform_input(piece, 1.0, math.log(high / low))
    return _length_input(piece, next(d.name for d in piece.dimensions if kind in d.names))


def _uniform_input(piece: FibreBeam, temperature: float, modulus: float) -> _BeamInput:
    """An input that changes temperature, K, and modulus, relative, by so much for a unit of it."""
    models = _models(piece)
    return _BeamInput(
        tuple(FibreInput.uniform(model, temperature, modulus) for model in models),
        tuple(np.zeros_like(model.observed) for model in models),
        modulus if piece.relaxes else -modulus,
        modulus if piece.relaxes else 0.0,
    )
