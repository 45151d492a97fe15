"""The conformance kits: whether a law, specimen, predictor, reader or exporter is fit for all uses.

`creepkit check FILE|NAME` runs them. Points of a law are Sobol samples of the full bounds and of stress 1e-3 to 2000
MPa, strain 1e-12 to 1, time 1e-3 to 1e6 s, temperature 600 to 1600 K, wherever the law's constraints hold. So that
rates at zero strain and zero time are finite, stress, strain and states are floored at 1e-30 and time at 1e-120 s where
they are bases of powers; composite bases, such as Max(stress - threshold, 0), at 1e-200. A specimen is tried in tests
planned from its own record: its loads, ranges of conditions and lengths.
"""

from creepkit.testing.kits import (
    check_camera_format,
    check_exporter,
    check_instrument_format,
    check_law,
    check_material,
    check_named,
    check_plugin,
    check_predictor,
    check_reader,
    check_specimen,
    check_temperature_form,
)
from creepkit.testing.parity import DERIVATIVE_TOLERANCE, VALUE_TOLERANCE
from creepkit.testing.reports import ConformanceCheck, ConformanceReport
from creepkit.testing.sample_points import LawSamples, draw_samples

__all__ = [
    "DERIVATIVE_TOLERANCE",
    "VALUE_TOLERANCE",
    "ConformanceCheck",
    "ConformanceReport",
    "LawSamples",
    "check_camera_format",
    "check_exporter",
    "check_instrument_format",
    "check_law",
    "check_material",
    "check_named",
    "check_plugin",
    "check_predictor",
    "check_reader",
    "check_specimen",
    "check_temperature_form",
    "draw_samples",
]
