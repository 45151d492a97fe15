"""Exported texts compiled and run as their target would, and read where nothing here can run them.

What comes back is all that a user of the target sees of the law: numbers, or the lines that are no comment.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from pathlib import Path

from creepkit.errors import CreepkitError
from execution_attempts.canaries import CANARY, run

sys.path.append(str(Path(__file__).resolve().parents[2]))
from helpers.mfront_integrator import scalar_function

POINTS = ((100.0, 1050.0, 0.1), (37.5, 1123.0, 0.25))
"""Stress MPa, temperature K, internal variable."""


class BrokenTextError(Exception):
    """What a compiler, a program or a parser says against a text."""


def _done(words: Sequence[str], folder: Path) -> str:
    """What a program prints; BrokenTextError where it fails."""
    ended = run(words, folder)
    if ended.code:
        raise BrokenTextError(f"{words[0]}: {ended.problem[-300:]}")
    return ended.output


# ---- programs ------------------------------------------------------------------------------------------------------

_PARAMETERS = "      implicit real*8(a-h,o-z)\n      parameter (nprecd=2)\n"
_CREEP_CALLS = "".join(
    f"""      statev = 0.0d0
      ec = 0.0d0
      decra = 0.0d0
      q = {stress}d0
      call creep(decra, deswa, statev, none, ec, none, 0.0d0, q,
     & {temperature}d0, 0.0d0, none, none, time, 3600.0d0, name, 1, 2,
     & none, 1, 1, 1, 1, 1, 1, 1)
      write(*, '(es25.17)') decra(1), decra(5), statev(1)
"""
    for stress, temperature, _ in POINTS
)
_CREEP = f"""      program drive
      implicit none
      double precision decra(5), deswa(5), statev(10), ec(2), none(10)
      double precision time(3), q
      character*80 name
      name = 'M'
      none = 0.0d0
      deswa = 0.0d0
      time = 7200.0d0
{_CREEP_CALLS}      end
"""


def fortran(text: str, folder: Path, *options: str) -> str:
    """Two increments of CREEP."""
    (folder / "ABA_PARAM.INC").write_text(_PARAMETERS)
    (folder / "law.f").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / "drive.f").write_text(_CREEP)
    _done(("gfortran", "-O0", *options, "law.f", "drive.f", "-o", "drive"), folder)
    return _done(("./drive",), folder)


def preprocessed_fortran(text: str, folder: Path) -> str:
    """The same after a preprocessor, which Abaqus calls: to it, C comments are comments."""
    return fortran(text, folder, "-cpp")


def _c_calls(text: str) -> str:
    """A main program that calls the functions of an exported C file."""
    found = re.search(r"^double (\w+)_log_rate\(([^)]*)\)", text, re.MULTILINE)
    if found is None:
        raise BrokenTextError("no function of the rate")
    name, arguments = found[1], found[2].split(",")[:-1]
    numbers = [(p[0],) if len(arguments) == 1 else p for p in POINTS]
    declared = ", ".join(["double"] * len(arguments))
    states = len(arguments) > 1
    lines = [f"double {name}_rate({declared}); double {name}_log_rate({declared}, double *);"]
    lines += [f"void {name}_state_rates({declared}, double *, double (*)[{len(arguments)}]);"] if states else []
    lines += ["int main(void) {", "double slopes[9], rates[9], rows[1][3] = {{0}}; int k;"]
    for values in numbers:
        given = ", ".join(map(repr, values))
        lines.append(f'printf("%.17g %.17g\\n", {name}_rate({given}), {name}_log_rate({given}, slopes));')
        lines.append(f'for (k = 0; k != {len(arguments)}; ++k) printf("%.17g\\n", slopes[k]);')
        if states:
            lines.append(f'{name}_state_rates({given}, rates, rows); printf("%.17g %.17g\\n", rates[0], rows[0][0]);')
    return "\n".join(["#include <stdio.h>", *lines, "(void)rates; (void)rows; return 0; }", ""])


def c(text: str, folder: Path, words: Sequence[str] = ("gcc", "-std=c99", "-trigraphs")) -> str:
    """Rates, logarithms and slopes."""
    (folder / "law.c").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / "drive.c").write_text(_c_calls(text))
    _done((*words, "law.c", "drive.c", "-lm", "-o", "drive"), folder)
    return _done(("./drive",), folder)


def cpp(text: str, folder: Path) -> str:
    """The same text as C++."""
    return c(text, folder, ("g++", "-x", "c++", "-trigraphs"))


_NODE = f"""
import {{ law, rate, terms, stateRates, kernel }} from "./law.mjs";
const points = {json.dumps(POINTS)};
for (const [stress, temperature, w] of points) {{
  const point = {{ stress, temperature, w }};
  const used = Object.fromEntries([...law.variables, ...law.states.map((s) => s.name)].map((n) => [n, point[n]]));
  console.log(rate(used), Object.values(terms(used)), Object.values(stateRates(used)));
  const out = new Float64Array(2 * 8);
  kernel(law.parameters.map((p) => p.value)).update([stress, 0.0, 0.0, temperature, stress, stress / 3, w], out);
  console.log(Array.from(out).join());
}}
"""


def javascript(text: str, folder: Path) -> str:
    """Rates, terms, rates of internal variables and all derivatives."""
    (folder / "law.mjs").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / "drive.mjs").write_text(_NODE)
    return _done(("node", "drive.mjs"), folder)


_PYTHON = f"""
import inspect, sys
sys.path.insert(0, ".")
import law
for stress, temperature, w in {POINTS!r}:
    for function in (law.rate, getattr(law, "state_rates", law.rate)):
        needed = [n for n, p in inspect.signature(function).parameters.items() if p.default is p.empty]
        given = dict(stress=stress, temperature=temperature, w=w)
        print(repr(function(**{{name: given[name] for name in needed}})))
