"""Surrogates by name (the reduced-order models of known specimens) or from a file (trained networks)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, SurrogateError, nearest
from creepkit.files.safetensors_files import read_safetensors
from creepkit.records import Predictor, SupportsReducedOrderModel, known_specimens
from creepkit.surrogates.surrogate import Surrogate, SurrogateHeader
from creepkit.surrogates.weight_files import CODEC, SURROGATE


def reduced_order_models() -> dict[str, SupportsReducedOrderModel]:
    """{name of a surrogate: the known specimen whose reduced-order model it is}.

    The name is the specimen's `surrogate_name`, by default its own.
    """
    return {
        getattr(specimen, "surrogate_name", name): specimen
        for name, specimen in known_specimens().items()
        if isinstance(specimen, SupportsReducedOrderModel)
    }


SUFFIX = ".safetensors"


@checked
def surrogate(name_or_path: str | Path) -> Predictor:
    """Return a cheap model that stands for a specimen, by its name or from its file.

    name_or_path : "dimple", the reduced-order model of the default bulge specimen; or the file of a trained network,
        see train().
    """
    text = str(name_or_path)
    if isinstance(name_or_path, str) and not text.endswith(SUFFIX) and text in (named := reduced_order_models()):
        return named[text].reduced_order_model()
    if not (text.endswith(SUFFIX) or Path(text).exists()):
        choices = nearest(text, reduced_order_models())
        raise SurrogateError(f"no surrogate is called '{text}', and there is no such file; {choices}")
    return load_surrogate(text)


def load_surrogate(path: str | Path) -> Surrogate:
    """Return the surrogate in a file; SurrogateError says what is wrong with any other file."""
    weights, header = read_safetensors(path, SURROGATE)
    try:
        found = CODEC.from_json(SurrogateHeader, header, "its header")
        surrogate = Surrogate(found.recipe, weights, found.metadata)
        infinite = [name for name, one in weights.items() if not np.isfinite(np.asarray(one, dtype=float)).all()]
        if infinite:
            raise SurrogateError(f"its weights '{infinite[0]}' are not finite; train it again")
    except CreepkitError as error:
        raise SurrogateError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError):
        raise SurrogateError(f"{path}: its header and its weights do not belong together; train it again") from None
    return surrogate
