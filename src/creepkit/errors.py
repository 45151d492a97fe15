"""Errors that creepkit raises: one sentence saying which object, what was found, what is allowed, what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class CreepkitError(Exception):
    """Base of every error that creepkit raises on purpose; its message is one sentence for the user."""


class LawError(CreepkitError):
    """A creep law, or an operation on one, is not well formed."""


class PluginError(CreepkitError):
    """A plugin cannot be loaded, or two plugins contradict each other."""


class HistoryError(CreepkitError):
    """A measured history, or the file that holds it, cannot be understood."""


class SolveError(CreepkitError):
    """A simulation was asked for something that it cannot do."""


class DatasetError(CreepkitError):
    """A data set or one of its shards is damaged or does not belong here."""


class SurrogateError(CreepkitError):
    """A surrogate, its file or its training was asked for something that it cannot do."""


class FitError(CreepkitError):
    """An identification was asked for something that it cannot do."""


class FitWarning(UserWarning):
    """An identification answers beyond what its tests cover; `warnings.simplefilter` turns it off, or into an error."""


class SurrogateWarning(UserWarning):
    """A surrogate answers without knowing where it may; `warnings.simplefilter` turns it off, or into an error."""


class CacheWarning(UserWarning):
    """Compiled laws are not kept on disk, for others could change what is executed."""


class ExportError(CreepkitError):
    """A law cannot be written in the language that was asked for."""


class ReportError(CreepkitError):
    """A report cannot be written, or the files that it carries cannot be trusted."""


class StudyError(CreepkitError):
    """A study file, or what it asks for, is not well formed; or its results cannot be kept."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Return `` Did you mean 'x'?`` when a known word lies near, else the list of what is known."""
    known = sorted(known)
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.55)
    if close:
        return f"did you mean '{close[0]}'? (known: {', '.join(known)})"
    return f"known: {', '.join(known) or 'none'}"