"""


def python(text: str, folder: Path) -> str:
    """Rates by the module's own functions."""
    (folder / "law.py").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / "drive.py").write_text(_PYTHON)
    return _done((sys.executable, "-I", "-B", "drive.py"), folder)


_COMMANDS = """
said = []
def command(name):
    return lambda **given: said.append((name, given)) or name
names = {name: command(name) for name in ("_F", "DEFI_MATERIAU", "DEFI_CONSTANTE", "FORMULE")}
exec(compile(open("law.comm", "rb").read(), "law.comm", "exec"), names)
print(said)
"""


def code_aster(text: str, folder: Path) -> str:
    """The commands of a file, which is Python, and what they are given."""
    (folder / "law.comm").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / "drive.py").write_text(_COMMANDS)
    return _done((sys.executable, "-I", "drive.py"), folder)


class _Law:
    """What the helper of MFront's tests asks of a law."""

    def __init__(self, text: str) -> None:
        import sympy

        self.states = {sympy.Symbol(name): None for name in re.findall(r"^@StateVariable real (\w+)", text, re.M)}


def mfront(text: str, folder: Path) -> str:
    """The statements of the integrator, compiled as they stand."""
    function = scalar_function("law", _Law(text), text)
    calls = "".join(f"one({stress}, {temperature}, {w});" for stress, temperature, w in POINTS)
    program = (
        "#include <cmath>\n#include <cstdio>\nusing namespace std;\nusing real = double;\n"
        f"{function}\nvoid one(double s, double T, double w) {{ double point[] = {{s, 0, 0, T, s, s / 3, w, 0}}, "
        'out[32] = {0}; law(point, out); for (double each : out) printf("%.17g\\n", each); }\n'
        f"int main() {{ {calls} }}\n"
    )
    (folder / "law.cpp").write_text(program, encoding="utf-8", errors="surrogatepass")
    _done(("g++", "-std=c++14", "-trigraphs", "law.cpp", "-o", "drive"), folder)
    keywords = re.findall(r"@\w+", re.sub(r'//.*|"[^"\n]*"', "", text))
    return _done(("./drive",), folder) + " ".join(keywords)


# ---- texts that are read -------------------------------------------------------------------------------------------


