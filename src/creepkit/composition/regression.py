"""A property of alloys as a function of their composition: Gaussian process regression and a sparse polynomial.

With x the contents (sum of x = 1) a property of an alloy is

    y = f(x) + u + e

where u is what differs between alloys of one composition, and e the error of the identified value, whose standard
deviation is known of each alloy. f is a Gaussian process whose covariance has three parts: x'x, a mixture rule;
(x'x)^2, with it Scheffe's polynomial of pairs of elements (Scheffe (1958), J. R. Stat. Soc. B 20, 344), which on the
simplex has all squares in it; and Matern's of smoothness 5/2 for the rest. The sizes of the parts, of u and the length
are those of greatest posterior, the marginal likelihood (Rasmussen and Williams (2006), Gaussian Processes for Machine
Learning, eq. 5.9) times a wide prior; values of an alloy left out have a closed form (eq. 5.12 there).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import sympy
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from creepkit.arrays import Floats
from creepkit.errors import FitError

FEWEST_ALLOYS = 8
"""From which on a property is regressed over compositions."""


LEAST_SD = 1e-3
"""Of an error, over the standard deviation of the values: below it covariances are singular to rounding."""


SIZES = {
    "rule": (2.0, 2.0), "pairs": (1.0, 2.0), "rest": (0.05, 2.0), "length": (0.4, 0.5), "scatter": (0.02, 1.2)
}  # fmt: skip
"""{hyperparameter: median and standard deviation of the ln of its prior}: variances over that of the values, and the
length of Matern's part, a distance of contents. Without a prior the scatter between alloys vanishes in one of three
sets of 50, and predictions are too sure."""


BOUNDS = (1e-6, 1e4)
"""Of all of them."""


@dataclass(frozen=True, eq=False)
class CompositionRegression:
    """A property of alloys over their compositions.

    contents : (alloys, elements) atomic fractions. values, sd : (alloys,) identified values and their standard
    deviations, in the unit of the property. kernel : of scikit-learn, with its sizes found, of values over `scale`.
    mean, scale : of the values, by which they are standardised. alloys : their names, where they are known.
    """

    elements: tuple[str, ...]
    contents: Floats
    values: Floats
    sd: Floats
    kernel: object
    mean: float
    scale: float
    alloys: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, elements: Sequence[str], contents: Floats, values: Floats, sd: Floats, alloys: Sequence[str] = ()
    ) -> CompositionRegression:
        """That of values; FitError where there are too few alloys.

        contents : (alloys, elements) atomic fractions. values, sd : (alloys,) in the unit of the property. alloys :
        their names.
        """
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel

        if len(values) < FEWEST_ALLOYS:
            raise FitError(f"{len(values)} alloys have a law and a composition; {FEWEST_ALLOYS} are needed at least")
        weight = 1.0 / (sd**2 + np.var(values))
        mean, scale = float(np.average(values, weights=weight)), max(float(np.std(values)), 1e-12)
        rule, pairs, rest, length, scatter = (median for median, _ in SIZES.values())
        product = DotProduct(sigma_0=0.0, sigma_0_bounds="fixed")
        kernel = (
            ConstantKernel(rule, BOUNDS) * product
            + ConstantKernel(pairs, BOUNDS) * product**2
            + ConstantKernel(rest, BOUNDS) * Matern(length, BOUNDS, nu=2.5)
            + WhiteKernel(scatter, BOUNDS)
        )
        process = GaussianProcessRegressor(
            kernel, alpha=np.maximum(sd / scale, LEAST_SD) ** 2, optimizer=_greatest_posterior
        ).fit(contents, (values - mean) / scale)
        return cls(tuple(elements), contents, values, sd, process.kernel_, mean, scale, tuple(alloys))

    @property
    def scatter(self) -> float:
        """Standard deviation of u, between alloys of one composition, in the unit of the property."""
        return float(np.sqrt(self.kernel.k2.noise_level)) * self.scale  # type: ignore[attr-defined]

    @cached_property
    def _covariance(self) -> Floats:
        """(alloys, alloys) of the standardised values."""
        errors = np.maximum(self.sd / self.scale, LEAST_SD) ** 2
        return np.asarray(self.kernel(self.contents) + np.diag(errors))  # type: ignore[operator]

    @cached_property
    def _standardised(self) -> Floats:
        return (self.values - self.mean) / self.scale

    def predict(self, contents: Floats, *, of_alloy: bool = True) -> tuple[Floats, Floats]:
        """Value and standard deviation (points,) each at contents (points, elements), in the unit of the property.

        of_alloy : of one alloy of that composition; else of the mean of such alloys.
        """
        factor = cho_factor(self._covariance)
        across = np.asarray(self.kernel(contents, self.contents))  # type: ignore[operator]
        own = np.asarray(self.kernel.diag(contents))  # type: ignore[attr-defined]
        variance = own - np.einsum("pa,ap->p", across, cho_solve(factor, across.T))
        variance -= 0.0 if of_alloy else (self.scatter / self.scale) ** 2
        value = self.mean + self.scale * across @ cho_solve(factor, self._standardised)
        return np.asarray(value), self.scale * np.sqrt(np.maximum(variance, 0.0))

    @cached_property
    def left_out(self) -> tuple[Floats, Floats]:
        """What the others say of each alloy (alloys,): value, and standard deviation of the alloy's true one."""
        inverse = np.linalg.inv(self._covariance)
        variance = 1.0 / np.diag(inverse)
        value = self._standardised - variance * (inverse @ self._standardised)
        of_truth = variance - np.maximum(self.sd / self.scale, LEAST_SD) ** 2
        return self.mean + self.scale * value, self.scale * np.sqrt(np.maximum(of_truth, 0.0))

    @property
    def left_out_error(self) -> float:
        """Root mean square of the values less what the other alloys say, in the unit of the property."""
        return float(np.sqrt(np.mean((self.values - self.left_out[0]) ** 2)))

    @property
    def left_out_coverage(self) -> float:
        """Share of the values within the 95 % intervals of what the other alloys say, errors of the values included."""
        value, sd = self.left_out
        return float(np.mean(np.abs(self.values - value) <= 1.96 * np.hypot(sd, self.sd)))

    @cached_property
    def shared(self) -> tuple[Floats, Floats, Floats]:
        """Each alloy's value by its own tests and by the other alloys: (alloys,) value, its sd, and weight of others.

        Both are normal, so that the value is their mean by inverse variances: where tests determine it, it stays.
        """
        (others, others_sd), own = self.left_out, np.maximum(self.sd, LEAST_SD * self.scale) ** 2
        variance = np.maximum(others_sd, LEAST_SD * self.scale) ** 2
        share = own / (own + variance)
        return share * others + (1.0 - share) * self.values, np.sqrt(share * variance), share

    @cached_property
    def formula(self) -> sympy.Expr:
        """The sparse polynomial: a sum over elements, and over those pairs that the values ask for.

        Symbols are x_Ni and so on, atomic fractions. Pairs are added one by one, by generalised least squares, while
        the BIC falls; the variance of a value is that of its error and of u.
        """
        weight = 1.0 / np.sqrt(self.sd**2 + max(self.scatter, LEAST_SD * self.scale) ** 2)
        names = [sympy.Symbol(f"x_{element}", nonnegative=True) for element in self.elements]
        columns: dict[tuple[int, ...], Floats] = {(k,): self.contents[:, k] for k in range(len(names))}
        pairs: dict[tuple[int, ...], Floats] = {
            (j, k): self.contents[:, j] * self.contents[:, k] for j, k in combinations(range(len(names)), 2)
        }

        def bic(terms: dict[tuple[int, ...], Floats]) -> tuple[float, Floats]:
            design = np.column_stack([*terms.values()]) * weight[:, None]
            found = np.linalg.lstsq(design, self.values * weight)[0]
            chi_square = float(((self.values * weight - design @ found) ** 2).sum())
            return chi_square + len(terms) * float(np.log(len(self.values))), np.asarray(found)

        best, coefficients = bic(columns)
        while pairs and len(columns) < len(self.values) // 2:
            tried = {pair: bic({**columns, pair: column})[0] for pair, column in pairs.items()}
            pair = min(tried, key=lambda one: tried[one])
            if tried[pair] >= best:
                break
            columns[pair] = pairs.pop(pair)
            best, coefficients = bic(columns)
        products = [sympy.Mul(*(names[k] for k in term)) for term in columns]
        return sympy.Add(*(float(f"{c:.4g}") * p for c, p in zip(coefficients, products, strict=True)))


def _greatest_posterior(
    loss: Callable[[Floats], tuple[float, Floats]], start: Floats, bounds: Floats
) -> tuple[Floats, float]:
    """The ln of the hyperparameters (n,) of greatest posterior, and -ln of it, as scikit-learn asks for them.

    loss : -ln of the marginal likelihood and its gradient. start : (n,) medians of the prior. bounds : (n, 2).
    """
    sd = np.array([sd for _, sd in SIZES.values()])

    def posterior(x: Floats) -> tuple[float, Floats]:
        value, slope = loss(x)
        return value + 0.5 * float((((x - start) / sd) ** 2).sum()), slope + (x - start) / sd**2

    found = minimize(posterior, start, jac=True, bounds=bounds, method="L-BFGS-B")
    return found.x, float(found.fun)
