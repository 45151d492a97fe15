"""Cache folders that others can write to, with kernels that make the canary when they are loaded."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from execution_attempts.canaries import Attempt, Control, Found, creepkit, judged, left, planted, run
from execution_attempts.pickles import pickle_that_runs

SECTION = "Forged caches"
NOBODY, OTHER = 65534, 54321
SIMULATED = ("simulate", "norton", "--set", "A=1e-16", "--set", "n=4", "--stress", "60", "--end-h", "10")
PLANTED_FILES = ("law.pkl", "index.nbi", "index.1.nbc", "plugins.json", "core.so", "libcreepkit_core.so", "reduced.npy")


@dataclass(frozen=True)
class Places:
    """Folders of one attempt.

    base : made by the attacker or by us. cache : what the variable of the environment names, or lies below it.
    working : where the command runs and where the canary would be made. variables : that name the cache.
    """

    base: Path
    cache: Path
    working: Path
    variables: dict[str, str]


def _own(path: Path, user: int) -> None:
    """Give a folder or file, and all that lies in it, to a user."""
    for one in (path, *path.rglob("*")):
        os.chown(one, user, user, follow_symlinks=False)


def _open(path: Path, bits: int) -> None:
    path.chmod(stat.S_IMODE(path.stat().st_mode) | bits)


def _each_file(places: Places, change: Callable[[Path], None]) -> None:
    for path in places.cache.rglob("law.*"):
        change(path)


def _linked_by_other(places: Places) -> None:
    moved = places.base / "theirs"
    places.cache.rename(moved)
    places.cache.symlink_to(moved)
    os.chown(places.cache, OTHER, OTHER, follow_symlinks=False)
    _open(places.base, 0o1777)


def _files_by_link(places: Places) -> None:
    for path in [*places.cache.rglob("law.*")]:
        theirs = places.base / f"theirs_{path.name}"
        path.rename(theirs)
        path.symlink_to(theirs)
        os.chown(theirs, OTHER, OTHER)


def _sticky(places: Places) -> None:
    """As /tmp is: open to all, and only owners remove what lies there; the cache in it was made by another."""
    _own(places.cache, OTHER)
    os.chown(places.base, 0, 0)
    places.base.chmod(0o1777)


CASES: dict[str, tuple[bool, Callable[[Places], None]]] = {
    "the cache folder can be written by its group": (False, lambda p: _open(p.cache, stat.S_IWGRP)),
    "the cache folder can be written by all": (False, lambda p: _open(p.cache, stat.S_IWOTH)),
    "the folder of kernels can be written by all": (False, lambda p: _open(p.cache / "kernels", stat.S_IWOTH)),
    "the folder of one law can be written by all": (
        False,
        lambda p: [_open(f, stat.S_IWOTH) for f in (p.cache / "kernels").glob("law_*")] and None,
    ),
    "a file of a law can be written by its group": (
        False,
        lambda p: _each_file(p, lambda path: _open(path, stat.S_IWGRP)),
    ),
    "a folder above can be written by all": (False, lambda p: _open(p.base, stat.S_IWOTH)),
    "a folder above can be written by its group": (False, lambda p: _open(p.base, stat.S_IWGRP)),
    "another user owns everything": (True, lambda p: _own(p.base, OTHER)),
    "another user owns the cache folder": (True, lambda p: os.chown(p.cache, OTHER, OTHER)),
    "another user owns the folder of kernels": (True, lambda p: os.chown(p.cache / "kernels", OTHER, OTHER)),
    "another user owns the folder of one law": (
        True,
        lambda p: [os.chown(f, OTHER, OTHER) for f in (p.cache / "kernels").glob("law_*")] and None,
    ),
    "another user owns the files of a law": (True, lambda p: _each_file(p, lambda path: os.chown(path, OTHER, OTHER))),
    "another user made it in a sticky folder": (True, _sticky),
    "another user's link leads to it": (True, _linked_by_other),
    "its files are links": (False, _files_by_link),
}
"""{what is wrong: (whether another owner is needed, what makes it so)}."""


def variables(kind: str, base: Path) -> tuple[Path, dict[str, str]]:
    """The cache folder below `base`, and the variables of the environment that lead to it."""
    if kind == "CREEPKIT_CACHE":
        return base / "cache", {"CREEPKIT_CACHE": str(base / "cache"), "HOME": "/nonexistent"}
    if kind == "XDG_CACHE_HOME":
        return base / "creepkit", {"CREEPKIT_CACHE": "", "XDG_CACHE_HOME": str(base), "HOME": "/nonexistent"}
    return base / ".cache" / "creepkit", {"CREEPKIT_CACHE": "", "XDG_CACHE_HOME": "", "HOME": str(base)}


def as_user(words: list[str]) -> list[str]:
    """The command by user nobody; it may read everything, as Python may lie in a folder that is root's alone."""
    if os.geteuid() != 0:
        return words
    rights = ("--inh-caps", "+dac_read_search", "--ambient-caps", "+dac_read_search")
    return ["setpriv", "--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups", *rights, *words]


