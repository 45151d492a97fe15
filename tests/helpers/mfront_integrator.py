"""The block @Integrator of an exported MFront file, taken from its text and compiled on its own."""

import ctypes
import re
from pathlib import Path

import numpy as np

from creepkit.exporters.mfront import MfrontExporter
from creepkit.language import Elastic
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues, Units
from helpers.compilers import shared_library
from helpers.export_cases import renamed

STUB = Path(__file__).with_name("tfel_stub.hxx")
STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-O0")
ELASTIC = Elastic(150e3, 0.3)


def exported(law, values=None, **more):
    return MfrontExporter().text(LawWithValues(law, values or law.center(), **more))


def section(text, title):
    """The lines of @Integrator under one of its titles."""
    block = re.search(rf"  // ---- {re.escape(title)}\n((?:  (?!// ----).*\n)*)", text)
    return block[1] if block else ""


def declared(text, keyword):
    """{name: the rest} of the declarations by one keyword."""
    return dict(re.findall(rf"^@{keyword} (?:\w+ )?(\w+)(?: = (.+?))?;", text, re.MULTILINE))


def compile_cpp(gxx, folder, code):
    """C++ as a library, without a warning."""
    source = folder / "block.cpp"
    source.write_text(code, encoding="utf-8")
    return shared_library([gxx, *STRICT, source], folder / "block.so")[0]


COLUMNS = {"stress": 0, "strain": 1, "principal": 4, "mean": 5}


def scalar_function(name, law, text):
    """The law's statements as the file has them, in a function of the point; and where each output stands."""
    other = renamed(text)
    own = [other.get(s.name, s.name) for s in law.states]
    point = [f"{s.name}_now" for s in (*POINT_VARIABLES, *law.states)]
    inputs = [f"const real {word} = point__[{k}]; (void){word};" for k, word in enumerate(point)]
    constants = [f"const real {word} = {value};" for word, value in declared(text, "Parameter").items()]
    body = section(text, "stable functions") + section(text, "the law")
    columns = COLUMNS | {state: len(POINT_VARIABLES) + k for k, state in enumerate(own)}
    width, outputs = len(POINT_VARIABLES) + len(own), []
    for row, rate in enumerate(["rate", *(f"{state}_rate" for state in own)]):
        outputs.append(f"found__[{row * (1 + width)}] = {rate};")
        for label, column in columns.items():
            if f"const real {rate}_by_{label} =" in body:
                outputs.append(f"found__[{row * (1 + width) + 1 + column}] = {rate}_by_{label};")
    lines = "\n".join([*inputs, *constants, body, *outputs])
    return f'extern "C" void {name}(const double *point__, double *found__) {{\n{lines}\n}}\n'


