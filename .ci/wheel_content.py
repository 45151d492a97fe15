"""Check what a wheel and a source distribution hold: every file that git tracks, in the package or at all; no other."""

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
wheel, distribution = sys.argv[1:]
tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
files = {name for name in tracked.split("\0") if name}

in_wheel = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
package = {name.removeprefix("src/") for name in files if name.startswith("src/creepkit/")}
built = {name for name in in_wheel - package if Path(name).name.rpartition("creepkit_core.")[1]}
library = {name for name in built if not name.endswith(".wasm")}  # beside it the core of pages, where Zig is
with tarfile.open(distribution) as archive:
    in_source = {name.partition("/")[2] for name in archive.getnames()}

problems = [
    *(f"the wheel lacks {name}" for name in sorted(package - in_wheel)),
    *(f"the wheel holds {name}" for name in sorted(in_wheel - package - built)),
    *(f"the source distribution lacks {name}" for name in sorted(files - in_source)),
    *(f"the source distribution holds {name}" for name in sorted(in_source - files - {"PKG-INFO"})),
]
if len(library) != 1:
    problems.append(f"the wheel holds {len(library)} compiled cores")
sys.exit("\n".join(problems) or None)  # an empty text would be an error
