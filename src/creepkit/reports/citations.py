"""Citations of methods, and their numbers in a text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.metadata import version

from creepkit.laws.paper import PAPER
from creepkit.reports.blocks import printable

CITATIONS = {
    "sobol": "I. M. Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86-112",
    "levenberg": "K. Levenberg (1944), Q. Appl. Math. 2, 164-168; D. W. Marquardt (1963), J. SIAM 11, 431-441",
    "weighted least squares": "G. A. F. Seber, C. J. Wild (1989), Nonlinear Regression, Wiley, New York",
    "reml": "H. D. Patterson, R. Thompson (1971), Biometrika 58, 545-554",
    "satterthwaite": "F. E. Satterthwaite (1946), Biometrics Bull. 2, 110-114",
    "bic": "G. Schwarz (1978), Ann. Stat. 6, 461-464",
    "aicc": "C. M. Hurvich, C.-L. Tsai (1989), Biometrika 76, 297-307",
    "larson-miller": "F. R. Larson, J. Miller (1952), Trans. ASME 74, 765",
    "orr-sherby-dorn": "R. L. Orr, O. D. Sherby, J. E. Dorn (1954), Trans. ASM 46, 113",
    "manson-haferd": "S. S. Manson, A. M. Haferd (1953), NACA TN 2890",
    "wilshire": "B. Wilshire, A. J. Battenbough (2007), Mater. Sci. Eng. A 443, 156",
    "monkman-grant": "F. C. Monkman, N. J. Grant (1956), Proc. ASTM 56, 593",
    "lindley": "D. V. Lindley (1956), Ann. Math. Stat. 27, 986-1005",
    "chen": f"{PAPER}, Eq. (S3)",
    "student": "K. L. Lange, R. J. A. Little, J. M. G. Taylor (1989), J. Am. Stat. Assoc. 84, 881-896",
    "swarm": "M. Clerc, J. Kennedy (2002), IEEE Trans. Evol. Comput. 6(1), 58-73",
    "cma-es": "N. Hansen (2016), The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772",
    "pysindy": "B. M. de Silva et al. (2020), J. Open Source Softw. 5(49), 2104",
    "creepkit": f"The authors of creepkit, creepkit (software), version {version('creepkit')}, licence Apache-2.0",
}
"""{key: citation} of methods, and of creepkit as CITATION.cff has it; those of laws stand in the laws."""


_MARK = re.compile(r"⟦([0-9]+(?:,[0-9]+)*)⟧")
"""What stands for a citation until its number is known."""


class References:
    """Citations of a text, numbered in the order in which they stand in it."""

    def __init__(self) -> None:
        self._texts: dict[str, int] = {}

    def cite(self, *citations: str) -> str:
        """A mark, after a space, for citations or keys of CITATIONS, which `numbered` replaces; "" for none."""
        texts = [CITATIONS.get(c, printable(c, 400)) for c in citations]
        marks = dict.fromkeys(self._texts.setdefault(text, len(self._texts)) for text in texts)
        return f" ⟦{','.join(map(str, marks))}⟧" if marks else ""

    def numbered(self, text: str) -> tuple[str, list[str]]:
        """A text with ' [1, 2]' for its marks, in rising order, and its citations, the one of number 1 first."""
        order: dict[int, int] = {}

        def numbers(mark: re.Match[str]) -> str:
            cited = [int(one) for one in mark[1].split(",")]
            if max(cited) >= len(self._texts):  # brackets that stand in a name
                return mark[0]
            found = sorted(order.setdefault(one, len(order) + 1) for one in cited)
            return f"[{', '.join(map(str, found))}]"

        shown, texts = _MARK.sub(numbers, text), [*self._texts]
        return shown, [texts[one] for one in order]


def listed(words: Sequence[str]) -> str:
    """Words with commas, and 'and' before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}" if words else "none"
