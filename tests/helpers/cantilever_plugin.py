"""A plugin of one file: a cantilever in steady creep by Norton's law, in closed form.

The curvature of a section is (M / I)^n A with I = b h^(2 + 1/n) / (2^(1 + 1/n) (2 + 1/n)); integrated twice, the end
moves by A (F / I)^n L^(n + 2) / (n + 2) a second (Boyle and Spence, Stress Analysis for Creep, 1983, chapter 3).
"""

from dataclasses import dataclass

import creepkit as ck


@dataclass(frozen=True)
class Cantilever(ck.PerTest):
    """A cantilever of rectangular section under a force at its end."""

    name = "test-cantilever"
    title = "Cantilever in steady creep"
    outputs = (ck.Output("end_deflection", "length", "deflection of the end", noise=0.002),)
    loads = (ck.Load("end_force", "force"),)
    conditions = {"end_force": (5.0, 20.0)}  # noqa: RUF012

    span: float = ck.dimension(50.0, (10.0, 200.0))
    breadth: float = ck.dimension(10.0, (1.0, 50.0), tolerance=0.005)
    height: float = ck.dimension(2.0, (0.2, 20.0), tolerance=0.01)

    def reference_stress(self, history):
        """MPa, of each force: that of the root, less a third."""
        loads = history.loading.program().values
        return 4.0 * self.span * loads[loads > 0] / (self.breadth * self.height**2)

    def growth_per_strain(self, history):
        """mm of deflection for a unit of strain at the surface of the root."""
        return 0.5 * self.span**2 / self.height

    def one(self, law, values, history, nuisances):
        """The deflection of the end, mm."""
        A, n = values["A"], values["n"]
        section = self.breadth * self.height ** (2 + 1 / n) / (2 ** (1 + 1 / n) * (2 + 1 / n))
        force = history.loading.program().values[-1]
        rate = A * (force / section) ** n * self.span ** (n + 2) / (n + 2)
        return {"end_deflection": rate * history.times}


@ck.hookimpl
def creepkit_specimens():
    """The cantilever."""
    return [Cantilever()]
