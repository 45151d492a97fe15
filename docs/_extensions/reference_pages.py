"""Reference pages: one of the public names of creepkit, and one for each package with all of its modules."""

import importlib
import inspect
import pkgutil
from pathlib import Path
from types import ModuleType

from sphinx.application import Sphinx

import creepkit

PAGES = Path(__file__).parents[1] / "reference" / "pages"


def write_pages(app: Sphinx) -> None:
    """Write the pages that autodoc then fills."""
    PAGES.mkdir(parents=True, exist_ok=True)
    pages = {"public_names": _public_names(), **{name: _package(name) for name in package_names()}}
    for stale in {path.stem for path in PAGES.glob("*.rst")} - pages.keys():
        (PAGES / f"{stale}.rst").unlink()
    for name, text in pages.items():
        path = PAGES / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def package_names() -> list[str]:
    """Packages and modules directly below creepkit."""
    return sorted(module.name for module in pkgutil.iter_modules(creepkit.__path__) if module.name[0] != "_")


def _public_names() -> str:
    """Every name of creepkit/__init__.pyi under a heading of its own: functions, then records."""
    public = {name: getattr(creepkit, name) for name in sorted(creepkit.__all__, key=str.lower)}
    functions = [name for name, value in public.items() if inspect.isroutine(value)]
    records = [name for name, value in public.items() if isinstance(value, type)]
    values = {name: value for name, value in public.items() if name not in {*functions, *records}}
    parts = [_title("Public names", "="), "What ``import creepkit as ck`` offers.\n"]
    for heading, names, directive in (("Functions", functions, "autofunction"), ("Records", records, "autoclass")):
        parts.append(_title(heading, "-"))
        for name in names:
            parts += [_title(f"ck.{name}", "~"), f".. {directive}:: creepkit.{name}\n   :no-index:\n"]
    parts.append(_title("Modules and values", "-"))
    parts += [f"- ``ck.{name}`` : {_kind(value)}" for name, value in values.items()]
    return "\n".join(parts)


def _kind(value: object) -> str:
    if isinstance(value, ModuleType):
        return f"module {value.__name__}"
    if isinstance(value, (str, float)):
        return f"``{value!r}``"
    return f"of the class {type(value).__name__}"


def _package(name: str) -> str:
    """The modules of a package, in the order of their names."""
    root = importlib.import_module(f"creepkit.{name}")
    names = [root.__name__]
    if hasattr(root, "__path__"):
        modules = pkgutil.walk_packages(root.__path__, f"{root.__name__}.")
        names += sorted(module.name for module in modules if _is_python(module))
    parts = [_title(root.__name__, "=")]
    for module in names:
        if module != root.__name__:
            parts.append(_title(module, "-"))
        parts.append(f".. automodule:: {module}\n")
    return "\n".join(parts)


def _is_python(module: pkgutil.ModuleInfo) -> bool:
    """Whether a module has a text: the compiled core is a library that ends as extension modules do."""
    spec = module.module_finder.find_spec(module.name, None)
    return spec is not None and str(spec.origin).endswith(".py")


def _title(text: str, line: str) -> str:
    return f"{text}\n{line * len(text)}\n"


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for sources, after the curves of the law pages were simulated."""
    app.connect("builder-inited", write_pages, priority=700)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
