"""The algebra of laws: every operation takes ordinary laws and gives an ordinary law.

A factor of temperature multiplies the rates of terms and of internal variables. A part of a state equation that is
proportional to the rate coefficient of a term is a multiple of the creep rate and takes that term's factor. Every other
part has a rate of its own, and a factor of its own: the activation energy of the rate coefficient B is Q_B, as of B's
form activated(). A part that nothing multiplies takes the state's name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TypeVar

import sympy

from creepkit.errors import LawError, refuse_unknown
from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import POINT_VARIABLES, Param, State, Symbol, strain, stress, temperature, time
from creepkit.language.temperature_forms import TemperatureFactor, TemperatureForm

Law = TypeVar("Law", bound=LawRecord)


_PER_SECOND = re.compile(r"(1/s|/s|\bs\)|s\^-1|s\*\*-1)$")
"""Ends of units per second: "1/s", "MPa/s", "1/(MPa s)"."""


def times(
    law: Law,
    factor: TemperatureFactor,
    terms: Iterable[str] | None = None,
    states: Iterable[str] | None = None,
    *,
    shared: bool = False,
) -> Law:
    """Multiply the rates of terms and of internal variables by a factor of temperature; see CreepLaw.times."""
    if not isinstance(factor, TemperatureFactor):
        raise LawError(f"law '{law.name}': times() takes a factor such as arrhenius(T_ref=1073), found {factor!r}")
    chosen_terms = _chosen(law, "term", terms, tuple(law.terms))
    chosen_states = _chosen(law, "state", states, tuple(s.name for s in law.states))
    parameters = _FactorParameters(law, factor)
    expression = parameters.expression_of(None)
    inherited: dict[sympy.Symbol, sympy.Expr] = {}
    for label, term in law.terms.items():
        for coefficient in rate_coefficients(law, term):
            if label in chosen_terms:
                inherited[coefficient] = expression
            else:
                inherited.setdefault(coefficient, sympy.S.One)
    new_states = {}
    for symbol, state in law.states.items():
        parts = _StateParts(law, symbol, state, inherited)
        if symbol.name in chosen_states:
            if states is not None and not parts.own:
                raise LawError(
                    f"law '{law.name}': state '{symbol}' is a multiple of the creep rate and takes the factor of its "
                    "term; leave it out of states="
                )
            parts.multiply_own(expression if shared else None, parameters, named=states is not None)
        new_states[symbol] = replace(state, rate=sympy.Add(*parts.inheriting, *parts.own))
    new_terms = {label: term * expression if label in chosen_terms else term for label, term in law.terms.items()}
    used = {s for rate in (*new_terms.values(), *(z.rate for z in new_states.values())) for s in rate.free_symbols}
    if not (chosen_terms or chosen_states):
        raise LawError(f"law '{law.name}': times() was told to multiply no term and no state")
    restricted = [*chosen_terms, *chosen_states] if terms is not None or states is not None else []
    description = f"({', '.join([*restricted, *(['shared'] if shared else [])])})" if restricted or shared else ""
    return replace(
        law,
        name=f"{law.name}*{factor.name}{description}",
        title=f"{law.title} with {factor.name.replace('arrhenius', 'Arrhenius')} temperature dependence",
        terms=new_terms,
        states=new_states,
        params={s: p for s, p in parameters.table().items() if s in used},
        references=tuple(dict.fromkeys((*law.references, factor.reference))),
        examples=(),
    )


def rate_coefficients(law: LawRecord, rate: sympy.Expr) -> tuple[sympy.Symbol, ...]:
    """The parameters to which a rate is proportional: those per second, if any are, else all."""
    found = [s for s, p in law.params.items() if _is_proportional(rate, s, positive=p.scale == "log")]
    return tuple(s for s in found if _PER_SECOND.search(law.params[s].unit)) or tuple(found)


# ---- mechanisms ----------------------------------------------------------------------------------------------------


@dataclass
class _FactorParameters:
    """The factor's parameters, under a name of their own for each rate coefficient that they belong to."""

    law: LawRecord
    factor: TemperatureFactor
    expressions: dict[sympy.Symbol | None, sympy.Expr] = field(default_factory=dict)
    params: dict[sympy.Symbol | None, dict[sympy.Symbol, Param]] = field(default_factory=dict)

    def expression_of(self, owner: sympy.Symbol | None) -> sympy.Expr:
        """The factor of one rate coefficient (or state); None stands for the creep rate."""
        if owner not in self.expressions:
            suffix = "" if owner is None else f"_{owner.name}"
            taken = {*self.law.names, *(s.name for s in self.law.states)}
            taken |= {s.name for table in self.params.values() for s in table}
            names = {s: Symbol(unused_name(s.name + suffix, taken)) for s in self.factor.params}
            owners: dict[sympy.Symbol, Param | State] = {**self.law.params, **self.law.states}
            meaning = "" if owner is None else f" of {owners[owner].meaning}"
            self.params[owner] = {
                names[s]: replace(p, meaning=p.meaning + meaning) for s, p in self.factor.params.items()
            }
            self.expressions[owner] = self.factor.expression.xreplace(names)
        return self.expressions[owner]

    def table(self) -> dict[sympy.Symbol, Param]:
        """The law's parameters, each followed by those of its own factor, then those of the creep rate and states."""
        ordered: dict[sympy.Symbol, Param] = {}
        for symbol, param in self.law.params.items():
            ordered |= {symbol: param, **self.params.get(symbol, {})}
        return ordered | {s: p for table in self.params.values() for s, p in table.items() if s not in ordered}


