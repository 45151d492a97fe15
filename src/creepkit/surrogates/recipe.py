"""Training settings, arrays of samples, and the metadata of a surrogate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from numpy.typing import NDArray

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.errors import SurrogateError
from creepkit.jobs.progress import ProgressCallback as ProgressCallback
from creepkit.options import Options, option

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
class Training(Options, title="settings of a training", error=SurrogateError, prefix="training: "):
    """How a network is trained: with Adam, on batches of whole histories.

    epochs : passes over the training rows. batch : histories in a step. rate : Adam's, at the beginning.
    schedule : of the rate: "constant"; "cosine", down to zero at the last epoch; "plateau", a tenth of it whenever the
        validation loss has not fallen by a ten-thousandth for `patience` epochs, as the paper has it.
    early_stop : stop when the validation loss has not fallen for so many epochs; None goes to the end.
    clip : largest norm of the gradient; None leaves it alone.
    validation : share of the rows that are set aside, drawn by the seed. samples : rows of the others that are learnt
    from, the first so many; None takes them all. The rows set aside are the same for every number of samples.
    """

    epochs: int = option(500, "Passes over the training rows.", limits.EPOCHS)
    batch: int = option(64, "Histories in a step.", limits.BATCH)
    rate: float = option(1e-3, "Rate of Adam at the beginning.", limits.LEARNING_RATE)
    schedule: Literal["plateau", "cosine", "constant"] = option("plateau", "Of the rate.")
    patience: int = option(15, "Epochs without gain after which a plateau lowers the rate.", limits.EPOCHS)
    early_stop: int | None = option(None, "Stop after so many epochs without gain.", limits.EPOCHS)
    clip: float | None = option(None, "Largest norm of the gradient.", limits.LARGEST_GRADIENT)
    validation: float = option(0.2, "Share of the rows that are set aside.", limits.numbers(0.001, 0.999))
    samples: int | None = option(None, "Rows of the others that are learnt from, the first so many.", limits.SAMPLES)


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
    domain: ApplicabilityDomain
    scaling: Mapping[str, Any] = field(default_factory=dict)
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
