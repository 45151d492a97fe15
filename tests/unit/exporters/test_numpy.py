"""The exported NumPy module agrees with the law in 50 digits, whole arrays at once, and broadcasts."""

import ast
import importlib.util

import numpy as np

from creepkit.exporters.python import NumpyExporter, PythonExporter
from creepkit.laws.combined import COMBINED
from creepkit.records import LawWithValues
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


def test_the_module_needs_numpy_alone():
    """The error function, which NumPy lacks, comes from the standard library."""
    for law in LAWS.values():
        text = NumpyExporter().text(LawWithValues(law, law.center()))
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
        modules = {getattr(node, "module", None) or node.names[0].name for node in imports}
        assert modules <= {"numpy", "math"}, law.name
        assert ("math" in modules) == ("erf" in text), law.name
