"""Text of confirmations and cross-validations of identifications."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.inverse.confirmation import Confirmation, ConfirmedOutput
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
    values: dict[str, Any] = _json_value(asdict(confirmation))
    return {"holds": confirmation.confirmed, "verdict": confirmation.verdict, **values}


CONFIRMATION_COLUMNS = ("test", "output", "chi-square", "of the fit", "rms", "apart, noise")


def confirmation_rows(confirmation: Confirmation) -> list[tuple[str, ...]]:
    """One row an output of a test."""
    return [_confirmation_row(test.name, comparison) for test in confirmation.tests for comparison in test.outputs]


def _confirmation_row(test: str, comparison: ConfirmedOutput) -> tuple[str, ...]:
    fit_chi_square = "" if comparison.fit_errors is None else _number_text(comparison.fit_errors.chi_square)
    rms = _number_text(math.sqrt(comparison.simulation_errors.mean_squared_error))
    return (
        test,
        comparison.output,
        _number_text(comparison.simulation_errors.chi_square),
        fit_chi_square,
        rms,
        _number_text(comparison.rms_difference),
    )


def _number_text(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.3g}"


def _json_value(value: Any) -> Any:
    """The same with null for what JSON cannot hold."""
    if isinstance(value, dict):
        return {name: _json_value(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_value(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
