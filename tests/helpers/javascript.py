"""Programs that tests run in node. A test that needs it is skipped, with the reason, without it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from helpers.compilers import compiler_or_skip

_WRITTEN = """
const plain = (key, value) => {
  if (typeof value === "number" && !Number.isFinite(value)) return String(value);
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
};
process.stdout.write(JSON.stringify(await main(JSON.parse(await readFile(process.argv[2], "utf8"))), plain));
"""


def run_in_node(folder: Path, program: str, given: Any, files: Mapping[str, str] | None = None) -> Any:
    """What `main(given)` of a program returns, in one process; numbers that are not finite come as words.

    program : statements of an ES module that define `async function main(given)`. files : {name: text} beside it.
    """
    node = compiler_or_skip("node")
    for name, text in (files or {}).items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "main.mjs").write_text(
        f'import {{ readFile }} from "node:fs/promises";\n{program}\n{_WRITTEN}', encoding="utf-8"
    )
    (folder / "given.json").write_text(json.dumps(given), encoding="utf-8")
    run = subprocess.run(
        [node, folder / "main.mjs", folder / "given.json"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[:3000]
    return json.loads(run.stdout)
