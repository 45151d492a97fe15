"""The exported NumPy module agrees with the law in 50 digits, whole arrays at once, and broadcasts."""

import ast
import importlib.util

import numpy as np
import pytest

from creepkit.exporters.python import NumpyExporter, PythonExporter
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units
from helpers.export_cases import LAWS, TOLERANCE, case, renamed


def module(law, folder, values=None, exporter=None, **more):
    """The exported module, loaded."""
    source = LawWithValues(law, values or law.center(), **more)
    path = folder / "exported_arrays.py"
    path.write_text((exporter or NumpyExporter()).text(source), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("exported_arrays", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def test_every_law_agrees_with_50_digits(tmp_path):
    bad = []
    for name, law in LAWS.items():
        judged = case(name)
        loaded = module(law, tmp_path, judged.sets[0])
        other = renamed((tmp_path / "exported_arrays.py").read_text())
        rows = [judged.named(k) | values for k, values in enumerate(judged.sets)]
        given = {other.get(symbol, symbol): np.array([row[symbol] for row in rows]) for symbol in rows[0]}

        rates = np.broadcast_to(loaded.rate(**given), len(rows))
        inner = loaded.state_rates(**given).values() if law.states else []
        columns = [rates, *(np.broadcast_to(growth, len(rows)) for growth in inner)]
        told, size = judged.worst(np.stack(columns, axis=1)[:, :, None], judged.logs(rates))
        bad += [] if size < TOLERANCE else [told]
    assert not bad, "\n".join(bad)


def test_arguments_and_parameters_broadcast(tmp_path):
    loaded = module(COMBINED, tmp_path)
    plain = module(COMBINED, tmp_path, exporter=PythonExporter())
    stresses, strains, exponents = np.array([80.0, 120.0]), np.array([1e-3, 1e-2, 1e-1]), np.array([3.0, 4.0, 5.0, 6.0])
    found = loaded.rate(stresses[:, None, None], strain=strains[:, None], time=3600.0, n_1=exponents)
    expected = [[[plain.rate(s, strain=e, time=3600.0, n_1=k) for k in exponents] for e in strains] for s in stresses]
    assert found.shape == (2, 3, 4)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_numbers_give_numbers(tmp_path):
    assert float(module(NORTON, tmp_path, {"A": 1e-16, "n": 5.0}).rate(100.0)) == pytest.approx(1e-6, rel=1e-12)


def test_beyond_doubles_the_rate_is_infinite_without_a_warning(tmp_path):
    loaded = module(LAWS["registered hyperbolic-sine"], tmp_path, {"A": 1e-5, "n": 8.0, "B": 1.0})
    found = loaded.rate(np.array([1.0, 2000.0]))
    assert found[0] == pytest.approx(1e-5 * np.sinh(1.0) ** 8, rel=1e-13)
    assert found[1] == np.inf


def test_virgin_material_has_a_finite_rate(tmp_path):
    assert np.isfinite(module(COMBINED, tmp_path).rate(np.array([0.0, 100.0]), strain=0.0, time=0.0)).all()


def test_units_are_converted_on_entry_and_rates_on_exit(tmp_path):
    law = LAWS["foreign Kachanov-Rabotnov"] + TIME_HARDENING
    point = {"omega": 0.3}
    plain = module(law, tmp_path)
    rate = plain.rate(120.0, time=7.2e4, principal_stress=90.0, **point)
    growth = plain.state_rates(120.0, time=7.2e4, principal_stress=90.0, **point)["omega"]
    other = module(law, tmp_path, units=Units("Pa", "h"))
    there = {"time": 20.0, "principal_stress": 9e7, **point}
    assert other.rate(1.2e8, **there) == pytest.approx(3600 * rate, rel=1e-13)
    assert other.state_rates(1.2e8, **there)["omega"] == pytest.approx(3600 * growth, rel=1e-13)


def test_the_module_needs_numpy_alone():
    """The error function, which NumPy lacks, comes from the standard library."""
    for law in LAWS.values():
        text = NumpyExporter().text(LawWithValues(law, law.center()))
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
        modules = {getattr(node, "module", None) or node.names[0].name for node in imports}
        assert modules <= {"numpy", "math"}, law.name
        assert ("math" in modules) == ("erf" in text), law.name


def test_words_of_numpy_may_name_parameters(tmp_path):
    words = parameters("np exp errstate choose")
    law = CreepLaw(
        "odd",
        {"x": words[0] * stress ** words[1] * words[2] * words[3]},
        {words[0]: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0)}
        | dict.fromkeys(words[1:], Param("number", (1, 8))),
    )
    loaded = module(law, tmp_path, {"np": 1e-9, "exp": 2.0, "errstate": 3.0, "choose": 4.0})
    assert loaded.rate(8.0) == pytest.approx(1e-9 * 64 * 12, rel=1e-13)
