"""Calls that must fail, each with the sentence that says why: one loop that lists all that is said otherwise."""

import re
from collections.abc import Callable, Iterable
from typing import Any

from creepkit.errors import CreepkitError


def said_otherwise(
    cases: Iterable[tuple[Callable[[], Any], str]], error: type[CreepkitError] = CreepkitError
) -> list[str]:
    """What is said in the place of a sentence, a regular expression, or that nothing is.

    cases : (call, sentence) each; errors of another class than `error`, or of several lines, are listed as well.
    """
    wrong = []
    for call, sentence in cases:
        try:
            said = f"no error but {call()!r}"
        except error as caught:
            said = str(caught)
            if re.search(sentence, said) and "\n" not in said:
                continue
        except Exception as caught:
            said = repr(caught)
        wrong.append(f"{said}\n   in the place of: {sentence}")
    return wrong
