"""Citations of methods, and their numbers in a text."""

from __future__ import annotations

from collections.abc import Sequence

from creepkit.reports.html.elements import printable

CITATIONS = {
    "sobol": "I. M. Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86-112",
    "levenberg": "K. Levenberg (1944), Q. Appl. Math. 2, 164-168; D. W. Marquardt (1963), J. SIAM 11, 431-441",
    "sandwich": "H. White (1980), Econometrica 48, 817-838",
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
    "chen": "H. Chen et al., Machine Learning-Driven Creep Law Discovery Across Alloy Compositional Space, Eq. (S3)",
    "student": "K. L. Lange, R. J. A. Little, J. M. G. Taylor (1989), J. Am. Stat. Assoc. 84, 881-896",
    "swarm": "M. Clerc, J. Kennedy (2002), IEEE Trans. Evol. Comput. 6(1), 58-73",
    "cma-es": "N. Hansen (2016), The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772",
    "pysindy": "B. M. de Silva et al. (2020), J. Open Source Softw. 5(49), 2104",
}
"""{key: citation} of methods; those of laws stand in the laws."""


class References:
    """Citations in the order of their first mention, each with its number."""

    def __init__(self) -> None:
        self.listed: list[str] = []

    def cite(self, *citations: str) -> str:
        """' [1, 2]' for citations, or keys of CITATIONS, in rising order; '' for none."""
        texts = [CITATIONS.get(c, printable(c, 400)) for c in citations]
        for citation in texts:
            if citation not in self.listed:
                self.listed.append(citation)
        numbers = sorted({self.listed.index(citation) + 1 for citation in texts})
        return f" [{', '.join(map(str, numbers))}]" if numbers else ""


def listed(words: Sequence[str]) -> str:
    """Words with commas, and 'and' before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}" if words else "none"
