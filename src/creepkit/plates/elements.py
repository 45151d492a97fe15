"""Masses of the elements, for weight per cent into atomic per cent."""

from __future__ import annotations

ATOMIC_WEIGHTS = {
    "H": 1.008, "B": 10.81, "C": 12.011, "N": 14.007, "O": 15.999, "Mg": 24.305, "Al": 26.982, "Si": 28.085,
    "P": 30.974, "S": 32.06, "Ca": 40.078, "Ti": 47.867, "V": 50.942, "Cr": 51.996, "Mn": 54.938, "Fe": 55.845,
    "Co": 58.933, "Ni": 58.693, "Cu": 63.546, "Zn": 65.38, "Y": 88.906, "Zr": 91.224, "Nb": 92.906, "Mo": 95.95,
    "Ru": 101.07, "Rh": 102.906, "Pd": 106.42, "Ag": 107.868, "Sn": 118.71, "La": 138.905, "Ce": 140.116,
    "Hf": 178.486, "Ta": 180.948, "W": 183.84, "Re": 186.207, "Ir": 192.217, "Pt": 195.084, "Au": 196.967,
    "Pb": 207.2, "Bi": 208.98,
}  # fmt: skip
"""{symbol: standard atomic weight}, abridged: IUPAC, Prohaska et al. (2022), Pure Appl. Chem. 94, 573."""
