"""The structures of `src/core/fibre_integration.cpp`, field by field; arrays go as addresses."""

from __future__ import annotations

import ctypes

from creepkit.integration.core_structures import SettingsStructure, TableauStructure

_NUMBER, _COUNT, _POINTER = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p


class FibreModelStructure(ctypes.Structure):
    """FibreModel of `fibre_stage.hpp`, where every field's shape is given."""

    _fields_ = [
        *((name, _COUNT) for name in ("fibres", "modes", "loads", "rows", "inputs")),
        *((name, _POINTER) for name in ("stress", "strain", "mode_strains", "projection", "observed")),
        *((name, _POINTER) for name in ("stress_change", "strain_change", "mode_change", "projection_change")),
        ("offsets", _POINTER),
    ]


class FibreCallStructure(ctypes.Structure):
    """FibreCall, where every field's shape is given."""

    _fields_ = [
        *((name, _POINTER) for name in ("update", "sensitivity")),
        *((name, _COUNT) for name in ("states", "parameters", "with_sensitivities", "follows_stress")),
        *((name, _COUNT) for name in ("segment_count", "time_count")),
        *((name, _POINTER) for name in ("theta", "initial", "limits", "segments", "times")),
        ("beta", _NUMBER),
        ("model", FibreModelStructure),
        ("settings", SettingsStructure),
        ("tableau", TableauStructure),
        *((name, _POINTER) for name in ("recorded", "jacobian")),
        *((name, _COUNT) for name in ("ending", "steps", "rejected")),
        ("end_time", _NUMBER),
    ]


class FibreStepStructure(ctypes.Structure):
    """FibreStep, where every field's shape is given."""

    _fields_ = [
        ("update", _POINTER),
        *((name, _COUNT) for name in ("fibres", "states")),
        *((name, _POINTER) for name in ("theta", "strain", "creep", "path", "state")),
        *((name, _NUMBER) for name in ("time", "length", "temperature", "modulus")),
        *((name, _POINTER) for name in ("stress", "tangent", "new_creep", "new_path", "new_state")),
    ]
