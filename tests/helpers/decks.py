"""Input decks of CalculiX as the tables of nodes, elements and sets that meshes are read from."""

import json
from collections import defaultdict
from pathlib import Path

from creepkit.fem.mesh import Mesh
from creepkit.fem.mesh_files import read_mesh


def mesh_of_deck(path: Path, folder: Path) -> Mesh:
    """The mesh of a deck of CAX8R elements; its sets TOP and FIX are observed and held. folder : for the tables."""
    cards = defaultdict(list)
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            card = line.split(",AMPLITUDE")[0]
        else:
            cards[card].append([cell.strip() for cell in line.split(",") if cell.strip()])
    elements = [cell for row in cards["*ELEMENT,TYPE=CAX8R,ELSET=EALL"] for cell in row]
    sets = {name: [int(n) for row in cards[f"*NSET,NSET={name}"] for n in row] for name in ("TOP", "FIX")}
    for element, face, _ in cards["*DLOAD"]:
        sets.setdefault(f"face_S{face[1]}", []).append(int(element))
    rows = [elements[k : k + 9] for k in range(0, len(elements), 9)]
    nodes = [row[:3] for row in cards["*NODE,NSET=NALL"]]
    for name, head, table in (("nodes", "id,r_mm,z_mm", nodes), ("quads", "id,n1,n2,n3,n4,n5,n6,n7,n8", rows)):
        (folder / f"{name}.csv").write_text("\n".join([head, *map(",".join, table)]))
    (folder / "sets.json").write_text(json.dumps(sets))
    files = (folder / name for name in ("nodes.csv", "quads.csv", "sets.json"))
    return read_mesh(*files, held=["FIX"], pressed="face", top="TOP")
