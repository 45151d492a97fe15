"""The algebra of laws: every operation takes ordinary laws and gives an ordinary law."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import sympy

from creepkit.errors import LawError, nearest
from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import POINT_VARIABLES, Param, State, strain, temperature, time
from creepkit.language.temperature_factors import unused_name
from creepkit.language.temperature_forms import TemperatureForm

Law = TypeVar("Law", bound=LawRecord)


_INDEXED_NAME = re.compile(r"^(?P<stem>.+?)_(?P<index>[1-9]\d*)$")


_INDEXED_LABEL = re.compile(r"^(?P<stem>.+?) (?P<index>[1-9]\d*)$")


def add(first: Law, second: Law) -> Law:
    """Join two laws; names that collide are numbered in order of appearance: A_1, A_2; m_1, m_2."""
    laws = (first, second)
    symbols = _numbered([[s.name for s in (*law.params, *law.states)] for law in laws])
    labels = _numbered([list(law.terms) for law in laws], separator=" ", pattern=_INDEXED_LABEL)
    terms: dict[str, sympy.Expr] = {}
    params: dict[sympy.Symbol, Param] = {}
    states: dict[sympy.Symbol, State] = {}
    constraints: list[sympy.Basic] = []
    for law, names, titles in zip(laws, symbols, labels, strict=True):
        replacements = {s: sympy.Symbol(n, real=True) for s, n in zip((*law.params, *law.states), names, strict=True)}
        for (_, expression), title in zip(law.terms.items(), titles, strict=True):
            terms[title] = _renamed(expression, replacements)
        params |= {replacements[s]: p for s, p in law.params.items()}
        states |= {replacements[s]: replace(z, rate=_renamed(z.rate, replacements)) for s, z in law.states.items()}
        constraints += [_renamed(c, replacements) for c in law.constraints]
    return type(first)(
        name=f"{first.name}+{second.name}",
        title=" + ".join(law.title or law.name for law in laws),
        terms=terms,
        params=params,
        states=states,
        constraints=tuple(dict.fromkeys(constraints)),
        references=tuple(dict.fromkeys((*first.references, *second.references))),
    )


def without(law: Law, labels: Sequence[str]) -> Law:
    """Drop terms by name."""
    _check_labels(law, labels)
    return _restricted_to_terms(law, [label for label in law.terms if label not in labels])


def only(law: Law, labels: Sequence[str]) -> Law:
    """Keep terms by name."""
    _check_labels(law, labels)
    return _restricted_to_terms(law, [label for label in law.terms if label in labels])


def fix(law: Law, values: Mapping[str, float]) -> Law:
    """Replace parameters by numbers; a term that becomes zero is dropped."""
    if not values:
        return law
    replacements = {}
    for name, given in values.items():
        symbol, value = law.symbol(name), law.number(given, f"parameter '{name}'")
        param = law.params[symbol]
        if not param.within_bounds(value):
            low, high = param.bounds
            off = "" if param.off is None else f" or {param.off:g} (off)"
            raise LawError(f"law '{law.name}': cannot fix {name} = {value:g}; allowed are {low:g} to {high:g}{off}")
        number = sympy.Integer(int(value)) if value.is_integer() else sympy.Float(value)
        replacements[symbol] = number
    description = ", ".join(f"{name}={float(value):g}" for name, value in values.items())
    return _substituted(law, replacements, f"{law.name}({description})", f"{law.title} with {description}")


def with_bounds(law: Law, bounds: Mapping[str, tuple[float, float]]) -> Law:
    """Change bounds of parameters; LawError for an unknown parameter and for what bounds cannot be."""
    params = dict(law.params)
    for name, limits in bounds.items():
        symbol = law.symbol(name)
        params[symbol] = replace(params[symbol], bounds=limits, widens=False)
    return replace(law, params=params) if bounds else law


def with_temperature(law: Law, forms: Mapping[str, TemperatureForm]) -> Law:
    """Make parameters functions of temperature; the new parameters follow the one they belong to."""
    if not forms:
        return law
    replacements: dict[sympy.Symbol, sympy.Expr] = {}
    params = dict(law.params)
    sign_constraints: list[sympy.Basic] = []
    for name, form in forms.items():
        symbol = law.symbol(name)
        if not isinstance(form, TemperatureForm):
            raise LawError(f"law '{law.name}': {name} needs a form such as linear(T_ref=1073), found {form!r}")
        expression, extra = form.build(symbol, law.params[symbol])
        clash = sorted(s.name for s in extra if s in params)
        if clash:
            raise LawError(
                f"law '{law.name}': {', '.join(clash)} exists already; {name} depends on temperature twice: leave "
                "this form out, or keep the factor of times() from this rate by its terms= and states="
            )
        replacements[symbol] = expression
        sign_constraints += _sign_constraints(expression, law.params[symbol])
        ordered: dict[sympy.Symbol, Param] = {}
        for s, p in params.items():
            ordered[s] = p
            if s == symbol:
                ordered |= extra
        params = ordered
    description = ", ".join(f"{name}:{form.name}" for name, form in forms.items())
    substitutions = dict(replacements)
    return replace(
        law,
        name=f"{law.name}[{description}]",
        title=f"{law.title} with {', '.join(forms)} dependent on temperature",
        terms={label: term.xreplace(substitutions) for label, term in law.terms.items()},
        states={s: replace(z, rate=z.rate.xreplace(substitutions)) for s, z in law.states.items()},
        constraints=(*(c.xreplace(substitutions) for c in law.constraints), *sign_constraints),
        params=params,
        references=tuple(dict.fromkeys((*law.references, *(form.reference for form in forms.values())))),
        examples=(),
    )


def at(law: Law, T: float) -> Law:
    """Set the temperature to a number, K."""
    kelvin = law.number(T, "temperature")
    if not 0 < kelvin < 1e4:
        raise LawError(f"law '{law.name}': {T!r} is not a temperature in K (allowed: above 0, below 10000)")
    description = f"{kelvin:g}"
    return _substituted(
        law, {temperature: sympy.Float(kelvin)}, f"{law.name}@{description}K", f"{law.title} at {description} K"
    )


# ---- mechanisms ----------------------------------------------------------------------------------------------------


GAROFALO = "Garofalo (1965), Fundamentals of Creep and Creep-Rupture in Metals, Macmillan"


def with_primary(law: Law) -> Law:
    """Multiply the rates of all terms by 1 + b exp(-strain / e_p); see CreepLaw.with_primary."""
    if law.states or any(term.has(strain, time) for term in law.terms.values()):
        raise LawError(
            f"law '{law.name}' has primary or tertiary creep of its own: with_primary() takes a law of stress and "
            "temperature alone, such as law('hyperbolic-sine')"
        )
    b = sympy.Symbol(unused_name("b", set(law.names)), real=True)
    e_p = sympy.Symbol(unused_name("e_p", set(law.names)), real=True)
    params = {
        b: Param("initial over steady rate, less one", bounds=(0.1, 300.0), scale="log", unit="1"),
        e_p: Param("strain over which primary creep fades", bounds=(1e-5, 0.05), scale="log", unit="1"),
    }
    factor = 1 + b * sympy.exp(-strain / e_p)
    return replace(
        law,
        name=f"{law.name}*primary",
        title=f"{law.title or law.name} with primary creep",
        terms={label: term * factor for label, term in law.terms.items()},
        params={**law.params, **params},
        references=tuple(dict.fromkeys((*law.references, GAROFALO))),
        examples=(),
    )


def _substituted(law: Law, substitutions: Mapping[sympy.Symbol, sympy.Expr], name: str, title: str) -> Law:
    terms = {label: term.subs(substitutions) for label, term in law.terms.items()}
    terms = {label: term for label, term in terms.items() if term != 0}
    if not terms:
        raise LawError(f"law '{law.name}': no term is left after setting {', '.join(map(str, substitutions))}")
    states = {s: replace(z, rate=z.rate.subs(substitutions)) for s, z in law.states.items()}
    constraints = [c.subs(substitutions) for c in law.constraints]
    for relation, substituted in zip(law.constraints, constraints, strict=True):
        if substituted == sympy.false:
            raise LawError(f"law '{law.name}': its constraint {relation} cannot hold for '{name}'")
    return _pruned(law, terms, states, [c for c in constraints if c is not sympy.true], name, title)


def _restricted_to_terms(law: Law, labels: list[str]) -> Law:
    if not labels:
        raise LawError(f"law '{law.name}': no term would be left; its terms are {', '.join(law.terms)}")
    terms = {label: law.terms[label] for label in labels}
    description = " + ".join(labels)
    return _pruned(
        law, terms, dict(law.states), law.constraints, f"{law.name}[{description}]", f"{law.title}: {description} only"
    )


def _pruned(
    law: Law,
    terms: Mapping[str, sympy.Expr],
    states: Mapping[sympy.Symbol, State],
    constraints: Iterable[sympy.Basic],
    name: str,
    title: str,
) -> Law:
    """Drop the states that no remaining term needs, then unused parameters and constraints."""
    needed = set().union(*(t.free_symbols for t in terms.values()))
    while True:
        needed_states = {s: z for s, z in states.items() if s in needed}
        extended = needed.union(*(z.rate.free_symbols for z in needed_states.values()))
        if extended == needed:
            break
        needed = extended
    params = {s: p for s, p in law.params.items() if s in needed}
    declared = {*params, *needed_states, *POINT_VARIABLES}
    remaining_constraints = tuple(c for c in constraints if c.free_symbols <= declared)
    return replace(
        law,
        name=name,
        title=title,
        terms=terms,
        states=needed_states,
        params=params,
        constraints=remaining_constraints,
        examples=(),
    )


def _sign_constraints(expression: sympy.Expr, param: Param) -> list[sympy.Basic]:
    """A linear parameter whose bounds have one sign must keep it at every temperature."""
    low, high = param.bounds
    if param.scale == "log" or low < 0 < high:
        return []
    return [expression >= 0] if low >= 0 else [expression <= 0]


def _numbered(
    groups: list[list[str]], separator: str = "_", pattern: re.Pattern[str] = _INDEXED_NAME
) -> list[list[str]]:
    """Number the names that collide across groups; names that stand alone stay as they are."""

    def stem(name: str) -> str:
        match = pattern.match(name)
        return match["stem"] if match else name

    all_names = [name for group in groups for name in group]
    colliding = {stem(a) for a in groups[0] for b in groups[1] if stem(a) == stem(b)}
    count: dict[str, int] = {}
    taken = {name for name in all_names if stem(name) not in colliding}
    result = []
    for group in groups:
        names = []
        for name in group:
            key = stem(name)
            if key in colliding:
                count[key] = count.get(key, 0) + 1
                while f"{key}{separator}{count[key]}" in taken:
                    count[key] += 1
                name = f"{key}{separator}{count[key]}"
            names.append(name)
        result.append(names)
    return result


def _renamed(expression: sympy.Basic, replacements: Mapping[sympy.Symbol, sympy.Symbol]) -> sympy.Basic:
    return expression.xreplace({old: to for old, to in replacements.items() if old != to})


def _check_labels(law: LawRecord, labels: Sequence[str]) -> None:
    for label in labels:
        if label not in law.terms:
            raise LawError(f"law '{law.name}' has no term '{label}': {nearest(label, law.terms)}")
