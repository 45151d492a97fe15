"""The hooks: everything a plugin can add, one typed function and one sentence each.

A new kind of plugin is a function here and a row in registry/kinds.py; a kit `check_...` in testing/kits.py checks more
of it than its name and title.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pluggy

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw
    from creepkit.records import CameraFormat, Exporter, InstrumentFormat, Material, Reader, Specimen


PROJECT = "creepkit"


hookspec = pluggy.HookspecMarker(PROJECT)


hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def creepkit_laws() -> Sequence[CreepLaw]:  # type: ignore[empty-body]
    """Return creep laws; each name must be new."""


@hookspec
def creepkit_specimens() -> Sequence[Specimen]:  # type: ignore[empty-body]
    """Return specimens: what is loaded, and which outputs are observed."""


@hookspec
def creepkit_readers() -> Sequence[Reader]:  # type: ignore[empty-body]
    """Return readers that turn measured files into histories."""


@hookspec
def creepkit_cameras() -> Sequence[CameraFormat]:  # type: ignore[empty-body]
    """Return camera formats: how a system writes the frames that it measured."""


@hookspec
def creepkit_instruments() -> Sequence[InstrumentFormat]:  # type: ignore[empty-body]
    """Return instrument formats: how columns of records are called, and what their heads leave out."""


@hookspec
def creepkit_exporters() -> Sequence[Exporter]:  # type: ignore[empty-body]
    """Return exporters that write a law and its values as text."""


@hookspec
def creepkit_materials() -> Sequence[Material]:  # type: ignore[empty-body]
    """Return published creep laws of materials: values, the range that they hold in, and where they are printed."""


@hookspec
def creepkit_temperature_forms() -> Mapping[str, Any]:  # type: ignore[empty-body]
    """Return {name: function of T_ref} giving temperature forms or factors."""
