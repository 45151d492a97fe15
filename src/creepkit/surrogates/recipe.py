"""Training settings, arrays of samples, and the metadata of a surrogate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from numpy.typing import NDArray

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.errors import SurrogateError
from creepkit.jobs.shard_progress import ProgressCallback as ProgressCallback

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen
    from creepkit.sampling.conditions import TimeGrid
    from creepkit.surrogates.applicability_domain import ApplicabilityDomain


SampleArrays: TypeAlias = dict[str, NDArray[Any]]
"""Arrays whose leading axis is the sample. Always there: "targets" (n, frames, outputs), physical, float32, zero where
there is none; "mask" (n, frames), which frames are data. The rest is the recipe's own: the inputs of its network."""


Weights: TypeAlias = Mapping[str, NDArray[Any]]
"""{name: (...,)} weights and scales of a network, as they stand in its file."""


@checked
@dataclass(frozen=True)
class Training:
    """How a network is trained: with Adam, on batches of whole histories.

    epochs : passes over the training rows. batch : histories in a step. rate : Adam's, at the beginning.
    schedule : of the rate: "constant"; "cosine", down to zero at the last epoch; "plateau", a tenth of it whenever the
        validation loss has not fallen by a ten-thousandth for `patience` epochs, as the paper has it.
    early_stop : stop when the validation loss has not fallen for so many epochs; None goes to the end.
    clip : largest norm of the gradient; None leaves it alone.
    validation : share of the rows that are set aside, drawn by the seed. samples : rows of the others that are learnt
    from, the first so many; None takes them all. The rows set aside are the same for every number of samples.
    """

    epochs: int = 500
    batch: int = 64
    rate: float = 1e-3
    schedule: Literal["plateau", "cosine", "constant"] = "plateau"
    patience: int = 15
    early_stop: int | None = None
    clip: float | None = None
    validation: float = 0.2
    samples: int | None = None

    def __post_init__(self) -> None:
        for name, allowed in (
            ("epochs", limits.EPOCHS),
            ("batch", limits.BATCH),
            ("patience", limits.EPOCHS),
            ("early_stop", limits.EPOCHS),
            ("samples", limits.SAMPLES),
        ):
            if (value := getattr(self, name)) is not None:
                limits.check_number(f"training: {name}", value, allowed, SurrogateError)
        if self.schedule not in ("plateau", "cosine", "constant"):
            raise SurrogateError(f"training: schedule is '{self.schedule}'; allowed are plateau, cosine and constant")
        if not 0 < self.rate <= 1 or not (self.clip is None or self.clip > 0):
            raise SurrogateError(f"training: rate {self.rate} and clip {self.clip} must be above zero, rate at most 1")
        if not 0 < self.validation < 1:
            raise SurrogateError(f"training: validation is {self.validation}; allowed are shares between 0 and 1")


@dataclass(frozen=True, eq=False)
class SurrogateMetadata:
    """What a surrogate knows beside its weights; all of it stands in the header of its file.

    law, specimen, outputs, grid : of the data set; a surrogate of one law predicts that law.
    parameters, conditions : names of the data set's columns.
    scaling : {input: (mean, standard deviation)}, and of outputs, for people to read; the module holds its own.
    domain : where the training rows lie, in the inputs that the recipe names.
    metrics : of the validation rows (see surrogates.evaluation). curves : {name: one number an epoch}.
    provenance : versions, seed, fingerprints, counts, when.
    notes : limitations, a sentence each.
    """

    law: CreepLaw
    specimen: Specimen
    outputs: tuple[str, ...]
    grid: TimeGrid
    parameters: tuple[str, ...]
    conditions: tuple[str, ...]
    scaling: Mapping[str, Any] = field(default_factory=dict)
    domain: ApplicabilityDomain | None = None
    metrics: Mapping[str, Any] = field(default_factory=dict)
    curves: Mapping[str, list[float]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def from_dataset(cls, data: Dataset, **fields: Any) -> SurrogateMetadata:
        """The metadata of a data set; fields : the other fields."""
        return cls(
            law=data.law,
            specimen=data.specimen,
            outputs=data.outputs,
            grid=data.grid,
            parameters=data.parameter_names,
            conditions=data.condition_names,
            **fields,
        )
