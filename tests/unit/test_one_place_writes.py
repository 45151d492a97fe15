"""Files that a user names are written by creepkit.files.writing alone, whose rules keep what creepkit did not write."""

from __future__ import annotations

import ast

from helpers import source_tree

WRITING_METHODS = {"write_text", "write_bytes", "savefig", "touch", "symlink_to", "hardlink_to"}
WRITING_FUNCTIONS = {
    ("os", "replace"), ("os", "rename"), ("os", "link"), ("os", "symlink"), ("os", "truncate"),
    ("shutil", "copy"), ("shutil", "copy2"), ("shutil", "copyfile"), ("shutil", "copytree"), ("shutil", "move"),
    ("np", "save"), ("np", "savez"), ("np", "savetxt"), ("json", "dump"), ("torch", "save"), ("pickle", "dump"),
    ("tempfile", "NamedTemporaryFile"), ("safetensors", "save_file"),
}  # fmt: skip


EXCEPTIONS = {
    "creepkit.files.writing": "the one place",
    "creepkit.files.locking": "files that are locked, and hold nothing",
    "creepkit.cli.failures": "the report of a fault, in a new private folder; and the null device",
    "creepkit.cli.browser_page": "the page that sends a browser on, in a new private folder",
    "creepkit.core.compile": "the compiled core, in the folder of the sources",
    "creepkit.kernels.compilation": "compiled laws, in the cache whose owner and permissions were checked",
    "creepkit.reports.figures": "savefig() to the temporary name of replace_on_success()",
    "creepkit.files.hdf5_files": "HDF5 to the temporary name of replace_on_success()",
    "creepkit.testing.reader_checks": "samples for readers, in a temporary folder",
    "creepkit.testing.camera_checks": "samples for camera formats, in a temporary folder",
}
"""{module: what it writes}; none of these is named by a user."""


def _mode(call: ast.Call, position: int) -> str:
    named = [one.value for one in call.keywords if one.arg == "mode"]
    node = named[0] if named else call.args[position] if len(call.args) > position else None
    return str(node.value) if isinstance(node, ast.Constant) else ""


def _writes(call: ast.Call) -> bool:
    function = call.func
    if isinstance(function, ast.Name):
        return function.id == "open" and any(sign in _mode(call, 1) for sign in "wxa+")
    if not isinstance(function, ast.Attribute):
        return False
    owner = function.value.id if isinstance(function.value, ast.Name) else ""
    if (owner, function.attr) in WRITING_FUNCTIONS or (owner, function.attr) == ("os", "open"):
        return (
            (owner, function.attr) != ("os", "open")
            or "O_CREAT" in ast.unparse(call)
            or "O_WRONLY" in ast.unparse(call)
        )
    if function.attr == "open":
        return any(sign in _mode(call, 0) for sign in "wxa+")
    if function.attr == "File":
        return any(sign in _mode(call, 1) for sign in "wxa+")
    return function.attr in WRITING_METHODS


def test_no_other_module_writes() -> None:
    found = {
        module: f"line {node.lineno}: {ast.unparse(node)[:80]}"
        for module in source_tree.modules()
        for node in ast.walk(source_tree.tree(module))
        if isinstance(node, ast.Call) and _writes(node)
    }
    assert {module: what for module, what in found.items() if module not in EXCEPTIONS} == {}


def test_what_is_written_beside_the_rules_is_named_here() -> None:
    """`internal=True` replaces without asking: for names that only creepkit uses."""
    internal = {
        module
        for module in source_tree.modules()
        for node in ast.walk(source_tree.tree(module))
        if isinstance(node, ast.Call)
        and any(one.arg == "internal" and not isinstance(one.value, ast.Name) for one in node.keywords)
    }
    assert internal == {
        "creepkit.cli.new_package",  # new files in a place where none was
        "creepkit.dataset.shards",  # FILE.parts
        "creepkit.screening.files",  # one result an alloy, below the folder of the plate
        "creepkit.specimens.reduced_order_training",  # the cache
        "creepkit.studies.lock",  # study.lock, which is refused where it is another file
        "creepkit.surrogates.weight_files",  # the checkpoint of a training
    }
