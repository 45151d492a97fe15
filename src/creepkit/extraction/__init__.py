"""From camera frames to histories: domes, rigid motion, one centre, outputs with their noise, flags.

`extract_surfaces` does it for any specimen that says how cameras see it (records.Specimen);
docs/concepts/extraction.md describes the method.
"""

from creepkit.extraction.extract import ExtractionRequest, extract_surfaces
from creepkit.extraction.extraction import Extraction, FieldMap, PlateMotion
from creepkit.extraction.noise import NoiseEstimate

__all__ = ["Extraction", "ExtractionRequest", "FieldMap", "NoiseEstimate", "PlateMotion", "extract_surfaces"]
