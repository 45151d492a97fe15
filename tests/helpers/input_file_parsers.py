"""Small readers of the cards' grammars, and the formulas of the codes' manuals evaluated from what was read alone.

Each reader takes the text and returns rate(stress, strain, time, T), in the text's units and K.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable

import numpy as np

Rate = Callable[[float, float, float, float], float]


def lines_without(text: str, mark: str) -> list[str]:
    """The lines that are no comments; comments stand at the top, and every line is ASCII text of decent length."""
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if not line.startswith(mark))
    assert first > 0
    assert all(len(line) <= 120 for line in lines[:first])
    assert not any(line.startswith(mark) for line in lines[first:])
    return lines[first:]


# ---- Abaqus --------------------------------------------------------------------------------------------------------


def abaqus_cards(text: str) -> dict[str, tuple[dict[str, str], list[list[float]]]]:
    """{keyword: (parameters, data lines)}; numbers of at most 20 characters, as the manual of input syntax says."""
    found: dict[str, tuple[dict[str, str], list[list[float]]]] = {}
    rows: list[list[float]] = []
    for line in lines_without(text, "**"):
        assert len(line) <= 256
        if line.startswith("*"):
            keyword, *parameters = (part.strip() for part in line[1:].split(","))
            assert keyword not in found
            rows = []
            found[keyword] = (dict(part.split("=") for part in parameters), rows)
        else:
            fields = [field.strip() for field in line.split(",")]
            assert len(fields) <= 8
            assert all(len(field) <= 20 for field in fields)
            rows.append([float(field) for field in fields])
    assert [*found] in (["MATERIAL", "CREEP"], ["MATERIAL", "ELASTIC", "CREEP"])
    assert re.fullmatch(r"[A-Za-z]\w{0,79}", found["MATERIAL"][0]["NAME"])
    return found


def abaqus(text: str) -> Rate:
    """*CREEP of the Keywords Guide; constants between temperatures are interpolated linearly."""
    parameters, rows = abaqus_cards(text)["CREEP"]
    formula = _ABAQUS[parameters["LAW"]]
    if len(rows) == 1:
        return lambda s, e, t, T: formula(s, e, t, T, *rows[0])
    table = np.array(rows)
    assert (np.diff(table[:, -1]) > 0).all()
    return lambda s, e, t, T: formula(s, e, t, T, *(np.interp(T, table[:, -1], c) for c in table[:, :-1].T))


_ABAQUS = {
    "STRAIN": lambda q, e, t, T, A, n, m: (A * q**n * ((m + 1) * e) ** m) ** (1 / (m + 1)),
    "TIME": lambda q, e, t, T, A, n, m: A * q**n * t**m,
    "NORTON": lambda q, e, t, T, A, n, m: A * q**n * t**m,
    "POWER LAW": lambda q, e, t, T, q0, n, m, e0: e0 * ((q / q0) ** n * ((m + 1) * e) ** m) ** (1 / (m + 1)),
    "TIME POWER LAW": lambda q, e, t, T, q0, n, m, e0: e0 * (q / q0) ** n * (e0 * t) ** m,
    "HYPERB": lambda q, e, t, T, A, B, n, dH=0.0, R=1.0: A * math.sinh(B * q) ** n * math.exp(-dH / (R * T)),
    "DOUBLE POWER": lambda q, e, t, T, A1, B1, C1, A2, B2, C2, q0: (
        A1 * math.exp(-B1 / T) * (q / q0) ** C1 + A2 * math.exp(-B2 / T) * (q / q0) ** C2
    ),
}


# ---- Ansys ---------------------------------------------------------------------------------------------------------


def ansys_commands(text: str) -> list[list[str]]:
    """Commands as lists of words."""
    commands = [line.split(",") for line in lines_without(text, "!")]
    assert {command[0] for command in commands} <= {"MP", "MPTEMP", "MPDATA", "TB", "TBDATA"}
    assert all(len(command) <= 10 for command in commands)
    return commands


def ansys(text: str) -> Rate:
    """TB,CREEP with an implicit law, of the Material Reference."""
    commands = ansys_commands(text)
    (table,) = [c for c in commands if c[0] == "TB"]
    assert table[:4] == ["TB", "CREEP", "1", "1"]
    count, option = int(table[4]), int(table[5])
    constants = [0.0] * count
    for _, start, *values in (c for c in commands if c[0] == "TBDATA"):
        assert len(values) <= 6
        constants[int(start) - 1 : int(start) - 1 + len(values)] = map(float, values)
    assert len(constants) == count
    formula = _ANSYS[option]
    return lambda s, e, t, T: formula(s, e, t, T, *constants)


_ANSYS = {
    1: lambda s, e, t, T, c1, c2, c3, c4: c1 * s**c2 * e**c3 * math.exp(-c4 / T),
    2: lambda s, e, t, T, c1, c2, c3, c4: c1 * s**c2 * t**c3 * math.exp(-c4 / T),
    4: lambda s, e, t, T, c1, c2, c3, c4, c5, c6, c7, c8: (
        c1 * s**c2 * (t**c3 + c4 * t**c5 + c6 * t**c7) * math.exp(-c8 / T)
    ),
    8: lambda s, e, t, T, c1, c2, c3, c4: c1 * math.sinh(c2 * s) ** c3 * math.exp(-c4 / T),
    9: lambda s, e, t, T, c1, c2, c3: c1 * math.exp(s / c2) * math.exp(-c3 / T),
    10: lambda s, e, t, T, c1, c2, c3: c1 * s**c2 * math.exp(-c3 / T),
    11: lambda s, e, t, T, c1, c2, c3, c4, c5, c6, c7: (
        c1 * s**c2 * t**c3 * math.exp(-c4 / T) + c5 * s**c6 * math.exp(-c7 / T)
    ),
}
"""Rates; that of 11 is the derivative of its strain."""


# ---- HIT: MOOSE and NEML2 ------------------------------------------------------------------------------------------


def hit(text: str) -> dict:
    """Nested blocks; every [name] is closed by a [] of its own indent."""
    root: dict = {}
    open_blocks, indents = [root], []
    for line in lines_without(text, "#"):
        bare = line.strip()
        if bare == "[]":
            assert len(line) - 2 == indents.pop()
            open_blocks.pop()
        elif bare.startswith("["):
            name = re.fullmatch(r"\[(\w+)\]", bare)[1]
            assert name not in open_blocks[-1]
            indents.append(len(line) - len(bare))
            open_blocks[-1][name] = {}
            open_blocks.append(open_blocks[-1][name])
        else:
            key, value = re.fullmatch(r"(\w+) = (\S+|'[^']*')", bare).groups()
            assert key not in open_blocks[-1]
            open_blocks[-1][key] = value.strip("'")
    assert open_blocks == [root]
    return root


def moose(text: str) -> Rate:
    """PowerLawCreepStressUpdate of the solid mechanics module, added by ComputeMultipleInelasticStress."""
    (materials,) = hit(text).values()
    assert materials["stress"]["type"] == "ComputeMultipleInelasticStress"
    models = [materials[name] for name in materials["stress"]["inelastic_models"].split()]
    assert {m["type"] for m in models} == {"PowerLawCreepStressUpdate"}
    assert len({m.get("base_name") for m in models}) == len(models)
    return lambda s, e, t, T: sum(_moose(m, s, t, T) for m in models)


def _moose(model: dict[str, str], s: float, t: float, T: float) -> float:
    A, n, m, Q = (float(model[key]) for key in ("coefficient", "n_exponent", "m_exponent", "activation_energy"))
    thermal = math.exp(-Q / (float(model.get("gas_constant", 8.3143)) * T)) if "temperature" in model else 1.0
    return A * s**n * thermal * (t - float(model.get("start_time", 0.0))) ** m


def neml2(text: str) -> Rate:
    """PerzynaPlasticFlowRate with ArrheniusParameter and ScalarLinearCombination; every model named must be there."""
    blocks = hit(text)
    models = blocks["Models"]
    for name in models["implicit_rate"]["models"].split():
        assert name in models
    assert models[models["model"]["predictor"]]["type"] == "ConstantExtrapolationPredictor"
    assert blocks["EquationSystems"][models["model"]["equation_system"]]["model"] == "implicit_rate"
    assert blocks["Solvers"][models["model"]["solver"]]["type"] == "Newton"
    assert models["vonmises"]["invariant"] == models["normality"]["function"] == "yield_function"
    rates = {m["flow_rate"]: m for m in models.values() if m["type"] == "PerzynaPlasticFlowRate"}
    summed = models.get("sum", {"from": "flow_rate", "to": "flow_rate"})
    assert summed["to"] == "flow_rate"
    assert summed["from"].split() == [*rates]

    def rate(s: float, e: float, t: float, T: float) -> float:
        return sum((s / _reference(models, m, T)) ** float(m["exponent"]) for m in rates.values())

    return rate


def _reference(models: dict, model: dict[str, str], T: float) -> float:
    named = models.get(model["reference_stress"])
    if named is None:
        return float(model["reference_stress"])
    assert (named["type"], named["temperature"]) == ("ArrheniusParameter", "temperature")
    value, Q, R = (float(named[k]) for k in ("reference_value", "activation_energy", "ideal_gas_constant"))
    return value * math.exp(-Q / (R * T))


# ---- code_aster ----------------------------------------------------------------------------------------------------


def aster_keywords(text: str) -> dict[str, dict]:
    """{keyword of DEFI_MATERIAU: {key: number or function of TEMP}}; the file is Python of known commands."""
    names: dict = {}
    for node in ast.parse("\n".join(lines_without(text, "#"))).body:
        (target,), call = node.targets, node.value
        assert len(target.id) <= 8
        names[target.id] = _aster_call(call, names)
    return names[target.id]


def _aster_call(call: ast.Call, names: dict):
    assert not call.args
    given = {k.arg: _aster_value(k.value, names) for k in call.keywords}
    match call.func.id:
        case "DEFI_CONSTANTE":
            return lambda T: given["VALE"]
        case "FORMULE":
            assert given["NOM_PARA"] == "TEMP"
            code = compile(given["VALE"], "FORMULE", "eval")
            assert {*code.co_names} <= {"TEMP", "exp"}
            return lambda T: eval(code, {"TEMP": T, "exp": math.exp, "__builtins__": {}})
        case "DEFI_MATERIAU" | "_F":
            return given
    raise AssertionError(call.func.id)


def _aster_value(node: ast.expr, names: dict):
    if isinstance(node, ast.Call):
        return _aster_call(node, names)
    return names[node.id] if isinstance(node, ast.Name) else ast.literal_eval(node)


def code_aster(text: str) -> Rate:
    """LEMAITRE, or LEMAITRE_FO with functions, of R5.03.08."""
    keywords = aster_keywords(text)
    (name,) = {"LEMAITRE", "LEMAITRE_FO"} & {*keywords}
    given = keywords[name]

    def rate(s: float, e: float, t: float, T: float) -> float:
        N, K, M = (v(T) if callable(v) else v for v in (given["N"], given["UN_SUR_K"], given["UN_SUR_M"]))
        return (K * s / e**M) ** N

    return rate


READERS: dict[str, Callable[[str], Rate]] = {
    "abaqus-cards": abaqus,
    "ansys": ansys,
    "moose": moose,
    "code_aster": code_aster,
    "neml2": neml2,
}
"""{name of the exporter: reader of its text}."""
