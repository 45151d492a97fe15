"""One test as text becomes one History; every file layout ends here."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError, SolveError, quoted
from creepkit.readers.compression import as_compressed, as_shortening, is_compression, take_height
from creepkit.readers.conditions import (
    END_OF_TEST_TERMS,
    StatedConditions,
    StatedNumber,
    errors_located_at,
    read_noise_correlation,
)
from creepkit.readers.derived_records import (
    as_plain_bar,
    from_loading_on,
    length_said,
    up_to_rupture,
    with_changes_of_lengths,
    without_loading,
    without_steps,
    without_unloaded_readings,
)
from creepkit.readers.ends_of_tests import (
    FIRM,
    INTERRUPTED,
    LABEL,
    NO,
    RUPTURED,
    STOPPED,
    UNCLEAR,
    YES,
    end_said_by,
    ends_in_column,
    kind_of_column,
)
from creepkit.readers.frames import UNUSED, TableFrames, column_question, read_frames, without_missing_readings
from creepkit.readers.imposed import read_loading, read_temperature
from creepkit.readers.moduli import elastic_stated, first_modulus, take_modulus_by_temperature
from creepkit.readers.questions import Question, collected, raise_all
from creepkit.readers.standard_names import in_standard_keys, in_standard_names, specimen_named
from creepkit.readers.table import CellTable, SourceText
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_written_name, words_of
from creepkit.readers.weak_sources import with_weak_sources
from creepkit.records import SECONDS_PER_HOUR, UNKNOWN_DURATION, History, dimensions_of, known_specimens, specimen_of
from creepkit.records.specimen_lookup import lengths_by_default
from creepkit.specimens.elastic_part import with_elastic_part

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic


def assemble_history(
    name: str,
    entries: Mapping[str, SourceText],
    table: CellTable,
    vocabulary: HeaderVocabulary,
    *,
    location: str,
    source: str,
    skipped_columns: Collection[str] = (),
    columns_as_labels: bool = False,
) -> History:
    """Return the history of one test.

    entries : what is said once for the test; location : where that stands; table : its frames, without reading the
    columns in `skipped_columns`; source : what the history says of its origin. columns_as_labels : whether entries that
    resemble no key are labels, as columns of an index are.
    """
    table = without_missing_readings(table, vocabulary.terms(specimen_named(entries, vocabulary)))
    entries, table = in_standard_names(entries, table, vocabulary)
    known = vocabulary.terms(specimen_named(entries, vocabulary))
    entries, assumed = with_weak_sources(entries, table, known)
    table = replace(table, assumptions=(*table.assumptions, *assumed))
    conditions = StatedConditions(entries, vocabulary, location, columns_as_labels=columns_as_labels)
    for assumption in table.assumptions:
        conditions.record_assumption(assumption)
    take_height(conditions, name)
    conditions.ask_of_notch()
    frames = with_changes_of_lengths(conditions, read_frames(table, vocabulary, conditions.terms, skipped_columns))
    frames = without_unloaded_readings(conditions, as_plain_bar(conditions, frames))
    frames = up_to_rupture(conditions, from_loading_on(conditions, frames), name)
    for assumption in frames.table.assumptions[len(table.assumptions) :]:
        conditions.record_assumption(assumption)
    if count := len(frames.marked):
        what = f"{count} reading{'s' * (count > 1)} left out that another one at the same time follows"
        conditions.record_assumption(f"{what} with other conditions")
    columns = table.location(table.columns_line)
    errors = list[HistoryError]()
    loading = collected(errors, partial(read_loading, conditions, frames))
    temperature = collected(errors, partial(read_temperature, conditions, frames))
    raise_all(errors)
    assert loading is not None
    assert temperature is not None
    take_modulus_by_temperature(conditions, temperature)
    is_named = conditions.states("specimen")
    specimen, outputs = _specimen_and_outputs(conditions, frames, loading.quantity, columns)
    _record_place(conditions, table, specimen)
    _record_unstated(conditions, specimen, is_named)
    strain_measure = conditions.take_choice(
        "strain_measure", ("engineering", "logarithmic"), required="strain" in outputs
    )
    used, elastic = _used_frames(conditions, frames), elastic_stated(conditions, frames, loading)
    signed = loading.quantity == "stress" and bool((loading.program().values < 0.0).any())
    if signed and not outputs:
        raise HistoryError(
            f"{conditions.location_of('stress')}: a test without a curve at {loading.program().values.min():g} MPa; "
            "a rupture time or a minimum rate is that of tension: write the size of the stress"
        )
    if signed and "strain" in outputs and not (loading.program().values > 0.0).any():
        outputs["strain"] = as_shortening(conditions, outputs["strain"])
    if "strain" in outputs and loading.quantity == "stress" and not signed and is_compression(conditions, name):
        loading, outputs["strain"] = as_compressed(loading, frames.times, outputs["strain"], strain_measure)
        strain_measure = "logarithmic"
        conditions.record_assumption("compression (its area grows and stresses are true ones)", first=True)
    if "strain" in outputs:
        stress = loading.program().at(frames.times) if loading.quantity == "stress" else None
        modulus = None if elastic is None else first_modulus(elastic, temperature)
        record = without_loading(conditions, frames.times, outputs["strain"], used, stress, modulus)
        outputs["strain"], used, elastic_included = record.strain, record.used, record.includes_elastic
        if record.modulus is not None:  # that the loading ramp showed
            conditions.put_number("modulus", StatedNumber(record.modulus, "modulus", location))
            elastic = elastic_stated(conditions)
    else:
        stated = conditions.take_choice("includes_elastic", ("yes", "no"), required=False)
        elastic_included = stated == "yes"
        if stated == "no" and not any(name.startswith("strain") for name in outputs):
            plan = History(
                name, frames.times, {}, loading, temperature, specimen, elastic, geometry=conditions.geometry
            )
            outputs = with_elastic_part(plan, outputs, conditions.record_assumption)
    outputs = without_steps(conditions, frames.times, outputs, used, temperature)
    merged = {"merged_frames": str(frames.merged_count)} if frames.merged_count else {}
    rupture_time, unruptured = _end_of_test(conditions, frames, used, name, loading.quantity != "strain")
    _refuse_unread_columns(frames, {*outputs, loading.quantity, "temperature"}, conditions.terms)
    history = History(
        times=frames.times,
        outputs=outputs,
        loading=loading,
        temperature=temperature,
        specimen=specimen,
        strain_measure="engineering" if strain_measure == "engineering" else "logarithmic",
        includes_elastic=elastic_included,
        standard_deviation=_standard_deviations(conditions, frames, outputs),
        used=used,
        source=source,
        rupture_time=rupture_time,
        unruptured=unruptured,
        **_stated_fields(conditions, name, elastic),
        noise_correlation=read_noise_correlation(conditions),
        # Last: entries that nothing has used by now are refused.
        labels={**conditions.all_labels(), **merged},
    )
    _check_operator(history, columns)
    return history


def _stated_fields(conditions: StatedConditions, name: str, elastic: Elastic | None = None) -> dict[str, Any]:
    """Fields of a history that its conditions alone state, with frames or without; elastic : where it was read."""
    minimum_rate, minimum_rate_sd = _minimum_rate(conditions)
    return {
        "name": conditions.take_text("name", name),
        "elastic": elastic or elastic_stated(conditions),
        "geometry": conditions.geometry,
        "operator": conditions.take_text("operator"),
        "alloy": conditions.take_text("alloy"),
        "stated": conditions.stated,
        "minimum_rate": minimum_rate,
        "minimum_rate_sd": minimum_rate_sd,
    }


def _check_operator(history: History, location: str) -> None:
    """HistoryError where the operator of a test does not give the outputs of its columns."""
    specimen = specimen_of(history)
    try:
        if specimen is not None:
            specimen.outputs_of_test(replace(history, source=location))
    except SolveError as error:
        raise HistoryError(str(error)) from error


def assemble_without_frames(
    name: str, entries: Mapping[str, SourceText], vocabulary: HeaderVocabulary, *, location: str, source: str
) -> History:
    """Return the history of a test of which only the minimum creep rate, only its end, or both are known.

    Its one time is that of its end, where that is stated, as rupture or as `end_time`, else UNKNOWN_DURATION.
    """
    known = vocabulary.terms(specimen_named(entries, vocabulary))
    conditions = StatedConditions(in_standard_keys(entries, known), vocabulary, location)
    conditions.ask_of_notch()
    rate_known = conditions.states("minimum_rate")
    time, ended, is_end = _time_and_end(conditions, Path(source.partition(" (")[0]), name)
    end = conditions.take_number("end_time")
    if is_end:
        time, end = None, end or time
    if ended == STOPPED and end is None:  # a remark of which an answer says so, "Laufzeit 40215 h", says when
        said = [k for k, text in conditions.labels.items() if conditions.end_terms.get(text.casefold()) == STOPPED]
        end = _time_in_remark(conditions, said)
    if ended == RUPTURED and time is None and end is not None:
        time, end = end, None
    if rate_known and time is None and end is None and ended:  # when it ended is not known
        conditions.labels.setdefault("ended", ended)
        ended = ""
    _check_end_without_frames(time, end, ended, location)
    if not rate_known and end is not None and not ended:
        raise conditions.question(
            f"'{end.key}' {UNSAID_END}", "ended", RUPTURED, STOPPED, location=end.location, is_free=False
        )
    if not rate_known and time is None and ended != "stopped":
        raise conditions.missing_error(
            "frames, no minimum creep rate and no end of the test",
            "write minimum_rate_1/h, rupture_h, or end_time_h with 'ended: stopped'; or columns of frames, such as "
            "time_h,strain_pct",
        )
    duration = (time or end or StatedNumber(UNKNOWN_DURATION, "", location)).value
    only = TableFrames(CellTable(Path(source), ()), {"time": np.array([duration])}, np.array([0]))
    loading, temperature = read_loading(conditions, only), read_temperature(conditions, only)
    take_modulus_by_temperature(conditions, temperature)
    strain_measure = conditions.take_choice("strain_measure", ("engineering", "logarithmic"), required=rate_known)
    conditions.take_choice("includes_elastic", ("yes", "no"), required=False)
    named = conditions.take_text("specimen", conditions.default_specimen)
    _refuse_unknown_specimen(named, conditions.terms, location)
    with errors_located_at(location):
        history = History(
            times=only.times,
            outputs={},
            loading=loading,
            temperature=temperature,
            strain_measure="logarithmic" if strain_measure == "logarithmic" else "engineering",
            source=source,
            rupture_time=None if time is None else time.value,
            unruptured=ended == "stopped",
            **_stated_fields(conditions, name),
            labels=conditions.all_labels(),  # last: entries that nothing has used by now are refused
        )
        history = history.replace(specimen=named) if named else history
    if history.operator:
        _check_operator(history, location)
    return history


def _check_end_without_frames(time: StatedNumber | None, end: StatedNumber | None, ended: str, location: str) -> None:
    """Refuse ends that contradict one another, or say too little."""
    if time is not None and (end is not None or ended == "stopped"):
        other = f"'{end.key}' says when it ended" if end is not None else "the test was stopped"
        raise HistoryError(f"{time.location}: '{time.key}' says when the test ruptured, and {other}; keep one of them")
    if time is None and ended == "ruptured":
        raise HistoryError(f"{location}: the test ruptured, and nothing says when; write rupture_h")
    if ended == "stopped" and end is None:
        raise HistoryError(f"{location}: the test was stopped, and nothing says when; write end_time_h")


UNSAID_END = "says how long the test lasted, and nothing whether it broke then; which is it?"
_OF_OTHER_THINGS = ("assumed", "ended", "heat", "laboratory", "operator")
"""Labels that do not say how a test ended; `ended` is what creepkit's simulation says beside a time of rupture."""


