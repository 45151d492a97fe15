"""Text and data of a check of data quality."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from creepkit.reports.json_values import fields_to_json

if TYPE_CHECKING:
    from creepkit.quality.flags import DataQuality


def data_quality_text(quality: DataQuality) -> str:
    """One line for each flag; one line that says so when there are none."""
    tests = f"{quality.tests} test{'' if quality.tests == 1 else 's'}"
    if not quality.flags:
        return f"nothing suspect in {tests}"
    count = len(quality.flags)
    head = f"{count} flag{'' if count == 1 else 's'} in {tests}; nothing was dropped"
    return "\n".join([head, *(f"  {flag}" for flag in quality.flags)])


def data_quality_to_json(quality: DataQuality) -> dict[str, Any]:
    """The flags with all their numbers, for JSON: times in s, steps of temperature in K, jumps in the output's unit."""
    names = "tests kind frames reason time earliest latest rate_factors factor_errors temperature_steps jumps proposal"
    return {"tests": quality.tests, "flags": [fields_to_json(flag, names) for flag in quality.flags]}
