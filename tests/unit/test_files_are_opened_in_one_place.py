"""Files of users are opened by creepkit.files alone; everything else that opens a file is listed with its reason."""

from __future__ import annotations

import ast

from helpers import source_tree

OPENING_NAMES = frozenset(
    (
        *("open", "read_text", "read_bytes", "fdopen", "mmap", "memmap", "fromfile", "loadtxt", "genfromtxt"),
        *("load_workbook", "safe_open", "loadmat", "savetxt", "read_csv", "unpack_archive"),
        *("File", "ZipFile", "GzipFile", "LZMAFile", "BZ2File", "TarFile", "TextIOWrapper", "FileIO"),
    )
)
"""Functions, methods and classes that open a file by name, whatever module or object they are taken from."""


LOADING = frozenset(("json.load", "tomllib.load", "np.load", "numpy.load", "pickle.load", "torch.load", "csv.load"))


OWN_OPENERS = frozenset(("read_text", "read_bytes"))
"""Names that functions of creepkit.files.reading have too; called without an object they are those."""


ALLOWED = {
    "creepkit.annotation_checks read_text": "sources of the package",
    "creepkit.app.page read_text": "files of the package",
    "creepkit.app.runtime_files read_text": "files of the package",
    "creepkit.exporters.creep_subroutine read_text": "templates of the package",
    "creepkit.exporters.javascript read_text": "templates of the package",
    "creepkit.exporters.python read_text": "sources of the package",
    "creepkit.reports.html.page read_text": "templates of the package",
    "creepkit.kernels.compilation read_bytes": "sources of the package, and the cache, whose owner is checked",
    "creepkit.inverse.kept_fits read_bytes": "sources of the package",
    "creepkit.specimens.reduced_order_training read_bytes": "sources of the package",
    "creepkit.cli.failures open": "the null device, in place of a stream that is closed",
    "creepkit.cli.failures TextIOWrapper": "its own output without a buffer, written whole",
    "creepkit.cli.demo read_text": "example data of the package",
    "creepkit.cli.demo read_bytes": "example data of the package",
    "creepkit.jobs.worker_process fdopen": "the output of a worker, a pipe to its parent",
    "creepkit.cli.browser_page open": "the page for a browser that it makes, written and never read",
    "creepkit.registry.plugin_sources read_bytes": "the source of an installed package, to find a hook in it",
    "creepkit.readers.spreadsheet_parts ZipFile": "bytes in memory, read by files.reading",
    "creepkit.readers.spreadsheets load_workbook": "bytes in memory, read by files.reading and checked",
}
"""{module and name: why it may}."""


def _openings(module: str) -> set[str]:
    names = set()
    for node in ast.walk(source_tree.tree(module)):
        if not isinstance(node, ast.Call):
            continue
        function = node.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        owner = ast.unparse(function.value) if isinstance(function, ast.Attribute) else ""
        if f"{owner}.{name}" in LOADING:
            names.add(f"{module} {owner}.{name}")
        elif name in OPENING_NAMES and not (name in OWN_OPENERS and not owner):
            names.add(f"{module} {name}")
    return names


def test_no_other_module_opens_files() -> None:
    found = {
        opening
        for module in source_tree.modules()
        if not module.startswith("creepkit.files.")
        for opening in _openings(module)
    }
    assert sorted(found - ALLOWED.keys()) == []
    assert sorted(ALLOWED.keys() - found) == []