def _time_and_end(
    conditions: StatedConditions, path: Path, name: str, frames: TableFrames | None = None, asks: bool = False
) -> tuple[StatedNumber | None, str, bool]:
    """The rupture time, how the test ended, by `ended`, an answer or a label, and whether the time is that of its end.

    A label by which a test did not break makes its time that of its end. What may say so is asked about. The remark of
    the last frame says how the test ended; those of earlier frames say nothing of it.
    """
    time, ended = conditions.take_number("rupture"), conditions.take_choice("ended", END_OF_TEST_TERMS, required=False)
    answer = conditions.end_terms.get(name.casefold(), "")
    if ended or answer in END_OF_TEST_TERMS:
        return time, ended or answer, not ended and answer == STOPPED
    firm, remarks, unclear, asked = dict[str, str](), dict[str, str](), dict[str, str](), ""
    for label, text in conditions.labels.items():
        kind = kind_of_column(label)
        if label in _OF_OTHER_THINGS or (not kind and text.casefold() in YES | NO):
            continue
        at = frames.line_of(label) if frames is not None else None
        if at == "earlier":
            is_plain = len(text.split()) < 3  # "rupture of a fuse" says nothing
            if is_plain and end_said_by(text) == RUPTURED and text.casefold() not in conditions.end_terms:
                what = (
                    f"'{quoted(text, 60)}' in {label} says that the test broke, and readings follow; correct them, or"
                )
                raise conditions.question(
                    f"{what} does it say nothing of the test?", "ended", {text: LABEL}, is_free=False
                )
            if conditions.end_terms.get(text.casefold(), LABEL) != LABEL:
                what = f"remark '{quoted(text, 60)}' of {label} is not of the last frame and says no end"
                conditions.record_assumption(what.replace(",", ";"))
            continue
        if at == "last":
            end = conditions.end_terms.get(text.casefold()) or end_said_by(text)
            end, asked = {INTERRUPTED: STOPPED, LABEL: ""}.get(end, end), label if asks and end == UNCLEAR else asked
        else:
            (end,) = ends_in_column(label, [text], conditions.end_terms, [False]).ends
            end = RUPTURED if label.startswith("line ") and _tells_rupture(text) else end
        firmness = firm if kind in FIRM or at == "last" else remarks
        (unclear if end == UNCLEAR else firmness)[label] = text if end == UNCLEAR else end
    said = {end for end in firm.values() if end} or {STOPPED}.intersection(remarks.values())
    label = next((name for name, end in (firm | remarks).items() if end in said), "")
    if len(said) > 1:
        each = {end: name for name, end in reversed((firm | remarks).items()) if end in said}
        texts = [f"'{conditions.labels[n]}' in {conditions.location_of(n)} says {e}" for e, n in sorted(each.items())]
        raise conditions.question(f"{' and '.join(texts)}; which holds?", "ended", *sorted(said), is_free=False)
    if (time is not None or asked) and unclear and not said:
        name = asked or next(iter(unclear))
        text = unclear[name]
        other = f"and '{time.key}' that the test broke; which holds?" if time else "the last frame; did it break then?"
        choices = [{text: STOPPED}, {text: RUPTURED}, {text: LABEL}]
        place = time.location if time else conditions.location
        raise Question(path, place, f"'{quoted(name)}' says '{quoted(text)}', {other}", "ended", choices)
    if said == {STOPPED}:
        conditions.record_assumption(f"stopped before rupture by its label '{quoted(label)}'")
        return time, STOPPED, True
    broke = [label for label, end in (firm | remarks).items() if end == RUPTURED]
    if time is None and frames is not None and broke:
        time = _time_in_remark(conditions, broke, float(frames.times[-1]))
        names_another = time is None and any(_HOURS.search(conditions.labels[label]) for label in broke)
        said = said if names_another else {RUPTURED}
    return time, "".join(said), False


