"""One test as text becomes one History; every layout of files ends here."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError
from creepkit.readers.conditions import ENDINGS, Conditions, placed
from creepkit.readers.frames import Frames, averages, read_frames
from creepkit.readers.imposed import read_loading, read_temperature
from creepkit.readers.tables import Entry, Table
from creepkit.readers.words import OUTPUTS, TELLING, Words
from creepkit.records import History

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic


def assemble(
    name: str,
    entries: Mapping[str, Entry],
    table: Table,
    words: Words,
    *,
    place: str,
    source: str,
    skip: Collection[str] = (),
) -> History:
    """Return the history of one test.

    entries : what is said once for the test; place : where that stands; table : its frames, without reading the
    columns in `skip`; source : what the history says of its origin.
    """
    conditions = Conditions(entries, words, place)
    frames = read_frames(table, words, skip)
    columns = table.place(table.columns_line)
    specimen, outputs = _observed(conditions, frames, words, columns)
    logarithmic = conditions.choice("strain_measure", ("engineering", "logarithmic"), needed="strain" in outputs)
    elastic_too = conditions.choice("includes_elastic", ("yes", "no"), needed="strain" in outputs)
    loading = read_loading(conditions, frames)
    used = _used(conditions, frames)
    rupture_time, unruptured = _end(conditions, frames, used)
    _refuse_rest(frames, {*outputs, loading.quantity, "temperature"}, columns)
    return History(
        name=conditions.text("name", name),
        times=frames.times,
        outputs=outputs,
        loading=loading,
        temperature=read_temperature(conditions, frames),
        specimen=specimen,
        elastic=_elastic(conditions),
        strain_measure="engineering" if logarithmic == "engineering" else "logarithmic",
        includes_elastic=elastic_too == "yes",
        standard_deviation=_spreads(conditions, frames, outputs),
        used=used,
        geometry=conditions.geometry,
        operator=conditions.text("operator"),
        alloy=conditions.text("alloy"),
        source=source,
        rupture_time=rupture_time,
        unruptured=unruptured,
        # Last, for whatever nobody has taken by now is refused.
        labels={**conditions.all_labels(), **averages(table, words), **_merged(frames)},
    )


def _merged(frames: Frames) -> dict[str, str]:
    return {"merged_frames": str(frames.merged)} if frames.merged else {}


def _observed(conditions: Conditions, frames: Frames, words: Words, place: str) -> tuple[str, dict[str, Floats]]:
    """The specimen, as named or as the outputs tell, and its outputs."""
    named = conditions.text("specimen")
    telling = {name: outputs for name, outputs in words.outputs.items() if name in TELLING or name not in OUTPUTS}
    asked = {named: words.outputs[named]} if named in words.outputs and named not in telling else telling
    present = [name for name, outputs in asked.items() if outputs.keys() & frames.values.keys()]
    if len(present) != 1 or (named in words.outputs and named != present[0]):
        found = f"outputs of {' and '.join(present)}" if present else "no output"
        wanted = f"those of {named}" if named in words.outputs else "those of one specimen"
        known = "; ".join(f"{', '.join(outputs)} ({name})" for name, outputs in words.outputs.items())
        raise HistoryError(f"{place}: missing column: the columns hold {found}, {wanted} are needed: {known}")
    outputs = {name: frames.values[name] for name in words.outputs[present[0]] if name in frames.values}
    return named or present[0], outputs


def _refuse_rest(frames: Frames, meant: Collection[str], place: str) -> None:
    """Refuse a column that would go unread, such as a pressure beside a stress."""
    rest = [name for name in frames.values if name.removesuffix("_sd") not in {"time", "used", *meant}]
    if rest:
        kept = ", ".join(sorted(meant))
        raise HistoryError(f"{place}: a column of {rest[0]} has no meaning beside {kept}; remove it")


def _elastic(conditions: Conditions) -> Elastic | None:
    modulus = conditions.number("modulus")
    if modulus is None:
        return None
    # Here, not above: the record of elasticity brings sympy, which listing the readers must not wait for.
    from creepkit.language.elastic import Elastic

    poisson = conditions.number("poisson")
    with placed(modulus.place):
        return Elastic(modulus.value) if poisson is None else Elastic(modulus.value, poisson.value)


def _spreads(conditions: Conditions, frames: Frames, outputs: Mapping[str, Floats]) -> dict[str, Floats]:
    """Standard deviations by output, from a column or one number for all frames."""
    spreads: dict[str, Floats] = {}
    for name in outputs:
        number, column = conditions.number(f"{name}_sd"), frames.values.get(f"{name}_sd")
        if number is not None and column is not None:
            raise HistoryError(f"{number.place}: '{number.key}' is also a column of the frames; keep one of them")
        if number is not None:
            spreads[name] = np.full(frames.times.shape, number.value)
        elif column is not None:
            spreads[name] = column
    return spreads


def _used(conditions: Conditions, frames: Frames) -> Bools:
    """Which frames a fit may use: those marked so, up to the end of the test; later ones saw the unloading."""
    used = np.asarray(frames.values.get("used", np.ones(frames.times.size)) == 1.0)
    end = conditions.number("end_time")
    if end is None:
        return used
    after = frames.times > end.value * (1 + 1e-9)
    if after.all():
        raise HistoryError(f"{end.place}: every frame lies after '{end.key}', {end.value:g} s; correct the end time")
    if after.any():
        conditions.labels["frames_after_end"] = str(int(after.sum()))
    return used & ~after


def _end(conditions: Conditions, frames: Frames, used: Bools) -> tuple[float | None, bool]:
    """The rupture time, s, if the test ruptured, and whether it was stopped before; neither where nothing is said.

    A test that is said to have ruptured, without a time, did so when its last frame was taken.
    """
    time, ended = conditions.number("rupture"), conditions.choice("ended", ENDINGS, needed=False)
    if time is not None and ended == "stopped":
        raise HistoryError(
            f"{time.place}: the test was stopped, and '{time.key}' says when it ruptured; keep one of them"
        )
    if time is not None or ended != "ruptured":
        return None if time is None else time.value, ended == "stopped"
    conditions.assume("rupture at the last frame")
    return float(frames.times[used][-1] if used.any() else frames.times[-1]), False
