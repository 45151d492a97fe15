"""Laws by their titles in the sentences of a report, whose findings name them as commands and files do."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import printable

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw

LONGEST_TITLE = 160
"""Characters of a title within a sentence."""


COMMON_WORD = re.compile(
    r"(a|combined|creep|double|exponential|generali[sz]ed|hyperbolic|linear|logarithmic|modified|power|primary|secondary"
    r"|steady|strain|sum|tertiary|the|threshold|time)\b",
    re.IGNORECASE,
)
"""At the beginning of a title, small within a sentence; other words may be names of people."""


SENTENCE_WORD = re.compile(
    r"a|above|alone|and|another|asked|at|be|best|but|by|carries|contradicted|decisive|does|each|effect|explains?|first|for|from|has|in|its?"
    r"|laws?|least|more|most|nearly|noise|none|not|of|only|or|rates?|second|share|stress|sum|tests?|that|the|them|these"
    r"|threshold|time|to|tried|was|weight|were|whether|which|with|would"
)
"""Words of findings, which stay words where a law is called by one of them."""


def title_in_sentence(law: CreepLaw) -> str:
    """The title of a law within a sentence: without abbreviations in brackets, and what follows a colon.

    The name of a law that has no title.
    """
    parts = re.sub(r"\s*\([A-Z]{2,4}\)", "", printable(law.title, LONGEST_TITLE)).split(" + ")
    parts = [part.partition(": ")[0] for part in parts]
    return " + ".join(map(_small, parts)) if law.title else printable(law.name, LONGEST_TITLE)


def _small(title: str) -> str:
    return f"{title[:1].lower()}{title[1:]}" if COMMON_WORD.match(title) else title


DEPENDENCE = re.compile(r" with [\w -]+ temperature dependence$")
"""At the end of a title of a law with temperature."""


def _without_shared_dependence(titles: Mapping[str, str]) -> dict[str, str]:
    """{name: title}, short where every title ends with the same dependence on temperature, which tells none apart."""
    endings = {match[0] if (match := DEPENDENCE.search(title)) else "" for title in titles.values()}
    if len(endings) != 1 or len(titles) < 2:
        return dict(titles)
    (ending,) = endings
    return {name: title.removesuffix(ending) for name, title in titles.items()}


class LawNames:
    """Names of laws in a text, replaced by titles."""

    def __init__(self, laws: Iterable[CreepLaw]) -> None:
        titles = _without_shared_dependence({law.name: title_in_sentence(law) for law in laws})
        shared = Counter(titles.values())
        self.titles = {
            name: title if shared[title] == 1 else f"{title} ({name})"  # which of them is meant, its name says
            for name, title in titles.items()
            if not SENTENCE_WORD.fullmatch(name) and title != name
        }
        longest_first = sorted(self.titles, key=len, reverse=True)
        self._pattern = re.compile(rf"(?<![\w*+-])(?:{'|'.join(map(re.escape, longest_first))})(?![\w*+(-])")

    @classmethod
    def of(cls, fits: Iterable[Identification]) -> LawNames:
        """Those of all laws that were fitted."""
        return cls({fit.law.name: fit.law for fit in fits}.values())

    def in_text(self, text: str) -> str:
        """The text with titles in place of names; longer words that begin or end with a name stay as they are."""
        return self._pattern.sub(lambda name: self.titles[name[0]], text) if self.titles else text