_HOURS = re.compile(r"(\d+(?:[.,]\d+)?)\s*(?:h|hrs?|hours?|std|stunden|heures?|ore|horas)(?!\w)", re.IGNORECASE)
"""A time in a remark such as `ruptured after 453.1 h, A = 22 %`."""


def _tells_rupture(text: str) -> bool:
    """Whether a line of its own says that the test broke, and no more than that or when."""
    first = re.split(r"[,;] ", text)[0]
    is_short = _HOURS.search(first) or len(text.split()) <= MOST_WORDS
    return bool(is_short) and kind_of_column(_HOURS.sub("", first)) == RUPTURED


MOST_WORDS = 3
"""Of a line without a time: longer ones are about something else."""


AT_LAST_FRAME = 0.01
"""Of the time of the last frame, by which a rounded time of rupture may lie before it."""


def _time_in_remark(conditions: StatedConditions, labels: Sequence[str], last: float = 0.0) -> StatedNumber | None:
    """The one time in hours that remarks on the end of a test name, if it is not before its last frame, s."""
    texts = {label: conditions.labels[label] for label in labels}
    found = {float(h.replace(",", ".")): label for label, text in texts.items() for h in _HOURS.findall(text)}
    if len(found) != 1:
        return None
    ((hours, label),) = found.items()
    if hours * SECONDS_PER_HOUR < (1.0 - AT_LAST_FRAME) * last:
        return None
    conditions.record_assumption(f"{'ruptured' if last else 'ended'} at {hours:g} h by its label '{quoted(label)}'")
    return StatedNumber(hours * SECONDS_PER_HOUR, label, conditions.location)