def lines_of_code(marker: str) -> Callable[[str, Path], str]:
    """What a text says beside its comments; identifiers are left out, as the law's names become such."""

    def read(text: str, _: Path) -> str:
        lines = [line if marker == "**" else line.partition(marker)[0] for line in re.split(r"[\r\n]", text)]
        kept = [line.rstrip() for line in lines if line.strip() and not line.startswith(marker)]
        return re.sub(r"(?<![\w.])[A-Za-z_]\w*", "x", "\n".join(kept))

    return read


def json_document(text: str, _: Path) -> str:
    """The law that creepkit reads from it, at a point."""
    from creepkit.exporters.law_files import read_valued_law

    source = read_valued_law(text)
    if json.loads(text)["law"]["name"] != source.law.name:
        raise BrokenTextError("the name differs")
    given = {"temperature": 1050.0, "w": 0.1} if source.law.states else {}
    from creepkit.kernels.lowering import lower

    return repr(float(lower(source.law).rate(source.values, stress=100.0, **given)))


def xhtml(text: str, _: Path) -> str:
    """The kinds of its elements, with their attributes."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BrokenTextError(str(error)) from None
    return " ".join(sorted({f"{e.tag.rpartition('}')[2]}{sorted(e.attrib)}" for e in root.iter()}))


def latex(text: str, _: Path) -> str:
    """Its commands beside those that stand for characters, whether its groups close, and how many cells it has."""
    code = "\n".join(re.sub(r"(?<!\\)%.*", "", line) for line in re.split(r"[\r\n]", text))
    plain = re.sub(r"\\(textbackslash|textasciicircum|textasciitilde)\{\}|\\[{}$&#%_,]", "", code)
    commands = re.findall(r"\\(?:[A-Za-z@]+|.)", plain)
    closes = plain.count("{") == plain.count("}") and plain.count("$") % 2 == 0
    return f"{sorted({*commands})} {closes} {plain.count('^^')} {plain.count('&')}"


def markdown(text: str, _: Path) -> str:
    """The kinds of what a reader of Markdown makes of it, HTML allowed."""
    from markdown_it import MarkdownIt

    tokens = MarkdownIt("commonmark", {"html": True}).enable("table").parse(text)
    kinds = {kind for token in tokens for kind in (token.type, *(child.type for child in token.children or ()))}
    cells = [token.type for token in tokens].count("td_open")
    return f"{sorted(kinds - {'text_special', 'entity'})} {cells}"


DRIVEN: dict[str, tuple[tuple[str, Callable[[str, Path], str]], ...]] = {
    "latex": (("", latex),),
    "python": (("", python),),
    "numpy": (("", python),),
    "json": (("", json_document),),
    "abaqus": (("gfortran", preprocessed_fortran),),
    "calculix": (("gfortran", fortran),),
    "c": (("gcc", c), ("g++", cpp)),
    "javascript": (("node", javascript),),
    "mfront": (("g++", mfront),),
    "markdown": (("", markdown),),
    "mathml": (("", xhtml),),
    "abaqus-cards": (("", lines_of_code("**")),),
    "ansys": (("", lines_of_code("!")),),
    "moose": (("", lines_of_code("#")),),
    "neml2": (("", lines_of_code("#")),),
    "code_aster": (("", code_aster),),
}
"""{exporter: (program needed or "", what comes of a text)}."""


def seen(exporter: str, text: str, folder: Path) -> tuple[str, ...]:
    """What every way of using a text gives; BrokenTextError where one fails."""
    ways = [way for needed, way in DRIVEN[exporter] if not needed or shutil.which(needed)]
    return tuple(way(text, folder) for way in ways)


def judged_text(exporter: str, text: str, expected: tuple[str, ...], folder: Path) -> tuple[str, str]:
    """Outcome and detail: executed, broken, or harmless where all numbers are those of the law with plain words."""
    try:
        found = seen(exporter, text, folder)
    except BrokenTextError as error:
        found, problem = None, str(error)
    except (CreepkitError, ValueError, AttributeError, TypeError) as error:
        found, problem = None, f"{type(error).__name__}: {error}"
    if (folder / CANARY).exists():
        return "executed", ""
    if found is None:
        return "broken", problem
    return ("harmless", "") if found == expected else ("broken", f"differs: {str(found)[:300]}")