class _StateParts:
    """The summands of a state equation: multiples of the creep rate, times their term's factor, and its own."""

    def __init__(
        self, law: LawRecord, symbol: sympy.Symbol, state: State, inherited: Mapping[sympy.Symbol, sympy.Expr]
    ) -> None:
        self.law, self.symbol = law, symbol
        self.inheriting: list[sympy.Expr] = []
        self.own: list[sympy.Expr] = []
        for summand in _summands(law, state.rate):
            coefficients = [c for c in rate_coefficients(law, summand) if c in inherited]
            if coefficients:
                self.inheriting.append(summand * inherited[coefficients[0]])
            elif summand != 0:
                self.own.append(summand)

    def multiply_own(self, shared: sympy.Expr | None, parameters: _FactorParameters, *, named: bool) -> None:
        """Multiply what has a rate of its own; what is activated already stays, unless the state was `named`."""
        for k, summand in enumerate(self.own):
            if not named and _is_activated(summand, set(self.law.states)):
                continue
            owner = next(iter(rate_coefficients(self.law, summand)), self.symbol)
            self.own[k] = summand * (shared if shared is not None else parameters.expression_of(owner))


def _summands(law: LawRecord, rate: sympy.Expr) -> list[sympy.Expr]:
    """The summands of a rate; a product of sums that has no coefficient as a whole is multiplied out."""
    parts: list[sympy.Expr] = []
    for summand in sympy.Add.make_args(rate):
        expanded = sympy.Add.make_args(sympy.expand_mul(summand)) if not rate_coefficients(law, summand) else ()
        separable = any(rate_coefficients(law, part) for part in expanded)
        parts += expanded if separable else [summand]
    return parts


def _is_proportional(rate: sympy.Expr, symbol: sympy.Symbol, *, positive: bool) -> bool:
    """Whether a rate is a multiple of a symbol, read off its structure; of the larger of two only where it is > 0."""
    if rate == symbol:
        return True
    if symbol not in rate.free_symbols:
        return False
    if isinstance(rate, sympy.Mul):
        holders = [part for part in rate.args if symbol in part.free_symbols]
        return len(holders) == 1 and _is_proportional(holders[0], symbol, positive=positive)
    if isinstance(rate, sympy.Piecewise):
        branches, conditions = zip(*rate.args, strict=True)
        free = not any(symbol in condition.free_symbols for condition in conditions)
        return free and _all_proportional(branches, symbol, positive)
    if isinstance(rate, sympy.Add) or (positive and isinstance(rate, sympy.Max | sympy.Min)):
        return _all_proportional(rate.args, symbol, positive)
    return False