def _minimum_rate(conditions: StatedConditions) -> tuple[float | None, float | None]:
    """The minimum creep rate and its standard deviation, 1/s, where they are stated."""
    rate, sd = conditions.take_number("minimum_rate"), conditions.take_number("minimum_rate_sd")
    if rate is None and sd is not None:
        raise HistoryError(f"{sd.location}: '{sd.key}' stands there without a minimum_rate; give both")
    return None if rate is None else rate.value, None if sd is None else sd.value


def _refuse_unknown_specimen(named: str, terms: Terms, location: str) -> None:
    if named and named not in terms.outputs and (near := get_close_matches(named, terms.outputs, 1, cutoff=0.8)):
        raise HistoryError(f"{location}: there is no specimen '{named}'; did you mean '{near[0]}'?")


_BY_ITS_COLUMNS = "specimen {} by its columns with lengths by default: "


def _record_unstated(conditions: StatedConditions, specimen: str, is_named: bool) -> None:
    """Record a specimen that columns alone tell, before all else that is assumed, and lengths by default.

    Of a specimen that is named these count where no more lengths are by default than are stated. A length that a label
    may state is asked for.
    """
    names = {alias: one.name for one in dimensions_of(known_specimens().get(specimen)) for alias in one.names}
    conditions.geometry = {names.get(name, name): length for name, length in conditions.geometry.items()}
    lengths = lengths_by_default(specimen, conditions.geometry)
    for name in [*lengths]:
        words, piece = {*name.split("_")}, {*specimen.split("-")} | _WORDS_OF_PIECES
        labels = [key for key in conditions.labels if words <= {*words_of(split_written_name(key)[0]).split()}]
        said = {key: length_said(key, conditions.labels[key]) for key in labels}
        found = {key: length for key, length in said.items() if length}
        label = next(iter(found), "")
        if len(found) == 1 and {*words_of(split_written_name(label)[0]).split()} <= words | piece:
            conditions.geometry[name] = found[label]  # "dimple radius [mm]"
            del conditions.labels[label], lengths[name]
        elif found:
            what = f"'{quoted(label, 60)}' is a label, and no {name} of the {specimen} is stated; how many mm is it?"
            raise conditions.question(what, f"{name}_mm", *found.values())
    if lengths and (not is_named or len(conditions.geometry.keys() & conditions.terms.dimensions) >= len(lengths)):
        listed = "; ".join(f"{name} {length:g}" for name, length in lengths.items())
        what = "lengths by default: " if is_named else _BY_ITS_COLUMNS.format(specimen)
        conditions.record_assumption(f"{what}{listed} mm", first=not is_named)


