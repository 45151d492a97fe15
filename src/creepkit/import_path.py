"""Where modules come from: never the working folder, nor a folder that is named relative to it.

Python itself puts the working folder first in `sys.path` for `python -m creepkit`, and reads an empty or relative entry
of PYTHONPATH as a place in it. A file beside the data, such as `json.py`, would then be executed. What Python imports
before a line of creepkit runs (`sitecustomize` of such an entry, `creepkit.py` for `python -m creepkit`) is beyond
this module; the script `creepkit`, and `python -P -m creepkit`, look into no working folder at all.
"""

# no `from __future__ import`: that imports a module too, before the working folder is left out; _signal is part of the
# interpreter, while signal imports enum and others, during which Ctrl-C would end in a traceback
import _signal  # type: ignore[import-not-found]
import os
import sys

TYPE_CHECKING = False  # as in typing, which is not imported yet
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

_OPTIONS_WITH_VALUES = "WX"


def is_the_command_line() -> bool:
    """Whether this process was started as `creepkit` or as `python -m creepkit`."""
    return _as_module() or (
        _started_module() is None
        and os.path.splitext(os.path.basename(sys.argv[0] if sys.argv else ""))[0] == "creepkit"
    )


def leave_working_folder_out() -> None:
    """Take the working folder out of `sys.path` of the command line."""
    if _as_module() and not sys.flags.safe_path and sys.argv[:1] == ["-m"]:  # Python has just put it there
        del sys.path[:1]
    named = {*_entries(os.environ.get("PYTHONPATH", ""))}
    relative = {os.path.abspath(entry) for entry in named if not os.path.isabs(entry)} - named
    sys.path[:] = [entry for entry in sys.path if os.path.isabs(entry) and entry not in relative]


def end_without_traceback_at_ctrl_c() -> None:
    """Until the command line is imported, Ctrl-C ends the process as it does programs that are not Python's."""
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _signal.SIG_DFL)


def leave_settings_of_working_folder_out() -> None:
    """Have matplotlib, whenever it is first imported, look for its file of settings everywhere but here.

    A file of the working folder would come before the user's own settings, may have LaTeX executed (`text.usetex`),
    and older versions of matplotlib evaluate parts of it. It may be put there at any time before the import.
    """
    if not any(isinstance(finder, _MatplotlibFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _MatplotlibFinder())


_SETTINGS_OF_WORKING_FOLDER = "matplotlibrc"
"""The name that matplotlib looks for first, relative to the working folder; other places have absolute paths."""


class _MatplotlibFinder:
    """Finds matplotlib where the other finders do, and has it imported as if no settings lay in the working folder.

    Neither the working folder nor what other threads find out of files changes meanwhile.
    """

    def find_spec(
        self, fullname: str, path: "Sequence[str] | None" = None, target: "ModuleType | None" = None
    ) -> "ModuleSpec | None":
        """Where matplotlib is; None of everything else."""
        if fullname != "matplotlib":
            return None
        others = (finder for finder in list(sys.meta_path) if finder is not self)
        spec = next(filter(None, (finder.find_spec(fullname, path, target) for finder in others)), None)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module
            spec.loader.exec_module = lambda module: _execute_without_settings(execute, module)  # type: ignore[method-assign]
        return spec


def _execute_without_settings(execute: "Callable[[ModuleType], None]", module: "ModuleType") -> None:
    exists = os.path.exists
    os.path.exists = lambda path: path != _SETTINGS_OF_WORKING_FOLDER and exists(path)
    try:
        execute(module)
    finally:
        os.path.exists = exists


def environment_without_working_folder() -> dict[str, str]:
    """The environment for another interpreter: its variables name no place of Python's relative to the working folder.

    Absolute entries stay: whoever names a folder there trusts it.
    """
    environment = dict(os.environ)
    kept = [entry for entry in _entries(environment.pop("PYTHONPATH", "")) if os.path.isabs(entry)]
    if kept:
        environment["PYTHONPATH"] = os.pathsep.join(kept)
    for name in ("PYTHONPYCACHEPREFIX", "PYTHONUSERBASE"):
        if not os.path.isabs(environment.get(name, os.sep)):
            del environment[name]
    return environment


def options_of_another_interpreter() -> list[str]:
    """-P, which leaves the working folder out, and those options of this process that restrict imports further."""
    if sys.flags.isolated:
        return ["-I"]
    given = {"-E": sys.flags.ignore_environment, "-s": sys.flags.no_user_site, "-S": sys.flags.no_site}
    return ["-P", *(option for option, is_given in given.items() if is_given)]


def _entries(path: str) -> list[str]:
    """The entries of a search path; an empty one is the working folder."""
    return path.split(os.pathsep) if path else []


def _as_module() -> bool:
    return (_started_module() or "").split(".")[0] == "creepkit"


def _started_module() -> str | None:
    """The module of `python -m module`, as the command of this process names it; None without that option."""
    arguments = iter(sys.orig_argv[1:])
    for argument in arguments:
        if not argument.startswith("-") or argument == "-":
            return None
        if argument == "--check-hash-based-pycs":
            next(arguments, None)
        if argument.startswith("--"):
            continue
        for k, letter in enumerate(argument[1:], 2):
            if letter == "c":
                return None
            if letter == "m":
                return argument[k:] or next(arguments, None)
            if letter in _OPTIONS_WITH_VALUES:
                if not argument[k:]:
                    next(arguments, None)
                break
    return None
