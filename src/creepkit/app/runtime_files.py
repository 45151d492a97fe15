"""The runtime of a page: the core in WebAssembly, and scripts in the order in which a page or a program loads them."""

from __future__ import annotations

import base64
import gzip
import json
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.fem import simulation
from creepkit.integration import core_structures
from creepkit.integration.core_structures import IntegrationSettings, SettingsStructure
from creepkit.integration.time_discretisation import SDIRK4, SMALLEST_EXPONENT
from creepkit.records import ROOM_TEMPERATURE, Status
from creepkit.specimens.bulge.reduced_order_model import SEARCH_GROWTH, SEARCH_MODES, SEARCH_TOLERANCE
from creepkit.specimens.finite_element_tests import EQUILIBRIUM_SHARE

RUNTIME_FILES = ("core.js", "programs.js", "bars.js", "dimple.js")
"""Each needs those before it."""


CORE_NAME = "creepkit_core.wasm"
"""The core in WebAssembly, which src/core/compile.py makes."""


def runtime_files() -> dict[str, str]:
    """{file name: text}, in order."""
    folder = resources.files("creepkit.app").joinpath("runtime")
    return {name: folder.joinpath(name).read_text(encoding="utf-8") for name in RUNTIME_FILES}


@cache
def runtime_script() -> str:
    """The whole runtime as the text of one classic script, which holds no end of a script element."""
    packed = {"type": "gzip", "data": base64.b64encode(gzip.compress(core_code(), 9, mtime=0)).decode("ascii")}
    started = f"creepkit.load({json.dumps(packed)}, {json.dumps(_constants())});"
    return "\n".join([*runtime_files().values(), started])


def core_code() -> bytes:
    """The core in WebAssembly; CreepkitError where the build had no compiler of it."""
    file = resources.files("creepkit.app").joinpath(CORE_NAME)
    if not file.is_file():
        raise CreepkitError(
            f"a page needs the core in WebAssembly, {CORE_NAME}, which is missing; run 'pip install ziglang' and 'make "
            "core' in a clone of the sources, or install creepkit from a wheel"
        )
    return file.read_bytes()


def _constants() -> dict[str, Any]:
    """Numbers and words that the core's callers bring along: the method of integration, settings, endings."""
    settings = IntegrationSettings()
    tolerance = {"tolerance": SEARCH_TOLERANCE, "newton": EQUILIBRIUM_SHARE * SEARCH_TOLERANCE, "growth": SEARCH_GROWTH}
    numbers = np.concatenate([SDIRK4.a, SDIRK4.c, SDIRK4.error, SDIRK4.dense], axis=None).tolist()
    return {
        "room_temperature": ROOM_TEMPERATURE,
        "bar": {
            "settings": {name: getattr(settings, name) for name, *_ in SettingsStructure._fields_},
            "tableau": {"sizes": [*SDIRK4.dense.shape, SDIRK4.error_order], "numbers": numbers},
            "endings": _endings(core_structures.REASONS, core_structures.STATUS),
        },
        "body": {
            "search": {"modes": SEARCH_MODES, "settings": tolerance},
            "smallest_exponent": SMALLEST_EXPONENT,
            "endings": _endings(simulation.REASONS, simulation.STATUS),
        },
    }


def _endings(reasons: dict[int, str], status: Any) -> list[tuple[str, str]]:
    """Reason and status in words of each code, from 0 on."""
    return [(reasons[code], Status(int(status[code])).name.lower().replace("_", " ")) for code in sorted(reasons)]