_PLACES = {"middle": re.compile(r"mid|cent(?:re|er|ral)|mitte|mitten"), "load points": re.compile("load|last|roller")}


def _record_place(conditions: StatedConditions, table: CellTable, specimen: str) -> None:
    """Say where an output was read, if another specimen of the kind has it of another place; HistoryError for that."""
    own, known = known_specimens().get(specimen), known_specimens()
    for name, other in known.items():
        is_kin = own is not other and (isinstance(other, type(own)) or isinstance(own, type(other)))
        for one, two in zip(own.outputs, other.outputs, strict=False) if own and is_kin else ():
            if one != two or one.long_name == two.long_name:
                continue
            written = next((table.as_written(k) for k, c in enumerate(table.columns) if c.startswith(one)), "")
            said = next((place for place, words in _PLACES.items() if words.search(written.casefold())), "")
            if said and said in two.long_name:
                what = f"'{written}' is the {two.long_name}, and {specimen} has the {one.long_name}"
                raise HistoryError(f"{conditions.location}: {what}; write 'specimen: {name}'")
            if not said:
                conditions.record_assumption(f"{one.long_name} ({name} has the {two.long_name})")


_WORDS_OF_PIECES = {"plate", "sheet", "disc", "specimen", "sample", "piece", "initial", "nominal"}
"""That a head says beside the name of a length, such as "specimen thickness"."""


