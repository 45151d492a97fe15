"""Texts that try to end the place they stand in and to go on as code, and laws that hold them in every text field."""

from __future__ import annotations

from dataclasses import replace

from creepkit.errors import CreepkitError
from creepkit.language import CreepLaw, Elastic, Param, State, parameters, states, stress, temperature
from creepkit.records import LawWithValues
from execution_attempts.canaries import CANARY

SHELL = f"touch {CANARY}"
_NODE = f"import('node:fs').then((fs) => fs.writeFileSync('{CANARY}', ''))"
_PYTHON = f"__import__('os').system('{SHELL}')"
_C = f'int system(const char *); __attribute__((constructor)) static void made(void) {{ system("{SHELL}"); }}'

PAYLOADS = {
    "end of a C comment": f"*/ {_C} /*",
    "end of a C comment across lines": f"*\\\n/ {_C} /*",
    "trigraphs": "what ???/",
    "start of a C comment": "x /* y",
    "line, then Fortran": f"x\n      call system('{SHELL}')",
    "line, then free Fortran": f"x & \n! & call execute_command_line('{SHELL}')",
    "carriage return": "x\r      call abort()",
    "line, then an include": f"x\n#include \"{CANARY}.h\"\n      include '{CANARY}.h'",
    "line, then C": f"x\n{_C} //",
    "line, then JavaScript": f"x\n{_NODE}; //",
    "line separator, then JavaScript": f"x\u2028{_NODE}; //",
    "template of JavaScript": f"`${{{_NODE}}}`",
    "end of a string, then JavaScript": f'"}}); {_NODE}; ({{a: "',
    "end of a comment, then JavaScript": f"*/ {_NODE}; /*",
    "line, then Python": f"x\n{_PYTHON} #",
    "end of a string, then Python": f"'); {_PYTHON} #",
    "end of a long string, then Python": f'""" + str({_PYTHON}) + """',
    "end of the other long string": f"''' + str({_PYTHON}) + '''",
    "encoding of a Python file": f"-*- coding: unicode_escape -*- \\x0a{_PYTHON} #",
    "encoding of a Python file, UTF-7": f"coding: utf-7 +AAo-{_PYTHON}+AAo-#",
    "backslash at the end": "x \\",
    "formats": "%s%n%x {0.__class__} {values} $id ${stress}",
    "templates": "{{ 7 * 7 }}{% raw %}{{ config }}<% 7 %>#{7}",
    "YAML": f"!!python/object/apply:os.system ['{SHELL}']",
    "a formula of a spreadsheet": f"=cmd|'/c {SHELL}'!A1",
    "another formula": f'@SUM(1+1)*cmd|"/c {SHELL}"!A1',
    "commands of a shell": f"$({SHELL}) `{SHELL}`; {SHELL} | {SHELL}",
    "LaTeX": f"\\immediate\\write18{{{SHELL}}} \\input{{{CANARY}}} ^^5cinput }} $ \\end{{tabular}}",
    "a script": "</title></script><script>window.harmed = 1</script><img src=x onerror='window.harmed = 1'>",
    "an attribute": "\" ' onmouseover=\"window.harmed = 1\" style='position:fixed' x=`",
    "a link": "[x](javascript:window.harmed=1) ![x](http://203.0.113.1/x) <http://203.0.113.1/y>",
    "end of XML": "]]></math></svg><x/>&bad;&#0;<!-- -->",
    "modelines": f"vim: set mp=touch : -*- eval: (shell-command \"{SHELL}\") -*-",
    "commands of APDL and Abaqus": f"x $ /SYS,{SHELL} $ \n/SYS,{SHELL}\n*INCLUDE, INPUT={CANARY}",
    "includes of HIT": f"${{raw a}} []\n!include {CANARY}\n[]",
    "directions": "a \u202e b \u2066 c \ufeff \u200f",
    "controls": "\x00\x1b[2J\x1b]0;title\x07 \x9b31m\x7f\x08\x0c\x0b",
    "an escape sequence": "\x1b]0;title\x07\x1b[2J",
    "half of a pair": "\ud800 x",
}  # fmt: skip
"""{what it tries: the text}."""

SHORT = ("end of a C comment", "encoding of a Python file", "templates")
"""The texts of the short form."""

FIELDS = (
    "name", "title", "term", "meaning", "unit", "reference", "note", "target's name", "state's meaning", "state's unit",
)  # fmt: skip
EVERYWHERE = "all that take it"
PLAIN = "plain"
VALUES = {"A": 3e-17, "n": 4.25, "Q": 1.25e5}
STRAIGHT, CURVED = "Norton's law", "a law of temperature with an internal variable"
LAWS = (STRAIGHT, CURVED)


def law_with(kind: str, texts: dict[str, str]) -> LawWithValues:
    """A law with texts in fields; one that material cards can hold, or one that only programs can.

    texts : {field: text}; the other fields hold plain words.
    """

    def text(field: str, plain: str) -> str:
        return texts.get(field, plain)

    A, n, Q = parameters("A n Q")
    (w,) = states("w")
    meaning, unit = text("meaning", "rate coefficient"), text("unit", "1/s")
    table = {A: Param(meaning, (1e-40, 1e-5), unit, "log", 0.0), n: Param(meaning, (1, 8))}
    rate, inner = A * stress**n, {}
    if kind == CURVED:
        import sympy

        table[Q] = Param(meaning, (1e3, 1e6), text("unit", "J/mol"))
        factor = sympy.exp(-Q / 8.314 * (1 / temperature - 1 / 1073.15))
        rate = rate * factor / (1 - w)
        inner = {w: State(0.0, A * stress * factor, text("state's meaning", "damage"), text("state's unit", "1"), 0.9)}
    law = CreepLaw(
        name=text("name", "plain"), terms={text("term", "creep"): rate}, params=table, states=inner,
        title=text("title", "a law"), references=(text("reference", "a paper"),),
    )  # fmt: skip
    values = {name: VALUES[name] for name in law.names}
    return LawWithValues(
        law, values, (text("note", "a note"),), elastic=Elastic(150e3, 0.3), name=texts.get("target's name", "")
    )


def takes(kind: str, field: str, text: str) -> str:
    """Nothing where a law holds this text in this field, "refused" where that is one sentence, else what was raised."""
    try:
        law_with(kind, {field: text})
    except CreepkitError:
        return "refused"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def hostile_law(kind: str, field: str, text: str) -> LawWithValues:
    """A law with a text in one field, or in all fields that take it."""
    fields = FIELDS if field == EVERYWHERE else (field,)
    return law_with(kind, {one: text for one in fields if field != EVERYWHERE or not takes(kind, one, text)})


def plain_law(kind: str, **changes: object) -> LawWithValues:
    """The same law with plain words."""
    return replace(law_with(kind, {}), **changes)  # type: ignore[arg-type]
