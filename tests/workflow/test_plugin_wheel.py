"""A law from outside: a package with a law is built, installed elsewhere, judged, simulated, identified and exported.

The new environment sees the packages that are installed here, and the wheel besides; nothing is downloaded.
"""

import json
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import LawError

pytestmark = pytest.mark.nightly

LAW = '''
"""A steel that softens: damage speeds up creep, and both are thermally activated."""

import math

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, State, hookimpl, parameters, states, stress, temperature

A, n, C, v, Q = parameters("A n C v Q")
(damage,) = states("damage")
warmth = sympy.exp(Q / GAS_CONSTANT * (1 / sympy.Float(1073.15) - 1 / temperature))

SOFT_STEEL = CreepLaw(
    name="soft-steel",
    title="Steel that softens",
    terms={"softening creep": A * (stress / (1 - damage)) ** n * warmth},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-30, 1e-8), scale="log", off=0.0),
        n: Param("stress exponent", bounds=(2, 6)),
        C: Param("damage coefficient", unit="1/s", bounds=(1e-30, 1e-8), scale="log", limits=(0, math.inf)),
        v: Param("stress exponent of damage", bounds=(2, 6)),
        Q: Param("activation energy", unit="J/mol", bounds=(1e5, 6e5), limits=(0, math.inf)),
    },
    states={damage: State(0.0, C * (stress / (1 - damage)) ** v * warmth, limit=0.9)},
    references=("nobody (2025), for this test",),
)


@hookimpl
def creepkit_laws():
    return [SOFT_STEEL]
'''
TRUTH = {"A": 2e-16, "n": 4.5, "C": 3e-14, "v": 4.0, "Q": 3e5}
PROJECT = """
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"
[project]
name = "creepkit-soft-steel"
version = "0.1.0"
dependencies = ["creepkit"]
[project.entry-points."creepkit.laws"]
soft-steel = "creepkit_soft_steel"
[tool.hatch.build.targets.wheel]
only-include = ["creepkit_soft_steel.py"]
"""
USE = f"""
import json
import numpy as np
import creepkit as ck

law, tests = ck.law("soft-steel"), []
for stress, T, hours in ((80, 1073.15, 30), (100, 1073.15, 12), (120, 1043.15, 14), (90, 1103.15, 8)):
    how = {{"loading": ck.constant_stress(stress, "stress"), "temperature": T}}
    run = ck.simulate(law, "uniaxial", {TRUTH}, times=np.linspace(60, 3600 * hours, 40), **how)
    tests.append(run.replace(name=str(stress)))
fit = ck.identify(law, tests, starts=2)
fit.save("fit.json")
print(json.dumps({{
    "values": dict(fit.values), "conforms": ck.check_law(law).passed, "python": ck.export(fit, "python"),
}}))
"""


def run(*words: object, cwd: Path) -> str:
    done = subprocess.run([str(w) for w in words], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_law_of_a_wheel_serves_as_one_that_ships(tmp_path: Path) -> None:
    package = tmp_path / "soft-steel"
    package.mkdir()
    (package / "creepkit_soft_steel.py").write_text(LAW.lstrip())
    (package / "pyproject.toml").write_text(PROJECT.lstrip())
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--no-index", "--no-deps", "--no-build-isolation", "-w", ".", package, cwd=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    run(sys.executable, "-m", "venv", "--without-pip", "env", cwd=tmp_path)
    python = tmp_path / "env" / "bin" / "python"
    site = sysconfig.get_path("purelib", vars={"base": str(tmp_path / "env"), "platbase": str(tmp_path / "env")})
    here = sysconfig.get_path("purelib")
    (Path(site) / "here.pth").write_text(f"import site; site.addsitedir({here!r})\n")
    run(*pip, "--python", python, "install", "--no-index", "--no-deps", wheel, cwd=tmp_path)

    told = json.loads(run(python, "-c", USE, cwd=tmp_path).splitlines()[-1])

    assert told["conforms"]
    assert "soft-steel" in told["python"]
    assert told["values"] == pytest.approx(TRUTH, rel=0.3)
    assert [told["values"][name] for name in "nvQ"] == pytest.approx([TRUTH[name] for name in "nvQ"], rel=0.05)
    fit = ck.load(tmp_path / "fit.json")  # without the package its law comes back as a tree
    assert fit.law.title == "Steel that softens"
    with pytest.raises(LawError, match="there is no law 'soft-steel'"):
        ck.law("soft-steel")