def questions_of_assumed(history: History) -> list[Question]:
    """What may be asked of a test whose specimen or lengths nobody stated; what is assumed is the likely answer."""
    is_named = not history.labels.get("assumed", "").startswith(_BY_ITS_COLUMNS.format(history.specimen))
    path, lengths = Path(history.source.partition(" (")[0]), lengths_by_default(history.specimen, history.geometry)
    what = f"no specimen is stated, and the columns are those of {history.specimen}; which is it?"
    asked: list[tuple[str, str, str | float]] = [] if is_named else [(what, "specimen", history.specimen)]
    if history.loading.quantity == "strain" and history.elastic is None:
        asked.append(("Young's modulus is not stated, by which stress relaxes; how many GPa is it?", "modulus_GPa", ""))
    asked += [(f"{one} is not stated; how many mm is it?", f"{one}_mm", mm) for one, mm in lengths.items()]
    choices = ((likely,) if likely else () for *_, likely in asked)
    named = zip(asked, choices, strict=True)
    return [Question(path, str(path), what, key, likely, is_free=True) for (what, key, _), likely in named]


_SOME_OUTPUTS = "of a specimen, such as strain_pct, stress_MPa (relaxation), deflection_mm, elongation_mm, amplitude_mm"


def _specimen_and_outputs(
    conditions: StatedConditions, frames: TableFrames, load: str, location: str
) -> tuple[str, dict[str, Floats]]:
    """The specimen, as named or as outputs and load identify it, and its outputs."""
    named, terms = conditions.take_text("specimen", conditions.default_specimen), conditions.terms
    present = terms.specimens_with(frames.values)
    if named in terms.outputs:
        chosen = [named] if named in present else []
    else:
        chosen = [name for name in present if load in terms.loads.get(name, [load])] or present
    _refuse_unknown_specimen(named, terms, location)
    if len(chosen) != 1:
        if len(chosen) > 1:
            said = " ".join((*conditions.labels, *conditions.labels.values())).casefold()
            chosen.sort(key=lambda one: one.replace("-", " ") not in said)
            what = f"the columns are those of {' and '.join(chosen)}; which specimen is it?"
            raise conditions.question(what, "specimen", *chosen, location=location, is_free=False)
        needed = f"of '{named}' ({', '.join(terms.outputs[named])})" if named in terms.outputs else _SOME_OUTPUTS
        found = f" (found: outputs of {' and '.join(present)})" if present else ""
        raise HistoryError(f"{location}: missing column: no output {needed}{found}")
    outputs = {name: frames.values[name] for name in terms.outputs[chosen[0]] if name in frames.values}
    return named or chosen[0], outputs