class Block:
    """@Integrator of a file, compiled with the stub: residuals and Jacobian in deel (6), dp and internal variables."""

    def __init__(self, gxx, folder, law, values=None, units=None):
        text = exported(law, values, elastic=ELASTIC, units=units or Units())
        self.states = [*declared(text, "StateVariable")][1:]
        self.size = 7 + len(self.states)
        self.modulus = ELASTIC.E / (units or Units()).megapascals
        self._library = compile_cpp(gxx, folder, self._class(text))
        self._library.ended.argtypes = [ctypes.c_int, *[ctypes.c_double] * 3]

    def _class(self, text):
        members = [f"real {name} = {value};" for name, value in declared(text, "Parameter").items()]
        members += [f"real {s}, d{s}, f{s};" for s in (*self.states, "p")] + ["real elapsed;"]
        scalars = ["p", *self.states]
        blocks = [f"df{a}_dd{b}" for a in scalars for b in scalars]
        members += [f"Stensor df{s}_ddeel, dfeel_dd{s};" for s in scalars] + [f"real {b};" for b in blocks]
        integrator, convergence, increment = (
            re.search(rf"^@{keyword} \{{\n(.*?)^\}}", text, re.MULTILINE | re.DOTALL)[1]
            for keyword in ("Integrator", "AdditionalConvergenceChecks", "APosterioriTimeStepScalingFactor")
        )
        starts = [f"{s} = state[{k}]; d{s} = unknown[{6 + k}]; f{s} = d{s};" for k, s in enumerate(scalars)]
        starts += [f"df{a}_dd{b} = {float(a == b)};" for a in scalars for b in scalars]
        outs = [f"residual[{6 + k}] = f{s};" for k, s in enumerate(scalars)]
        outs += [
            f"jacobian[{6 + i}][{6 + j}] = df{a}_dd{b};" for i, a in enumerate(scalars) for j, b in enumerate(scalars)
        ]
        for k, s in enumerate(scalars):
            outs += [f"for (int i = 0; i != 6; ++i) jacobian[{6 + k}][i] = df{s}_ddeel(i);"]
            outs += [f"for (int i = 0; i != 6; ++i) jacobian[i][{6 + k}] = dfeel_dd{s}(i);"]
        return "\n".join(
            [
                f'#include "{STUB}"',
                "struct Behaviour : BehaviourData {",
                *members,
                f"void integrator() {{\n{integrator}}}",
                f"bool ended(double error) {{\nbool converged = error < 1e-14;\n{convergence}return converged;\n}}",
                f"pair<bool, real> increment() {{\n{increment}return {{true, 1.0}};\n}}",
                "void run(const double *state, const double *unknown, double *residual, double (*jacobian)"
                f"[{self.size}]) {{",
                *starts,
                "integrator();",
                *outs,
                "}",
                "};",
                'extern "C" void integrate(const double *state, const double *given, const double *unknown,'
                f" double *residual, double (*jacobian)[{self.size}]) {{",
                "Behaviour b{}; b.start(given, unknown); b.elapsed = given[18];",
                "b.run(state, unknown, residual, jacobian); b.finish(residual);",
                "for (int i = 0; i != 6; ++i) for (int j = 0; j != 6; ++j) jacobian[i][j] = b.dfeel_ddeel(i, j);",
                "}",
                'extern "C" bool ended(int iter, double error, double size, double change) {',
                "Behaviour b{}; b.iter = iter; b.zeros = size; b.delta_zeros = change; return b.ended(error);",
                "}",
                'extern "C" bool kept(const double *state, const double *given, const double *unknown) {',
                "Behaviour b{}; b.start(given, unknown);",
                *(f"b.{s} = state[{k}] + unknown[{6 + k}]; b.d{s} = unknown[{6 + k}];" for k, s in enumerate(scalars)),
                "return b.increment().first;",
                "}",
            ]
        )

    def __call__(self, unknown, eel, state, dt, deto=None, theta=0.5, T=1000.0, elapsed=0.0):
        """Residuals and Jacobian at an estimate of the increments."""
        given = [*eel, *(np.zeros(6) if deto is None else deto), self.modulus, 0.3, theta, dt, T, 0.0, elapsed]
        residual, jacobian = (ctypes.c_double * self.size)(), (ctypes.c_double * self.size**2)()
        self._packed = [(ctypes.c_double * len(v))(*v) for v in (state, given, unknown)]
        self._library.integrate(*self._packed, residual, jacobian)
        return np.array(residual), np.reshape(jacobian, (self.size, self.size))

    def step(self, eel, state, dt, guess=0.0, **more):
        """Newton's method for one increment: eel, state and how many iterations it took; None if it is given back."""
        unknown, change = np.zeros(self.size), np.inf
        unknown[6] = guess
        for iteration in range(100):
            residual, jacobian = self(unknown, eel, state, dt, **more)
            error = np.linalg.norm(residual) / self.size
            if self._library.ended(iteration, error, np.linalg.norm(unknown), change):
                kept = self._library.kept(*self._packed)
                return (eel + unknown[:6], state + unknown[6:], iteration) if kept else None
            correction = np.linalg.solve(jacobian, residual)
            unknown, change = unknown - correction, np.linalg.norm(correction)
        raise AssertionError("no convergence in the iterations that the file allows")
