"""Exported NEML2 models read by NEML2 itself: its creep rate against that of the law.

    pip install --no-deps --target FOLDER neml2==3.1.0 pyzag==2.0.0 nmhit
    PYTHONPATH=FOLDER python tests/benchmarks/neml2_model.py [--write]

NEML2 is not among the project's dependencies: install it beside the project's environment (torch 2.10 or later), in a
folder of its own. The rate is taken from the residual of one step of backward Euler at constant strain. The table gives
the largest relative difference over stresses of 20 to 200 MPa and temperatures of 950 to 1200 K.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import torch
from measured import Page, arguments
from neml2 import SR2, Model, Scalar
from neml2.factory import load_model

from creepkit.exporters.moose_neml2 import Neml2Model
from creepkit.kernels import lower
from creepkit.records import LawWithValues
from helpers.creep_form_cases import CASES, HAS, STEEL

STEP = 10.0
"""s, of the backward Euler step whose residual is evaluated."""


def neml2_rate(model: Model, stress: float, temperature: float) -> float:
    """The rate of creep strain, 1/s, from the residual of a step at constant strain: 2 G rate STEP, uniaxially."""
    zero, tension = (SR2.fill(s, 0.0, 0.0, 0.0, 0.0, 0.0) for s in (0.0, stress))
    inputs = {"stress": tension, "stress~1": tension, "E": zero, "E~1": zero}
    inputs |= {k: Scalar(torch.tensor(v)) for k, v in {"t": STEP, "t~1": 0.0, "temperature": temperature}.items()}
    (residual,) = model(*(inputs[name] for name in model.input_spec))
    return float(residual.data.detach()[..., 0]) / (STEP * STEEL.E / (1 + STEEL.nu))


def largest_difference(source: LawWithValues) -> float:
    """The largest relative difference over stresses and temperatures."""
    kernel = lower(source.law, "numpy")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.i"
        path.write_text(Neml2Model().text(source.replace(elastic=STEEL)))
        model = load_model(str(path), "implicit_rate")
        points = [(s, T) for s in (20.0, 80.0, 200.0) for T in (950.0, 1073.15, 1200.0)]
        pairs = [(neml2_rate(model, s, T), kernel.rate(source.values, stress=s, temperature=T)) for s, T in points]
    return max(abs(theirs / float(own) - 1) for theirs, own in pairs)


def main() -> None:
    options = arguments(__doc__).parse_args()
    torch.set_default_dtype(torch.float64)
    page = Page("neml2_model", __doc__)
    page.table("law", "largest relative difference of the creep rate")
    for case in sorted(HAS["neml2"]):
        page.row(case, f"{largest_difference(CASES[case]):.1e}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