def _refuse_unread_columns(frames: TableFrames, read_columns: Collection[str], known: Terms) -> None:
    """Refuse a column that would go unread, such as a pressure beside a stress."""
    read, table, errors = {"time", "used", *read_columns}, frames.table, list[HistoryError]()
    for quantity in [name for name in frames.values if name.removesuffix("_sd") not in read]:
        what = f"a column of {quantity} has no meaning beside {', '.join(sorted(read_columns))}; is it to stay unread?"
        written = (table.as_written(k) for k, name in enumerate(table.columns) if known.quantity(name) == quantity)
        errors.append(column_question(table, what, dict.fromkeys(written, UNUSED)))
    raise_all(errors)


def _standard_deviations(
    conditions: StatedConditions, frames: TableFrames, outputs: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Standard deviations by output, from a column or one number for all frames."""
    standard_deviations: dict[str, Floats] = {}
    for name in outputs:
        number, column = conditions.take_number(f"{name}_sd"), frames.values.get(f"{name}_sd")
        if number is not None and column is not None:
            raise HistoryError(f"{number.location}: '{number.key}' is also a column of the frames; keep one of them")
        if number is not None:
            standard_deviations[name] = np.full(frames.times.shape, number.value)
        elif column is not None:
            standard_deviations[name] = column
    return standard_deviations


def _used_frames(conditions: StatedConditions, frames: TableFrames) -> Bools:
    """Which frames a fit may use: those marked so, up to the end of the test; later ones saw the unloading."""
    used = np.asarray(frames.values.get("used", np.ones(frames.times.size)) == 1.0)
    for label, text in conditions.labels.items():
        if label.startswith("line ") and _EXTRAPOLATED.search(text):
            used &= frames.lines != int(label[5:])
            conditions.record_assumption(f"the {text} reading of {label} is not used".replace(",", ";"))
    end = conditions.take_number("end_time")
    if end is None:
        return used
    after = frames.times > end.value * (1 + 1e-9)
    if after.all():
        raise HistoryError(f"{end.location}: every frame lies after '{end.key}', {end.value:g} s; correct the end time")
    if after.any():
        conditions.labels["frames_after_end"] = str(int(after.sum()))
    return used & ~after


_EXTRAPOLATED = re.compile(r"extrapol|estimat|geschätzt|estimé", re.IGNORECASE)
"""Of a remark beside what is no reading."""


def _end_of_test(
    conditions: StatedConditions, frames: TableFrames, used: Bools, name: str, asks: bool
) -> tuple[float | None, bool]:
    """The rupture time, s, if the test ruptured, and whether it was stopped before; neither where nothing is said.

    A test that is said to have ruptured, without a time, did so when its last frame was taken. asks : whether a remark
    of that frame that is not clear is asked about.
    """
    time, ended, is_end = _time_and_end(conditions, frames.table.path, name, frames, asks)
    if is_end:
        return None, True
    if time is not None and ended == "stopped":
        what = f"the test was stopped, and '{time.key}' says when it ruptured; keep one of them"
        raise HistoryError(f"{time.location}: {what}")
    if time is not None or ended != "ruptured":
        return None if time is None else time.value, ended == "stopped"
    conditions.record_assumption("rupture at the last frame")
    return float(frames.times[used][-1] if used.any() else frames.times[-1]), False
