"""How a test ended, by rupture or before it, from what laboratories write of it in English, German, French, Italian,
Spanish and Dutch.

A text is taken apart into clauses and words without accents. Words of rupture count unless they are negated ("not yet
broken", "kein Bruch", "pas de rupture") or said to lie ahead ("removed before rupture"). A column is decided by the
words of its name and its two values (Censored: 1 and 0), by its texts, or by a pair of codes (F and S). What speaks of
the end and does not decide is asked for: a test that did not break never becomes a rupture without a word.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

from creepkit.files.delimited_text import is_missing
from creepkit.readers.vocabulary import unit_suffix
from creepkit.records.quantities import TIME

RUPTURED, STOPPED, INTERRUPTED, UNCLEAR = "ruptured", "stopped", "interrupted", "unclear"
"""What a text says of the end. INTERRUPTED: it stopped, for good or for a while. UNCLEAR: of both, or of neither."""

LABEL = "label"
"""An answer: the text says nothing of the end."""

FIRM = (RUPTURED, STOPPED, "status")
"""Kinds of columns that are about the end."""


def _words(*alternatives: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w])(?:{'|'.join(alternatives)})(?![\w])")


_RUPTURE = (
    r"rupt(?:ur\w*|ed|s)?|frac|gebr|ausfall\w*|broken?|brk|breaks?|breaking|breakage|fail(?:s|ed|ing|ures?)?|fractur\w*"
    r"|snapped|parted|(?:zer)?gebrochen\w*|zerbrochen\w*|(?:kriech|zeitstand|dauer|proben|gewalt|sprod|rest)?br[uü]che?"
    r"|bricht|(?:ab|durch)?gerissen\w*|zerrissen\w*|versag\w*|romp(?:u|us|ues?|t|re)|cass(?:e|ee|es|ees|er|ure)"
    r"|bris(?:e|ee|es|ees|er|ure)|defaillance|rott[aoei]|rottur[ae]|spezzat\w*|cedut[aoei]|fratturat\w*|rot[ao]s?"
    r"|rotura|rompio|fracturad\w*|quebrad\w*|gebroken|(?:kruip)?breuk|bezweken|(?:ge|door)scheurd\w*"
)
_CENSORED = r"(?:right |left )?cens(?:or\w*)?|censur\w*|zensi?er\w*|suspen[sd]\w*|sospes\w*"
_GOES_ON = (
    rf"run ?outs?|(?:failure|rupture|fracture) free|{_CENSORED}|unbroken|unfailed|unruptured|unfractured|discontinu\w+"
    r"|surviv\w*|survecu\w*|running|on ?going|in progress|(?:in|on|under) test|test continu\w*"
    r"|(?:durch)?lauf(?:er|end\w*|t(?: noch| weiter)?)|un(?:ge|zer)broch\w*|disc(?= ?(?:\||$))|bruchfrei\w*"
    r"|bruchlos\w*|uberleb\w*|im versuch|en cours|en essai|essai continu\w*|in corso|in prova|en curso|en ensayo"
    r"|continua|loopt(?: nog| door)*|nog bezig|lopend\w*|(?:uit|door)loper\w*|ongebroken|breukvrij\w*|gecensureerd\w*"
)
_INTERRUPTED = (
    r"broken off|interr|aktiv\w*|intactes?|stopp?(?:ed|s)?|halted|aborted|interrupt\w*|removed|withdrawn|unloaded"
    r"|truncated|intact|active|gestoppt\w*|abgebroch\w*|angehalten|ausgebaut\w*|entlastet\w*|unterbroch\w*|unterbruch"
    r"|abbruch|intakt\w*|arret\w*|stoppe\w*|interromp\w*|interruption|demont\w*|decharg\w*|retire\w*|gestopt\w*"
    r"|stopgezet\w*|onderbrok\w*|afgebrok\w*|verwijderd|uitgebouwd|uitgenomen|ontlast|interrott\w*|interrumpid\w*"
    r"|fermat\w*|detenid\w*|parad[ao]|smontat\w*|desmontad\w*|scaricat\w*|descargad\w*"
)
_NOT = (
    r"no|not|non|none|never|without|(?:did|has|does|was|had|is|have)n ?t|yet to|nicht|kein\w*|ohne|nie|pas|sans|jamais"
    r"|aucun\w*|nein|niet|geen|nooit|zonder|nee|senza|sin|nessun\w*|ningun\w*|nunca"
)
_FILLERS = (
    r"(?: (?:yet|a|any|been|be|has|have|the|specimen|sample|test|bar|probe|noch|der|die|den|de|d|la|l|le|ete|encore|est"
    r"|eprouvette|essai|creep|zum|es|ist|wurde|was|did|to|due|bis|jusqu|au|a|zu"
    r"|nog|het|een|is|werd|prof|profstuk|profstaaf|staaf|tot"
    r"|si|e|stat[ao]|il|lo|provino|campione|ha|se|probeta|muestra|el|ancora|aun|todavia))*"
)
_NO_READING = "".join(f"(?<!{one} )" for one in ("reading", "value", "point", "frame", "messung", "messwert", "mesure"))
_AHEAD = (
    r"before|prior to|short of|vor|vor dem|avant|avant la|bevor|prima d(?:i|ella)|antes de(?: la)?|voor(?:dat| de)?"
)
_EXPECTED = _words(
    r"before|prior|avant|vor|bevor|prima|antes|quasi|casi|could|would|might|may|should|konnte|pourrait|nearly|almost",
    rf"(?:near(?:ing)?|close to){_FILLERS} (?:{_RUPTURE})",
    r"imminent|expected|likely|will|soon|kurz vor|fast|still|noch|yet|encore|toujours|pending|outstanding|aus",
    r"beinahe|erwartet|bald|wird|soll|presque|proche|prevue?|attendue?|bientot|if|bijna|voor|verwacht\w*|nog|zal",
)
_REACHED = (
    r"(?: (?:reached|attained|obtained|obtenue?|observed|occurred|seen|yet|noch|erreicht|eingetreten|aufgetreten"
    r"|atteinte?|observee?|survenue?|occur|ein|bereikt|opgetreden))*"
)
_UNBROKEN = re.compile(
    rf"(?<!\w)(?:(?:{_NOT}){_FILLERS} (?:{_RUPTURE})|{_NO_READING}(?:{_AHEAD}){_FILLERS} (?:{_RUPTURE})"
    rf"|fail(?:ed|s)? to (?:{_RUPTURE})"
    rf"|(?:{_RUPTURE})(?: (?:noch|n a|did|was|has|trat|wurde|ist|est))? (?:{_NOT})(?: ete)?{_REACHED}"
    r"(?= ?(?:\||$)))(?!\w)"
)
_UNCENSORED = re.compile(rf"(?<!\w)(?:(?:{_NOT}){_FILLERS} (?:{_CENSORED})|un(?:{_CENSORED}))(?!\w)")
_NOT_INTERRUPTED = re.compile(
    rf"(?<!\w)(?:(?:{_NOT}|plus|no longer){_FILLERS} (?:{_GOES_ON}|{_INTERRUPTED})|lauft (?:nicht|nimmer))(?!\w)"
)
_ENDED = _words(
    r"ended|finished|complete[d]?|terminat\w*|beendet\w*|abgeschlossen|fertig|termine\w*|fini\w*|stop date",
    r"concluid\w*|conclus\w*|beeindigd|voltooid|afgelopen",
)
_DOUBTFUL = _words(
    r"unloading|removal|dismount\w*|cooling|reload\w*|restart\w*|ausbau|entlasten|abkuhlen|demontage|dechargement",
    r"furnace|oven|thermocouples?|tc|power|mains|grips?|machine|rig|heaters?|heating|controller|extensometer|lvdt",
    r"lever|pull rod|adapter|ofen|ofens|thermoelemente?s?|strom|stromausfall|netz|einspannung|maschine|heizung",
    r"regler|gestange|four|thermocouple|courant|regulation|extensometre|equipment|chauffage",
    r"klem\w*|inspanning|stroom\w*|afkolen|ontlasten|thermokoppel",
    r"versuchsende|(?:after|nach|apres)(?: the| dem| l)? (?:tests?|end|versuch|essai)|by hand|von hand|a la main",
    r"(?:failure|rupture|fracture|breakage|bruch) (?:of the|de la|de l|der|des|du) (?!specimen|sample|test|bar|piece"
    r"|probe|prufling|eprouvette|ga[u]?ge|weld|partie|steel|alloy|material|werkstoff|stahl|alliage|acier|legierung)[a-z]+",
)
"""Words of what breaks in the place of a test, of what it broke by, or that it broke when the test was over."""


_METHOD = _words(
    r"(?:creep |stress |zeitstand)?rupture (?:test|testing|tests|machine|rig|curve|data)|essais? de (?:fluage )?rupture"
)
"""Names of the method, which say nothing of an end."""


@lru_cache(maxsize=4096)
def plain_words(text: str) -> str:
    """A text in small letters without accents, its words one blank apart, and | between its clauses."""
    plain = unicodedata.normalize("NFKD", text.casefold())
    plain = "".join(sign for sign in plain if not unicodedata.combining(sign))
    for pair in ("ae", "oe", "ue"):  # also how umlauts are written without them
        plain = re.sub(rf"(?<!q){pair}(?=[a-z])", pair[0], plain)
    plain = re.sub(r"(?<=\d)[.,](?=\d)", "_", _without_short_forms(plain))
    plain = re.sub(r"[;,.!()\[\]/|]+", " | ", plain)
    return " ".join(re.sub(r"[^\w|?]+", " ", plain).split()).strip(" |")


def _without_short_forms(plain: str) -> str:
    """A text in small letters with short forms of not and none as words: `n. gebr.`, `o. Bruch`, `Bruch: n/a`."""
    plain = re.sub(r"\b(?:n/a|n\.\s?a\.?|k\.\s?a\.?|n\.\s?b\.?)(?!\w)|(?<=[:=])\s*[-–—]+\s*$", " none ", plain)
    return re.sub(r"\b([nok])\.\s*(?=gebr|br|rupt|romp|fail|cass)", "ohne ", plain)


@lru_cache(maxsize=4096)
def end_said_by(text: str) -> str:
    """What a text says of the end of a test: RUPTURED, STOPPED, INTERRUPTED, UNCLEAR; "" where it speaks of none."""
    plain, said = plain_words(text), set[str]()
    if plain.endswith("?"):
        return UNCLEAR if end_said_by(plain.rstrip("? ")) else ""
    plain = _METHOD.sub(" ", plain)
    for pattern, what in ((_UNBROKEN, STOPPED), (_UNCENSORED, RUPTURED)):
        plain, count = pattern.subn(" ", plain)
        said |= {what} if count else set()
    plain, goes_no_more = _NOT_INTERRUPTED.subn(" ", plain)
    aside = plain_words(" | ".join(re.findall(r"[(\[]([^)\]]*)", text)))  # "failed (grip slipped)"
    goes_on, breaks, stops = _words(_GOES_ON), _words(_RUPTURE), _words(_INTERRUPTED)
    for clause in plain.split("|"):
        if goes_on.search(clause):
            said.add(STOPPED)
            clause = goes_on.sub(" ", clause)
        if breaks.search(clause):
            subjects = re.findall(rf"([^\W\d]\w*) (?:{_RUPTURE})(?!\w)", clause)
            is_doubtful = (
                _DOUBTFUL.search(f"{clause} | {aside}")
                or _EXPECTED.search(clause)
                or _words(_NOT).search(clause)
                or not all(_NEUTRAL.fullmatch(one) or _BEFORE_RUPTURE.fullmatch(one) for one in subjects)
            )
            without = re.search(rf"(?:{_RUPTURE}) (?:without|ohne|sans) ", clause)
            said.add(UNCLEAR if is_doubtful and not without else RUPTURED)
        if stops.search(clause):
            said.add(INTERRUPTED)
    if STOPPED in said:
        said.discard(INTERRUPTED)
    return said.pop() if len(said) == 1 else UNCLEAR if said or goes_no_more or _ENDED.search(plain) else ""


_INVALID = re.compile(
    r"(?:do not|don.?t|not to be|never) use|not usable|^\W*void\W*$|\b(?:test|result) (?:is )?(?:void|invalid)\b"
    r"|\b(?:void|invalid) (?:test|result)|ungültig|nicht (?:verwenden|verwertbar|auswerten)|à (?:exclure|écarter)"
    r"|non valid[ao]|no válid[ao]|non usare|no usar|da escludere"
    r"|ne pas utiliser|non valide|not valid|disregard|verworfen|\binvalid\b|\bessai (?:nul|invalide)\b",
    re.IGNORECASE,
)
"""What a laboratory writes of a test that does not count."""


_ELSEWHERE = re.compile(
    r"outside(?: of)?(?: the)? ga[u]?ge|out of ga[u]?ge|ausserhalb (?:der )?mess|hors (?:de )?(?:la )?(?:longueur|zone)"
    r"|(?:at|in|near) (?:the )?(?:grips?|shoulders?|fillets?|threads?)|grip failure"
    r"|im (?:gewinde|kopf)|in der einspannung|buiten (?:de )?meetlengte|in de (?:klem|draad|inspanning)"
)


def invalidity_said_by(text: str) -> Literal["invalid", "elsewhere", ""]:
    """Whether a text says that a test is invalid, or that it broke elsewhere than in its gauge length."""
    plain = plain_words(text)
    return "invalid" if _INVALID.search(text) else "elsewhere" if _ELSEWHERE.search(plain) else ""


YES = frozenset(
    (
        *("1", "1.0", "1,0", "yes", "y", "si", "sì", "sí", "ja", "j", "oui", "o", "true", "wahr", "vrai", "t", "x"),
        *("*", "+", "✓", "✔", "✗"),
    )
)
NO = frozenset(("0", "0.0", "0,0", "no", "n", "nee", "nein", "non", "false", "falsch", "faux"))
"""Values of a column that says yes or no, in small letters."""


_CODES: Mapping[frozenset[str], Mapping[str, str]] = {
    frozenset((broken, *others)): {broken: RUPTURED, **dict.fromkeys(others, STOPPED)}
    for broken, others in (
        *(("f", (one,)) for one in ("s", "c", "ro", "r", "u", "nf", "d", "i")),
        *(("r", (one,)) for one in ("ro", "nr", "u", "ur", "c", "s", "d")),
        *(("b", (one,)) for one in ("nb", "ub", "u", "ro", "d", "l", "s")),
        *(("g", (one,)) for one in ("ng", "u", "l", "d")),
        ("f", ()),
    )
} | {frozenset((one,)): {one: STOPPED} for one in ("ro", "nb", "nf", "nr", "ub", "ng")}
"""Codes that stand together in a column: F and S, R and RO, B and NB, G and L."""


_STATUS_WORDS = _words(
    r"status|statut|state|etat|zustand|result|resultat|ergebnis|outcome|ende|end|ended|ending|fin|issue",
    r"esito|stato|estado|risultato|resultado|termination|versuchsende|prufende|prufstatus|abbruchgrund|versuchsstatus|code|versuchsausgang|ausgang",
    r"resultaat|tostand|einde|uitkomst|reden|afloop|endart|motif|abschaltgrund|stoppgrund|endgrund|reason|grund",
)
_STATUS_FILLERS = _words(
    r"test|of|the|specimen|sample|final|de|l|d|essai|der|des|probe|versuch|prufung|reason|for|type|how|it|why",
    r"della|prova|provino|del|ensayo|di|fine|grund|du|arret|eprouvette|versuchs|mode|art|end|at|van|het|prof|profstuk",
)
_REMARK_WORDS = _words(
    r"remark|remarks|note|notes|comment|comments|bemerkung|bemerkungen|anmerkung|bem|anmerkungen|kommentar",
    r"kommentare|hinweis|hinweise|notiz|notizen|remarque|remarques|observation|observations|commentaire",
    r"opmerking(?:en)?|notities?|tolichting|waarneming(?:en)?",
    r"nota|notas|osservazion[ei]|commento|commenti|observacion(?:es)?|comentarios?|annotazioni|commentaires|rem|anm|beobachtung|beobachtungen|meldung|meldungen|message|messages",
)
_OTHER_USES = _words(
    r"time|life|zeit|temps|duree|elongation|strain|dehnung|load|stress|hours|parameter|stunden|heures|location",
    r"tijd|duur|rek|spanning|belasting|uur|uren|verlenging|plaats|locatie|positie|soort|snelheid|kruipsnelheid",
    r"tempo|tiempo|durata|duracion|vita|vida|ore|horas|carico|carga|sforzo|tensione?|deformazione|deformacion|velocita",
    r"velocidad|allungamento|alargamiento|posizione|posicion|zona|position|lage|mode|type|typ|ort|appearance|allongement|rate|(?:kriech)?(?:rate|geschwindigkeit)|vitesse",
)
"""Words beside one of rupture that make the name of a column that of a quantity or a description."""


_DESCRIPTION = re.compile(
    rf"(?<!\w)(?:(?:{_RUPTURE}).* (?:location|position|mode|type|appearance|site)"
    rf"|(?:location|mode|type|position|lieu|zone|site|plaats|soort) .*(?:{_RUPTURE})"
    r"|bruch(?:lage|art|ort|stelle|form|typ|bild|flache))(?!\w)"
)
"""Names of columns that say where or how a test broke, and are empty where it did not."""


_NEUTRAL = _words(
    r"neck\w*|oxid\w*|scal\w*|heat|cast|batch|charge|lot|gau?ge\w*|length|thread\w*|shoulder\w*|fillet\w*|head\w*",
    r"surface\w*|crack\w*|cavit\w*|void\w*|pore\w*|creep|ductile\w*|brittle\w*|intergranular\w*|transgranular\w*",
    r"grain\w*|notch\w*|weld\w*|breakthrough\w*|of|in|the|a|an|and|with|near|at|outside|inside|normal\w*",
    r"specimen\w*|sample\w*|bar\w*|ok|air|argon|vacuum|batch\w*|aged|anneal\w*|einschnur\w*|messlange|gewinde",
    r"schulter|kopf|oxidiert|verzunder\w*|riss\w*|korngrenz\w*|duktil\w*|sprod\w*|schmelze|probe\w*|im|der|die|das",
    r"und|striction\w*|fissur\w*|ductile|fragile|coulee\w*|filetage|conge|dans|la|le|du|de|hors|partie|utile",
    r"intergranulaire\w*|transgranulaire\w*|oxyd\w*|et|tete|mode|[a-z]{0,3}\d[\w]*",
)
"""Words of remarks that tell something else than an end: what a specimen looks like, where it stems from."""


_BEFORE_RUPTURE = _words(
    _RUPTURE,
    r"is|was|has|had|have|been|it|then|finally|later|tests?|piece|to|until|till|by|when|after|stress|strain|tertiary|final",
    r"early|late|premature\w*|suddenly?|complete\w*|fully?|partial\w*|clean|shear|tensile|cone|metal|haz|iv|material",
    r"base|parent|found|ended|ends?|ran|on|due|time|h|hours?|days?|reached|steel|alloy|not|ist|wurde|war|hat|bis|zum|zu",
    r"nach|durch|mit|am|dann|endgultig\w*|prufling|probekorper|stab|werkstoff|vorzeitig\w*|est|ete|s|eprouvettes?|apres",
    r"provin[oi]|provett[ae]|campion[ei]|prova|probetas?|muestras?|ensayo|ha|hanno|se|si|e|stat[ao]|da|di|alla?|del(?:la)?",
    r"na|uur|bij|en|prof|profstuk|profstaaf|staaf|monster|volledig\w*|taaie?|brosse?|materiaal|werd",
    r"dopo|ore|tras|despues|horas|con|regolare|normale|a|puis|par|jusqu|en|brutale?|nette|finale?|prematuree?|essai|metaux|duktiler|l",
)
"""Words that stand before one of rupture where the specimen broke: any other is of what else did."""


def is_neutral(text: str) -> bool:
    """Whether a remark speaks of nothing but what a specimen looks like, or where it stems from."""
    plain = plain_words(text)
    return bool(plain) and not _NEUTRAL.sub(" ", plain).replace("|", " ").strip()


def legend_in(text: str) -> dict[str, str]:
    """{sign or code: end} of `1 = failed, 0 = censored` or `* run-out`, as names of columns and notes explain them."""
    found: dict[str, str] = {}
    text = re.sub(rf"(?i)^\s*(?:{_REMARK_WORDS.pattern})\s*:\s*", "", text)
    for sign, words in re.findall(r"(\(\)|\S{1,12}?)\s*(?:=|:|\N{EN DASH}|means|bedeutet)\s*([^,;()=]+)", text):
        if (said := end_said_by(words)) in (RUPTURED, STOPPED, INTERRUPTED):
            found[sign.strip("'\"([ ").casefold() or "()"] = RUPTURED if said == RUPTURED else STOPPED
    marked = re.match(r"\s*([*+†‡#^>]+|\(\))\)?\s*(.+)", text)
    if marked and (said := end_said_by(marked[2].lstrip("=: "))) in (RUPTURED, STOPPED, INTERRUPTED):
        found[marked[1]] = RUPTURED if said == RUPTURED else STOPPED
    return found


@dataclass(frozen=True)
class EndsOfColumn:
    """What a column says of the ends of the tests.

    ends : of each test RUPTURED, STOPPED, or "" where it says nothing. asked : texts that may say something and are not
    understood, "" for an empty cell; they stand where `ends` has UNCLEAR. is_remark : whether it is a column of
    remarks, which a status overrules.
    """

    ends: tuple[str, ...]
    asked: tuple[str, ...] = ()
    is_remark: bool = False
    values: frozenset[str] = field(default_factory=frozenset)


def kind_of_column(name: str) -> str:
    """What the name of a column says: RUPTURED or STOPPED of tests with a yes, "status", "remark", or ""."""
    plain = plain_words(re.sub(r"\(.*?\)|\[.*?\]|\?", " ", name))
    words = set(plain.replace("|", " ").split()) - {"y", "n", "j", "ja", "nein", "yes", "no", "oui", "non"}
    words = {one for one in words if len(one) > 2} or words if name.count("/") > 1 else words  # "Status B / UB / I"
    if any(map(_REMARK_WORDS.fullmatch, words)):
        return "remark"
    said = end_said_by(plain)
    if re.fullmatch(r"(?:event|evenement|ereignis)(?: indicator| observed| occurred)*", plain):
        return RUPTURED
    if len(words) == 1 and _CODES.get(frozenset(words), {}).get(next(iter(words))) == STOPPED:
        return STOPPED
    if "/" in name and (
        (said == UNCLEAR and not _OTHER_USES.search(plain)) or frozenset(re.split(r"\W+", name.casefold())) in _CODES
    ):
        return "status"
    if _DESCRIPTION.search(plain):
        return "description"
    if said in (RUPTURED, STOPPED, INTERRUPTED) and not _OTHER_USES.search(plain) and len(words) <= 4:
        return RUPTURED if said == RUPTURED else STOPPED
    others = [word for word in words if not _STATUS_WORDS.fullmatch(word)]
    return "status" if len(others) < len(words) and all(map(_STATUS_FILLERS.fullmatch, others)) else ""


def ends_in_column(
    name: str, cells: Sequence[str], answers: Mapping[str, str], others_decide: Sequence[bool]
) -> EndsOfColumn:
    """What a column says of the end of each test.

    answers : {text or code in small letters: RUPTURED, STOPPED or LABEL} that were given. others_decide : of each cell,
    whether another column says how the test ended, so that a remark that is not understood leaves nothing open.
    """
    kind, answers = kind_of_column(name), {**legend_in(name), **answers}
    says = [not is_missing(cell) or (kind != "" and cell.casefold() in ("n.b.", "n. b.")) for cell in cells]
    texts = [" ".join(cell.split()) if one else "" for one, cell in zip(says, cells, strict=True)]
    plain = {text.casefold() for text in texts if text}
    meanings = _meanings(kind, plain)
    meanings |= {text: answers[text] for text in {*plain, ""} if text in answers}
    ends, asked = list[str](), dict[str, None]()
    for text, is_decided in zip(texts, others_decide, strict=True):
        end = meanings.get(text.casefold(), UNCLEAR)
        if end == UNCLEAR and kind not in FIRM and is_decided:
            end = ""
        if end == UNCLEAR:
            asked[text] = None
        ends.append("" if end == LABEL else end)
    return EndsOfColumn(tuple(ends), tuple(asked), kind == "remark", frozenset(plain))


def _meanings(kind: str, plain: Set[str]) -> dict[str, str]:
    """{text in small letters: end} of the distinct texts of a column, and of an empty cell."""
    if plain == {"t", "f"} and kind in (RUPTURED, STOPPED):
        return {**_meanings_of_flags(kind, {"t", "n"}), "f": STOPPED if kind == RUPTURED else RUPTURED}
    if kind != "remark" and plain and plain <= YES | NO:
        return _meanings_of_flags(kind, plain)
    found = {text: _meaning_of_text(kind, text) for text in plain}
    if kind in FIRM:
        pairs = [codes for texts, codes in _CODES.items() if texts == plain or (len(texts) > 1 and texts < plain)]
        found |= pairs[0] if len(pairs) == 1 else {}
    if kind == "description" and plain:
        return {text: UNCLEAR if _is_nothing(text) else end for text, end in found.items()} | {"": UNCLEAR}
    if kind == "" and len(plain) == 2 and frozenset(plain) in _CODES:
        return {**dict.fromkeys(plain, UNCLEAR), "": ""}
    says = set(found.values())
    # Beside texts that all say that a test broke, an empty cell may say that this one did not.
    found[""] = UNCLEAR if kind in FIRM and RUPTURED in says else ""
    return found


def _is_nothing(text: str) -> bool:
    return text in NO or re.fullmatch(r"none|nil|kein\w*|ohne|aucun\w*|sans", text) is not None


def _meanings_of_flags(kind: str, plain: Set[str]) -> dict[str, str]:
    if kind == "" and len(plain) == 1 and not plain <= {"x", "*", "+", "yes", "ja", "oui", "✓", "✔"}:
        return {**dict.fromkeys(plain, ""), "": ""}
    if kind not in (RUPTURED, STOPPED):
        return {**dict.fromkeys(plain, UNCLEAR), "": ""}
    other = STOPPED if kind == RUPTURED else RUPTURED
    found = {text: kind if text in YES else other for text in plain}
    # x and empty cells are yes and no; an empty cell beside yes and no may be either.
    return {**found, "": other if YES.issuperset(plain) else UNCLEAR}


def _meaning_of_text(kind: str, text: str) -> str:
    said = end_said_by(text)
    if kind in FIRM:
        return STOPPED if said == INTERRUPTED else said or UNCLEAR
    if kind == "remark":
        return UNCLEAR if said == INTERRUPTED else said or ("" if is_neutral(text) else UNCLEAR)
    return {STOPPED: STOPPED, INTERRUPTED: UNCLEAR, UNCLEAR: UNCLEAR}.get(said, "")


# ---- marks of times ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MarkedTime:
    """A time with what its mark says: RUPTURED, STOPPED, UNCLEAR or ""; number : "" where a word takes its place."""

    number: str
    said: str
    mark: str = ""


TIME_IN_CELL = re.compile(
    r"(?P<before>[^\d+-]*?)\s*(?P<number>[+-]?\d[\d.,]*(?:[eEdD][+-]?\d+)?|[+-]?[.,]\d+)\s*(?P<after>[^\d].*)?",
    re.DOTALL,
)
"""A number in a cell of times, with what stands before and behind it."""


_LONGER = re.compile(
    r"[>≥＞⩾]=?|=>|over|above|more than|greater than|longer than|at least|über|ueber|mehr als|länger als|mind\.?"
    r"|mindestens|plus de|supérieure? à|au moins",
    re.IGNORECASE,
)
_ONWARDS = re.compile(r"[+→⇒➔>]|->|-->|=>|\.\.\.|…|ff\.?")


def marked_time(text: str, answers: Mapping[str, str]) -> MarkedTime:
    """A cell of times: a number, marked as a run-out or not, or a word.

    answers : {sign or text in small letters: end}.
    """
    whole = " ".join(text.split())
    match = TIME_IN_CELL.fullmatch(whole)
    if match is None:
        end = answers.get(whole.casefold()) or end_said_by(whole) or UNCLEAR
        return MarkedTime("", STOPPED if end == INTERRUPTED else end, whole)
    before, number, after = match["before"] or "", match["number"], (match["after"] or "").strip()
    after = after if unit_suffix(after.split(" ")[0].rstrip(".,;()")) not in TIME.units else after.partition(" ")[2]
    if before.strip("([ ") == "" and before:
        before, after = "", "()" + after.replace(")", "").replace("]", "").strip()
    before = before.strip()
    if not before and not after:
        return MarkedTime(number, "")
    mark = before or after
    if (said := answers.get(mark.casefold()) or answers.get(whole.casefold())) is not None:
        return MarkedTime(number, "" if said == LABEL else said, mark)
    if _LONGER.fullmatch(before) and (not after or end_said_by(after) != RUPTURED):
        return MarkedTime(number, STOPPED, mark)
    if not before and _ONWARDS.fullmatch(after):
        return MarkedTime(number, STOPPED, mark)
    said = {STOPPED: STOPPED, "interrupted": STOPPED, RUPTURED: RUPTURED}.get(end_said_by(mark), "")
    codes = {"ro": STOPPED, "nb": STOPPED, "nr": STOPPED, "nf": STOPPED}
    return MarkedTime(number, said or codes.get(after.strip("() ").casefold(), UNCLEAR), mark)
