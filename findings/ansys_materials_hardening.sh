#!/usr/bin/env bash
# ansys-materials-manager: a hardening curve at two temperatures, written as commands of Ansys
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ansys-materials-manager==0.4.0 ansys-units==0.15.0 pydantic==2.14.4 pyparsing==3.3.3 numpy==2.4.6
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

from ansys.materials.manager import ElasticityIsotropic, IsotropicHardening
from ansys.materials.manager._models._common import IndependentParameter
from ansys.materials.manager._models.material import Material
from ansys.materials.manager.parsers.mapdl.mapdl_writer import MapdlWriter
from ansys.units import Quantity

CURVES = {20.0: ((0.0, 300.0), (0.01, 400.0)), 800.0: ((0.0, 120.0), (0.005, 130.0), (0.02, 140.0))}
rows = [(celsius, *point) for celsius, curve in CURVES.items() for point in curve]
temperatures, strains, stresses = (list(column) for column in zip(*rows))


def table(name, values, unit):
    return IndependentParameter(name=name, values=Quantity(values, unit))


hardening = IsotropicHardening(
    stress=Quantity(stresses, "MPa"),
    independent_parameters=[table("Plastic Strain", strains, ""), table("Temperature", temperatures, "C")],
)
elastic = ElasticityIsotropic(
    youngs_modulus=Quantity([200.0, 140.0], "GPa"),
    poissons_ratio=Quantity([0.3, 0.3], ""),
    independent_parameters=[table("Temperature", list(CURVES), "C")],
)
(commands,) = MapdlWriter([Material("alloy", 1, [elastic, hardening])]).write(material_ids=[1])
print(commands)
written = {}
for line in commands.splitlines():
    words = line.replace("!", "").split(",")
    if words[0] == "TBFIELD":
        written[celsius := float(words[2])] = []
    elif words[0] == "TBPT":
        written[celsius].append((float(words[2]), float(words[3])))
print(f"ansys-materials-manager {version('ansys-materials-manager')}, MapdlWriter")
for celsius, curve in CURVES.items():
    print(f"  {celsius:3.0f} C, plastic strain and MPa: given {list(curve)}, written {written[celsius]}")
print("A good guess: each temperature is written with its own curve. Seen: with the points of the first rows of the whole table, as many as it")
print("has: at 800 C the alloy yields at 300 MPa, as it does at 20 C, where 120 were given, and its third point is the first of its own curve.")
print("No error and no warning; tables of one temperature are right. (In _mapdl_commands_parser.py the points of every temperature are counted")
print("from row 0.) Moduli keep the unit in which they were given, here GPa beside stresses in MPa: it is written as a comment, and not converted.")
seen = written[20.0] == list(CURVES[20.0]) and written[800.0] == [point[1:] for point in rows[:3]] and "200.0,140.0,,,, ! GPa" in commands
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