def can_change_user() -> bool:
    """Whether this process is root's, and can start others for user nobody."""
    return os.geteuid() == 0 and shutil.which("setpriv") is not None


@contextmanager
def genuine_cache() -> Iterator[Path]:
    """A cache folder as creepkit makes it, with the kernel of Norton's law."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch).resolve()
        done = run(creepkit(*SIMULATED), folder, {"CREEPKIT_CACHE": str(folder / "cache")})
        if not [*(folder / "cache" / "kernels").glob("law_*")]:
            raise RuntimeError(f"no kernel was kept: {done.problem}")
        yield folder / "cache"


def forge(cache: Path, working: Path) -> None:
    """Kernels that make the canary, sealed as creepkit seals them, and compiled and pickled files of other names."""
    source = planted(working).encode()
    for folder in (cache / "kernels").glob("law_*"):
        (folder / "law.py").write_bytes(source + (folder / "law.py").read_bytes())
        names = ("law.o", "law.py")
        seal = [f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in names]
        (folder / "SHA256SUMS").write_text("".join(seal))
    for name in PLANTED_FILES:
        for place in (cache, cache / "kernels"):
            (place / name).write_bytes(pickle_that_runs(working))


@contextmanager
def forged(genuine: Path, kind: str) -> Iterator[Places]:
    """A private folder with a forged cache, of the user that will run the command."""
    user = NOBODY if can_change_user() else os.geteuid()
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        top = Path(scratch).resolve()
        top.chmod(0o755)
        base, working = top / "base", top / "working"
        cache, named = variables(kind, base)
        working.mkdir()
        base.mkdir(mode=0o700)
        cache.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        shutil.copytree(genuine, cache)
        forge(cache, working)
        if os.geteuid() == 0:
            _own(base, user)
            os.chown(working, user, user)
        yield Places(base, cache, working, named)


def attempts(short: bool) -> Found:
    """Each kind of cache in each case, and the same forged cache where it is private, which is believed."""
    kinds = ("CREEPKIT_CACHE",) if short else ("CREEPKIT_CACHE", "XDG_CACHE_HOME", "HOME")
    cases = {name: case for name, case in CASES.items() if can_change_user() or not case[0]}
    if short:
        chosen = ("the cache folder can be written by all", "another user made it in a sticky folder")
        cases = {name: cases[name] for name in chosen if name in cases}
    commands = {"simulate": SIMULATED}
    if not short:
        commands["generate"] = (
            "generate", "norton", "--specimen", "uniaxial", "--samples", "8", "--to", "m.h5", "--workers", "2",
        )  # fmt: skip
    user = {} if short else {"TMPDIR": "/tmp"}
    with genuine_cache() as genuine:
        for kind in kinds:
            for name, (_, change) in cases.items():
                for command, words in commands.items():
                    if command == "generate" and kind != kinds[0]:
                        continue
                    with forged(genuine, kind) as places:
                        change(places)
                        ended = run(as_user(creepkit(*words)), places.working, {**places.variables, **user})
                        outcome, detail = judged(ended, places.working, refused=False)
                        yield Attempt(SECTION, f"{kind}: {name}", outcome, f"{command}: {detail}")
        if not short:
            yield from _relative(genuine)
        yield from _controls(genuine, kinds)


def _relative(genuine: Path) -> Found:
    """A relative name is none of a cache: it would be a folder beside the data."""
    for name in ("CREEPKIT_CACHE", "XDG_CACHE_HOME", "HOME"):
        with forged(genuine, name) as places:
            beside, named = variables(name, Path("beside"))
            (places.working / beside).parent.mkdir(parents=True)
            shutil.copytree(places.cache, places.working / beside)
            if os.geteuid() == 0:
                _own(places.working, NOBODY if can_change_user() else 0)
            ended = run(as_user(creepkit(*SIMULATED)), places.working, named)
            outcome, detail = judged(ended, places.working, refused=False)
            yield Attempt(SECTION, f"{name}: a relative folder beside the data", outcome, detail)


def _controls(genuine: Path, kinds: tuple[str, ...]) -> Found:
    """The forged cache in a private folder of the user's own, which creepkit has to believe; a loader of pickles."""
    noticed = 0
    for kind in kinds:
        with forged(genuine, kind) as places:
            run(as_user(creepkit(*SIMULATED)), places.working, places.variables)
            noticed += bool(left(places.working))
    yield Control(SECTION, "creepkit with the same forged cache, private and the user's own", len(kinds), noticed)
    with forged(genuine, kinds[0]) as places:
        loader = "import pickle, sys; pickle.load(open(sys.argv[1], 'rb'))"
        for name in PLANTED_FILES:
            run([sys.executable, "-I", "-c", loader, str(places.cache / name)], places.working)
        found = len(left(places.working).splitlines())
        yield Control(SECTION, "`pickle.load` of what lies in the cache", len(PLANTED_FILES), found)
