"""Parts of sentences about what a plugin offers and cannot be used."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from creepkit.errors import quoted


def missing_members(contribution: object, required: type) -> str:
    """What an object lacks of an interface, as the end of a sentence."""
    members = sorted(getattr(required, "__protocol_attrs__", ())) or [
        name for one in required.__mro__ for name in vars(one) if getattr(one, "_is_protocol", False) and name[0] != "_"
    ]
    missing = [name for name in members if not hasattr(contribution, name)]
    return f"; it has no {', '.join(missing)}" if missing else ""


def remedy(returned: Any) -> str:
    """What to do about something that is no list, as the end of a sentence."""
    if returned is None:
        return "; add a return statement"
    if isinstance(returned, Iterator):
        return "; return list(...) of it"
    return "; put it into a list" if hasattr(returned, "name") else ""


def type_text(thing: Any) -> str:
    """Name something unexpected: a class by its own name, else by its type."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else quoted(f"{type(thing).__name__} {thing!r}", 80)
