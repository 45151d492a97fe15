"""A cantilever in steady creep as a specimen that states everything of itself; a plugin file, too."""

from dataclasses import dataclass

import numpy as np

import creepkit as ck

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Cantilever(ck.PerTest):
    """A cantilever of rectangular section under a force at its end, in steady creep by Norton's law.

    The curvature of a section is (M / I)^n A with I = b h^(2 + 1/n) / (2^(1 + 1/n) (2 + 1/n)); integrated twice, the
    end moves by A (F / I)^n L^(n + 2) / (n + 2) a second.
    """

    name = "cantilever"
    title = "Cantilever in steady creep"
    outputs = (ck.Output("deflection", "length", noise=0.002),)
    loads = (ck.Load("force", "force"),)
    conditions = {"force": (5.0, 20.0)}  # noqa: RUF012
    span: float = ck.dimension(50.0, (10.0, 200.0))
    breadth: float = ck.dimension(10.0)
    height: float = ck.dimension(2.0, tolerance=0.01)

    def reference_stress(self, history):
        """0.7 of the elastic stress at the root's surface: (2 n + 1)/(3 n) of it in steady creep."""
        forces = np.unique(history.loading.program().values)
        return 0.7 * 6.0 * forces[forces > 0] * self.span / (self.breadth * self.height**2)

    def growth_per_strain(self, history):
        """2 L^2/((n + 2) h) mm of deflection for each unit of strain at the root's surface, at n = 4."""
        return self.span**2 / (3.0 * self.height)

    def one(self, law, values, history, nuisances):
        """The deflection, from the integral of F^n over time."""
        A, n = values["A"], values["n"]
        section = self.breadth * self.height ** (2 + 1 / n) / (2 ** (1 + 1 / n) * (2 + 1 / n))
        knots = np.union1d(history.loading.program().times, np.concatenate([[0.0], history.times]))
        durations = np.diff(knots)
        places = knots[:-1, None] + 0.5 * durations[:, None] * (1 + NODES)
        parts = 0.5 * durations * (history.loading.program().at(places) ** n @ WEIGHTS)
        integral = np.concatenate([[0.0], np.cumsum(parts)])[np.searchsorted(knots, history.times)]
        return {"deflection": A * section**-n * self.span ** (n + 2) / (n + 2) * integral}


@ck.hookimpl
def creepkit_specimens():
    return [Cantilever()]
