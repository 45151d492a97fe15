"""A law as a file of Python that creepkit reads: the same twenty lines that one would write by hand."""

from __future__ import annotations

from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import sympy
from sympy.printing.str import StrPrinter

from creepkit.errors import LawError
from creepkit.files.writing import write_text
from creepkit.language import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues


def write_law_file(source: LawWithValues, path: str | Path) -> Path:
    """Write a law, named as the file, with its values; `creepkit --plugin FILE` and ck.load_plugin() read it.

    LawError for a law that depends on conditions of tests, and for a file that another program wrote.
    """
    path = Path(path)
    law = source.law.rename(path.stem.lower().replace("_", "-"))
    if law.conditions:
        raise LawError(f"law '{law.name}' depends on {law.conditions[0]}: write its file by hand")
    return write_text(_text(law, dict(source.values)), path, LawError)


def _text(law: CreepLaw, values: dict[str, float]) -> str:
    used = [one.name for one in POINT_VARIABLES if law.uses(one)]
    words = ["CreepLaw", "Param", *(["State", "states"] if law.states else []), "hookimpl", "parameters", *used]
    rates = [*law.terms.values(), *(state.rate for state in law.states.values())]
    functions = {type(one).__name__ for rate in rates for one in rate.atoms(sympy.Function, sympy.Max, sympy.Min)}
    functions |= {"Rational" for rate in rates if rate.atoms(sympy.Rational) - rate.atoms(sympy.Integer)}
    names = ", ".join(law.names) + "," * (len(law.names) == 1)
    parts = {
        "terms": [f"{label!r}: {_source(term)}" for label, term in law.terms.items()],
        "params": [f"{symbol}: {_source(param)}" for symbol, param in law.params.items()],
        "states": [f"{symbol}: {_source(state)}" for symbol, state in law.states.items()],
    }
    tables = [
        "".join([f"    {name}={{\n", *(f"        {row},\n" for row in rows), "    },\n"])
        for name, rows in parts.items()
        if rows
    ]
    imported = f"from sympy import {', '.join(sorted(functions))}\n\n" if functions else ""
    return (
        f'"""{law.title}."""\n\n{imported}from creepkit.language import {", ".join(sorted(words))}\n\n'
        f"{names} = parameters({' '.join(law.names)!r})\n"
        + "".join(f"({symbol},) = states({symbol.name!r})\n" for symbol in law.states)
        + f"\nLAW = CreepLaw(\n    name={law.name!r},\n    title={law.title!r},\n{''.join(tables)}"
        f"    references={law.references!r},\n)\n\nTYPICAL = {values!r}\n\n\n"
        "@hookimpl\ndef creepkit_laws():\n    return [LAW]\n"
    )


class _Printer(StrPrinter):  # type: ignore[misc]
    """Expressions as Python, with all digits."""

    def _print_Float(self, number: sympy.Float) -> str:
        return repr(float(number))

    def _print_Rational(self, number: sympy.Rational) -> str:
        return f"Rational({number.p}, {number.q})" if number.q != 1 else str(number.p)


def _source(value: Any) -> str:
    """An expression, or a record of parameters or internal variables less its defaults, as Python."""
    if isinstance(value, sympy.Expr):
        return str(_Printer().doprint(value))
    given = {one.name: getattr(value, one.name) for one in fields(value)}
    stated = {f.name for f in fields(value) if f.default is MISSING or given[f.name] != f.default}
    arguments = ", ".join(
        f"{name}={_source(one) if isinstance(one, sympy.Expr) else repr(one)}"
        for name, one in given.items()
        if name in stated
    )
    return f"{type(value).__name__}({arguments})"
