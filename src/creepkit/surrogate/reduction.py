"""Laws that are a surrogate's own with some of its terms switched off."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.kernels.logform import log_form
from creepkit.language import CreepLaw


def complete_parameters(
    trained: CreepLaw, law: CreepLaw, values: Mapping[str, Any], defaults: Mapping[str, float]
) -> dict[str, Any]:
    """Values of the trained law that make it `law` with `values`; SurrogateError where it cannot be that law.

    Terms that `law` lacks are switched off by their coefficients; what else they have stands at `middle`, where it
    changes nothing.
    """
    zero_names = _zero_coefficients(trained, law)
    missing = {name: 0.0 if name in zero_names else defaults[name] for name in trained.names if name not in law.names}
    return {**{name: np.asarray(values[name], float) for name in law.names}, **missing}


@lru_cache(maxsize=256)
def _zero_coefficients(trained: CreepLaw, law: CreepLaw) -> frozenset[str]:
    """Names of the coefficients of the trained law that are zero in `law`."""
    if law.fingerprint == trained.fingerprint:
        return frozenset()
    terms = list(law.terms.values())
    missing_labels = [label for label, term in trained.terms.items() if term not in terms]
    is_reduction = all(term in trained.terms.values() for term in terms) and set(law.names) <= set(trained.names)
    coefficients = [_term_coefficient(trained, label) for label in missing_labels]
    if not is_reduction or None in coefficients or dict(law.states) != dict(trained.states):
        raise SurrogateError(
            f"a surrogate of law '{trained.name}' cannot predict law '{law.name}': it answers for its own law, and for "
            f"that less some of its terms ({', '.join(trained.terms)}) by {trained.name}.without(...)"
        )
    return frozenset(name for name in coefficients if name is not None)


def _term_coefficient(law: CreepLaw, label: str) -> str | None:
    """The parameter that switches a term, and no other, off."""
    single = law.only(label)
    for k in log_form(single).coefficients[0]:
        name = single.names[k]
        uses = sum(law.symbol(name) in term.free_symbols for term in law.terms.values())
        if uses == 1 and law.table[name].off == 0:
            return name
    return None
