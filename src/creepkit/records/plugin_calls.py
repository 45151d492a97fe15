"""Calls into code of plugins: whatever they raise becomes one sentence with the plugin's file and line."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, ExportError, HistoryError, SolveError, quoted
from creepkit.records.history import History
from creepkit.records.prediction import NuisanceValues, Prediction
from creepkit.records.prediction_checks import checked_prediction, predictor_in_words

if TYPE_CHECKING:
    from pathlib import Path

    from creepkit.language.law import CreepLaw
    from creepkit.records.interfaces import Exporter, Predictor, Reader
    from creepkit.records.law_with_values import LawWithValues

_T = TypeVar("_T")


OWN_PACKAGE = "creepkit"


def call_of_plugin(call: Callable[[], _T], owner: object, what: str, error: type[CreepkitError]) -> _T:
    """What a call into a plugin's object returns; `error`, one sentence with file and line, where it raises another.

    owner : the object whose method is called; what creepkit's own classes raise stays as it is, for it is no plugin's.
    what : the call in words, "reader 'camera': read()".
    """
    try:
        return call()
    except CreepkitError:
        raise
    except (Exception, SystemExit) as raised:
        if type(owner).__module__.partition(".")[0] == OWN_PACKAGE:
            raise
        raise error(_unforeseen(what, raised, owner)) from raised


def _unforeseen(what: str, raised: BaseException, owner: object) -> str:
    message = quoted(" ".join(str(raised).split()), 300) or "no message"
    return f"{what} raised {type(raised).__name__}: {message}{_place(raised, owner)}"


def call_of_reader(call: Callable[[], _T], reader: Reader, path: Path, method: str) -> _T:
    """What a reader's accepts() or read() returns; HistoryError whatever it raises, also of creepkit's own readers."""
    return call_on_file(call, f"{path}: {method}() of reader '{reader.name}'", reader)


def call_on_file(call: Callable[[], _T], what: str, owner: object = None) -> _T:
    """What a call that reads a measured file returns; HistoryError, one sentence, whatever else it raises.

    The content of a file may lead any reader to an error that nobody has foreseen; the user is told of which file.
    Such an error is the cause of the HistoryError, so that a test can tell it from those that were foreseen.

    what : the file and the call in words. owner : the plugin's object, whose line is named where it is known.
    """
    try:
        return call()
    except CreepkitError:
        raise
    except MemoryError:
        raise HistoryError(f"{what} needs more memory than there is; divide the file, or give it more") from None
    except RecursionError:
        raise HistoryError(f"{what} found something nested too deep; no file of a test is") from None
    except OSError as failure:
        raise HistoryError(f"{what} cannot read it ({quoted(failure.strerror or failure, 120)})") from failure
    except (Exception, SystemExit) as raised:
        raise HistoryError(_unforeseen(what, raised, owner)) from raised


def _place(raised: BaseException, owner: object) -> str:
    """The deepest line of the plugin's own file, else of any; the frame of this module is none of the plugin."""
    frames = traceback.extract_tb(raised.__traceback__)[1:]
    own_file = getattr(sys.modules.get(type(owner).__module__), "__file__", None)
    of_plugin = [frame for frame in frames if frame.filename == own_file] or list(frames)
    return f" ({of_plugin[-1].filename}, line {of_plugin[-1].lineno})" if of_plugin else ""


def predict_with(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    *,
    nuisances: NuisanceValues | None = None,
    sensitivities: bool = False,
) -> Prediction:
    """The prediction of any predictor, checked for shape; SolveError where it is none, or where predict() raises.

    theta : (candidates, parameters) internal values. nuisances : {key: (candidates or 1, tests)}.
    """
    given = {"nuisances": nuisances} if nuisances else {}
    prediction = call_of_plugin(
        lambda: predictor.predict(law, theta, histories, sensitivities=sensitivities, **given),
        predictor,
        f"{predictor_in_words(predictor)}: predict()",
        SolveError,
    )
    candidates = max(len(theta), *(len(values) for values in nuisances.values())) if nuisances else len(theta)
    return checked_prediction(prediction, predictor, histories, candidates, theta.shape[1])


def accepts_path(reader: Reader, path: Path) -> bool:
    """Whether a reader accepts a file or folder; HistoryError where accepts() raises or returns no bool."""
    accepted = call_of_reader(lambda: reader.accepts(path), reader, path, "accepts")
    if not isinstance(accepted, bool):
        raise HistoryError(
            f"{path}: accepts() of reader '{reader.name}' returned a {type(accepted).__name__}; it must return a bool"
        )
    return accepted


def histories_in(reader: Reader, path: Path) -> list[History]:
    """The histories that a reader finds in a file or folder; HistoryError where read() raises or returns others."""
    what = f"{path}: read() of reader '{reader.name}'"
    histories = call_of_reader(lambda: reader.read(path), reader, path, "read")
    if not isinstance(histories, list):
        raise HistoryError(f"{what} returned a {type(histories).__name__}; it must return a list of histories")
    for history in histories:
        if not isinstance(history, History):
            raise HistoryError(f"{what} returned a {type(history).__name__} in its list; it must return histories")
    return histories


def exported_text(exporter: Exporter, source: LawWithValues) -> str:
    """The text of an exporter; ExportError where text() raises another error or returns no text."""
    what = f"exporter '{exporter.name}': text()"
    text = call_of_plugin(lambda: exporter.text(source), exporter, what, ExportError)
    if not isinstance(text, str):
        raise ExportError(f"{what} returned a {type(text).__name__}; it must return a str")
    return text
