"""The templates of pages and the style, as they lie beside this module."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from creepkit.reports.blocks import printable_lines

if TYPE_CHECKING:
    from jinja2 import Template


@cache
def template(name: str) -> Template:
    """A template by the name of its file."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    loader = FunctionLoader(resource)
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=False, loader=loader)
    environment.filters["lines"] = printable_lines
    return environment.get_template(name)


@cache
def resource(name: str) -> str:
    """The text of a file beside this module."""
    return files(__package__).joinpath(name).read_text("utf-8")
