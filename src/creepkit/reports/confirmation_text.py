"""Text of confirmations and cross-validations of identifications."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from creepkit.reports.json_values import finite

if TYPE_CHECKING:
    from creepkit.inverse.confirmation import Confirmation
    from creepkit.inverse.cross_validation import CrossValidation
    from creepkit.inverse.single_values import SingleValue


def confirmation_text(confirmation: Confirmation) -> str:
    """The verdict, and chi-square of the simulation and of the fit, one line an output of a test."""
    lines = [f"{confirmation.law}: {confirmation.verdict}"]
    for test in confirmation.tests:
        for o in test.outputs:
            fit = "" if o.fit_errors is None else f", of the fit {o.fit_errors.chi_square:.3g}"
            difference = f"; apart {o.rms_difference:.2g} noise" if math.isfinite(o.rms_difference) else ""
            chi_square = f"chi-square {o.simulation_errors.chi_square:.3g}{fit}{difference}"
            lines.append(f"  {test.name}, {o.output}: {chi_square}")
    return "\n".join(lines)


def cross_validation_text(validation: CrossValidation) -> str:
    """One line for each held-out test: its relative squared errors, about the mean of the test.

    Of its rupture time and minimum rate the prediction over the measured one, with its 95 % interval.
    """
    lines = [f"law '{validation.fit.law.name}', held out by {validation.by}: relative squared errors"]
    for name, errors in validation.errors.items():
        cells = [f"{output} {e.relative_squared_error:.3g}" for output, e in errors.items()]
        cells += [f"{what} {_held_out_text(one)}" for what, one in validation.single_values[name].items()]
        lines.append(f"  {name}: {', '.join(cells)}")
    return "\n".join(lines)


def _held_out_text(one: SingleValue) -> str:
    """Predicted over measured, with the interval of a single test."""
    low, high = one.low / one.measured, one.high / one.measured
    unbroken = " of the time it lasted unbroken" if one.censored else ""
    return f"predicted over measured {one.ratio:.3g} [{low:.3g}, {high:.3g}]{unbroken}"


def confirmation_to_json(confirmation: Confirmation) -> dict[str, Any]:
    """The same as JSON-able data."""
    return {"holds": confirmation.confirmed, "verdict": confirmation.verdict, **finite(asdict(confirmation))}


CONFIRMATION_COLUMNS = ("test", "output", "chi-square", "of the fit", "rms", "apart, noise")


def confirmation_rows(confirmation: Confirmation) -> list[tuple[str, ...]]:
    """One row an output of a test."""
    return [
        (
            test.name,
            one.output,
            *(
                "" if value is None or math.isnan(value) else f"{value:.3g}"
                for value in (
                    one.simulation_errors.chi_square,
                    None if one.fit_errors is None else one.fit_errors.chi_square,
                    math.sqrt(one.simulation_errors.mean_squared_error),
                    one.rms_difference,
                )
            ),
        )
        for test in confirmation.tests
        for one in test.outputs
    ]
