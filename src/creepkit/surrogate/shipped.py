"""Surrogates by name: those that come with creepkit, and files."""

from __future__ import annotations

from pathlib import Path

from creepkit.errors import SurrogateError, nearest
from creepkit.surrogate.surrogate import Surrogate, load_surrogate

WEIGHTS_FOLDER = Path(__file__).with_name("weights")
SUFFIX = ".safetensors"


def shipped_files() -> dict[str, Path]:
    """{name: file} of the surrogates inside the package."""
    return {path.name.removesuffix(SUFFIX): path for path in sorted(WEIGHTS_FOLDER.glob(f"*{SUFFIX}"))}


def surrogate_by_name(name_or_path: str | Path) -> Surrogate:
    """The surrogate of this name, or in this file."""
    files, text = shipped_files(), str(name_or_path)
    if isinstance(name_or_path, str) and text in files:
        return load_surrogate(files[text])
    if not (text.endswith(SUFFIX) or Path(text).exists()):
        raise SurrogateError(f"no surrogate is called '{text}', and there is no such file; {nearest(text, files)}")
    return load_surrogate(text)
