"""Tables beside the best law's values: values of every credible law, and how the estimates are correlated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from creepkit.inverse.compared_tests import UNTESTABLE, rests_on_durations
from creepkit.inverse.uncertainty.correlation import STRONG_CORRELATION
from creepkit.inverse.uncertainty.laplace_approximation import bound_marks
from creepkit.reports.contents import ExportedFile
from creepkit.reports.html.elements import Block, Paragraph, Table, number, printable, with_interval
from creepkit.reports.identification_text import rejected

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.uncertainty.correlation import Correlation
    from creepkit.inverse.uncertainty.laplace_approximation import Estimate
    from creepkit.language import CreepLaw

MOST_CORRELATED = 12
"""Parameters up to which their correlations are a table."""


LAW_REJECTED = "the law does not fit"
"""What stands for what tests say of a parameter, where they reject the law."""


def law_title(law: CreepLaw, *, longest: int = 160) -> str:
    """The title of a law; its name where it has none."""
    return printable(law.title or law.name, longest)


def titled_law(law: CreepLaw) -> Markup:
    """The title of a law with its name in the font of code, by which commands and files know it."""
    if not law.title:
        return Markup("<code>{}</code>").format(printable(law.name, 120))
    return Markup("{} (<code>{}</code>)").format(law_title(law), printable(law.name, 120))


def credible_values(ranking: Ranking | None) -> list[Block]:
    """Values and intervals of every credible law, where the tests do not decide for one; each given its own law."""
    if ranking is None or ranking.decisive or len(ranking.credible) < 2:
        return []
    rows = [
        (
            law_title(one.fit.law),
            f"{one.weight:.3f}",
            e.name,
            *with_interval(e.value, e.low, e.high, bound_marks(one.fit.law, e)),
            "" if e.unit == "1" else e.unit,
            LAW_REJECTED if rejected(one.fit) else verdict_given_law(one.fit, e),
        )
        for one in ranking.credible
        for e in one.fit.estimates
    ]
    columns = ("law", "weight", "parameter", "value", "95 % interval", "unit", "given this law")
    caption = "Values of every credible law, of weight above 0.05: each interval holds only if its law is right"
    untested = [one.fit for one in ranking.credible if rests_on_durations(one.fit.law, one.fit.histories)]
    said = f"{', '.join(law_title(fit.law) for fit in untested)}: {UNTESTABLE}." if untested else ""
    return [Table(caption, columns, rows, numeric=(1, 3, 4)), *([Paragraph(said, "note")] if said else [])]


def verdict_given_law(fit: Identification, estimate: Estimate) -> str:
    """What tests say of a parameter given its law; of a law that they do not test, that they do not."""
    untested = rests_on_durations(fit.law, fit.histories)
    return f"{estimate.verdict}, but not testable" if untested else estimate.verdict


def correlation_table(fit: Identification) -> list[Block]:
    """Correlations of the estimated parameters, given the law."""
    correlation = fit.correlation()
    names = [printable(name, 80) for name in correlation.names]
    if len(names) < 2:
        return []
    if len(names) > MOST_CORRELATED:
        return [Paragraph(f"The correlations of {len(names)} parameters are in the file of the identification.")]
    rows = [(name, *(number(float(v), 3) for v in row)) for name, row in zip(names, correlation.matrix, strict=True)]
    caption = f"Correlations of the estimates of the {law_title(fit.law)}; ln where the logarithm is estimated"
    table = Table(caption, ("parameter", *names), rows, numeric=tuple(range(1, len(names) + 1)))
    return [table, *_rounding_warning(correlation)]


def _rounding_warning(correlation: Correlation) -> list[Block]:
    """That the values of strongly correlated parameters belong together, with the strongest correlation."""
    size = np.abs(np.triu(correlation.matrix, 1))
    if not size.max() > STRONG_CORRELATION:
        return []
    k, j = np.unravel_index(int(size.argmax()), size.shape)
    first, second = (printable(correlation.names[i], 80) for i in (k, j))
    return [
        Paragraph(
            f"{first} and {second} have a correlation of {number(float(correlation.matrix[k, j]), 4)}: their values "
            "hold together only. Rounding one of them, or taking it from elsewhere, changes the creep rate by far more "
            "than its interval; carry all digits, and take uncertainties of rates from the covariance, which is among "
            "the files to download.",
            "warning",
        )
    ]


def covariance_file(fit: Identification) -> ExportedFile:
    """The covariance of the estimates as a table: in ln of parameters of logarithmic scale, else in their units."""
    correlation = fit.correlation()
    covariance = correlation.matrix * np.outer(correlation.sd, correlation.sd)
    units = ["1" if p.scale == "log" else p.unit for p in fit.law.table.values()]
    values = [p.to_internal(fit.values[name]) for name, p in fit.law.table.items()]
    lines = [
        f"# covariance of the estimates of law {printable(fit.law.name, 160)}; ln A: of the natural logarithm of A, in",
        "# its unit; given the law, in the Gaussian approximation at the optimum",
        ",".join(["parameter", "unit", "estimate", *correlation.names]),
    ]
    for name, unit, value, row in zip(correlation.names, units, values, covariance, strict=True):
        lines.append(",".join([name, unit, f"{value:.12g}", *(f"{v:.12g}" for v in row)]))
    return ExportedFile("covariance.csv", f"covariance of the estimates, {law_title(fit.law)}", "\n".join(lines) + "\n")