def _all_proportional(parts: Iterable[sympy.Expr], symbol: sympy.Symbol, positive: bool) -> bool:
    return all(part == 0 or _is_proportional(part, symbol, positive=positive) for part in parts)


def _is_activated(rate: sympy.Expr, states: set[sympy.Symbol]) -> bool:
    """Whether a rate has a factor exp(...) of temperature alone, such as the form activated() gives."""
    others = {*POINT_VARIABLES, *states} - {temperature}
    exponents = [part.args[0] for part in sympy.Mul.make_args(rate) if isinstance(part, sympy.exp)]
    return any(
        part.has(temperature) and not part.free_symbols & others
        for exponent in exponents
        for part in sympy.Add.make_args(sympy.expand(exponent))
    )


def _chosen(law: LawRecord, kind: str, names: Iterable[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    if names is None:
        return known
    chosen = (names,) if isinstance(names, str) else tuple(names)
    for name in chosen:
        refuse_unknown(name, known, LawError, f"law '{law.name}' has no {kind} '{name}'")
    return chosen


def unused_name(name: str, taken: set[str]) -> str:
    """The name itself, or with the first number from 2 on that is free: Q, Q_2."""
    if name not in taken:
        return name
    k = 2
    while f"{name}_{k}" in taken:
        k += 1
    return f"{name}_{k}"


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
        replacements = {s: Symbol(n) for s, n in zip((*law.params, *law.states), names, strict=True)}
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
        replacements[symbol] = sympy.Integer(int(value)) if value.is_integer() else sympy.Float(value)
    description = ", ".join(f"{name}={float(value):g}" for name, value in values.items())
    return _substituted(law, replacements, f"{law.name}({description})", f"{law.title} with {description}")


def fixed_values(law: LawRecord) -> dict[str, float]:
    """{parameter: value} of what fix() has put into a law, as it wrote into the name."""
    return {name: float(value) for name, value in re.findall(r"[(,] ?(\w+)=([-+.\de]+)(?=[,)])", law.name)}


def with_bounds(law: Law, bounds: Mapping[str, tuple[float, float]]) -> Law:
    """Change bounds of parameters; LawError for an unknown parameter and for what bounds cannot be."""
    stated = {law.symbol(name): limits for name, limits in bounds.items()}
    changed = {symbol: replace(law.params[symbol], bounds=limits, widens=False) for symbol, limits in stated.items()}
    return replace(law, params={**law.params, **changed}) if bounds else law


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
    return replace(
        law,
        name=f"{law.name}[{description}]",
        title=f"{law.title} with {', '.join(forms)} dependent on temperature",
        terms={label: term.xreplace(replacements) for label, term in law.terms.items()},
        states={s: replace(z, rate=z.rate.xreplace(replacements)) for s, z in law.states.items()},
        constraints=(*(c.xreplace(replacements) for c in law.constraints), *sign_constraints),
        params=params,
        references=tuple(dict.fromkeys((*law.references, *(form.reference for form in forms.values())))),
        examples=(),
    )


def at(law: Law, T: float | None, conditions: Mapping[str, float]) -> Law:
    """Set the temperature, K, and conditions, in the units of the law, to numbers."""
    numbers: dict[sympy.Symbol, sympy.Expr] = {}
    if T is not None:
        kelvin = law.number(T, "temperature")
        if not 0 < kelvin < 1e4:
            raise LawError(f"law '{law.name}': {T!r} is not a temperature in K (allowed: above 0, below 10000)")
        numbers[temperature] = sympy.Float(kelvin)
    known = {symbol.name: symbol for symbol in law.conditions}
    for name, value in conditions.items():
        refuse_unknown(name, known, LawError, f"law '{law.name}' has no condition '{name}'")
        numbers[known[name]] = sympy.Float(law.number(value, f"condition '{name}'"))
    texts = [f"{float(v):g} K" if s == temperature else f"{s} = {float(v):g} {s.unit}" for s, v in numbers.items()]
    name = f"{law.name}@{','.join(text.replace(' ', '') for text in texts)}"
    return _substituted(law, numbers, name, f"{law.title} at {', '.join(texts)}") if numbers else law


CONDITION_BOUNDS = (-1e30, 1e30)
"""Formal bounds of a condition as a parameter: tests state its value."""


@lru_cache(maxsize=128)
def with_conditions_as_parameters(law: Law) -> Law:
    """The law with its conditions as further parameters, behind its own: what kernels and simulations see of it."""
    if not law.conditions:
        return law
    plain = {symbol: Symbol(symbol.name) for symbol in law.conditions}
    stated = {plain[s]: Param(f"condition {s.name}", CONDITION_BOUNDS, s.unit) for s in law.conditions}
    return replace(
        law,
        terms={label: term.xreplace(plain) for label, term in law.terms.items()},
        states={s: replace(z, rate=z.rate.xreplace(plain)) for s, z in law.states.items()},
        constraints=tuple(c.xreplace(plain) for c in law.constraints),
        params={**law.params, **stated},
        examples=(),
    )


# ---- mechanisms ----------------------------------------------------------------------------------------------------


GAROFALO = "Garofalo (1965), Fundamentals of Creep and Creep-Rupture in Metals, Macmillan"


def with_primary(law: Law) -> Law:
    """Multiply the rates of all terms by 1 + b exp(-strain / e_p); see CreepLaw.with_primary."""
    for symbol, param in law.params.items():
        if law.states and param.off is not None and any(one.has(time**symbol) for one in law.terms.values()):
            law = _substituted(law, {symbol: sympy.Float(param.off)}, law.name, law.title)  # hardens by strain then
    if any(term.has(strain, time) for term in law.terms.values()):
        raise LawError(
            f"law '{law.name}' has primary or tertiary creep of its own: with_primary() takes a law of stress, "
            "temperature and damage alone, such as law('hyperbolic-sine')"
        )
    params = {
        Symbol("b"): Param("initial over steady rate, less one", bounds=(0.1, 300.0), scale="log", unit="1"),
        Symbol("e_p"): Param("strain over which primary creep fades", bounds=(1e-5, 0.05), scale="log", unit="1"),
    }
    b, e_p = params
    return multiplied(law, "primary creep", 1 + b * sympy.exp(-strain / e_p), params, GAROFALO, name="primary")


def multiplied(
    law: Law,
    title: str,
    factor: sympy.Expr,
    params: Mapping[sympy.Symbol, Param],
    reference: str,
    *,
    name: str | None = None,
    states: Mapping[sympy.Symbol, State] | None = None,
) -> Law:
    """Multiply the rates of all terms by a factor, of further states if it has some.

    Where a name of its parameters is taken, that one is numbered.
    """
    taken = set(law.names)
    names = {symbol: Symbol(unused_name(symbol.name, taken)) for symbol in params}
    return replace(
        law,
        name=f"{law.name}*{name or title.replace(' ', '-')}",
        title=f"{law.title or law.name} {'and' if ' with ' in law.title else 'with'} {title}",
        terms={label: term * factor.xreplace(names) for label, term in law.terms.items()},
        states={**law.states, **{z: replace(one, rate=one.rate.xreplace(names)) for z, one in (states or {}).items()}},
        params={**law.params, **{names[symbol]: param for symbol, param in params.items()}},
        references=tuple(dict.fromkeys((*law.references, reference))),
        examples=(),
    )


def _substituted(law: Law, substitutions: Mapping[sympy.Symbol, sympy.Expr], name: str, title: str) -> Law:
    never_negative = {sympy.Max(0, stress): stress}  # as where the largest principal stress has no share in a mean
    terms = {label: term.subs(substitutions).xreplace(never_negative) for label, term in law.terms.items()}
    terms = {label: term for label, term in terms.items() if term != 0}
    if not terms:
        raise LawError(f"law '{law.name}': no term is left after setting {', '.join(map(str, substitutions))}")
    states = {s: replace(z, rate=z.rate.subs(substitutions).xreplace(never_negative)) for s, z in law.states.items()}
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
    declared = {*params, *needed_states, *law.conditions, *POINT_VARIABLES}
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
        refuse_unknown(label, law.terms, LawError, f"law '{law.name}' has no term '{label}'")
