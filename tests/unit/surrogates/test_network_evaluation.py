"""Evaluation of the recurrent network in NumPy: torch's own cells and their derivatives, and no torch is loaded."""

import ast
import json

import numpy as np
import pytest
import torch

from creepkit.errors import CreepkitError, SurrogateError
from creepkit.surrogates.network_evaluation import FRAMES_IN_BLOCK, ParameterNetwork
from creepkit.surrogates.parameter_gru import ApplicabilityDomain
from creepkit.surrogates.parameter_network import ParameterModule, weights_of
from creepkit.surrogates.surrogate import CODEC
from helpers import source_tree

CONSTANTS, SERIES, OUTPUTS, HIDDEN, LAYERS = 4, 2, 3, 5, 3
SIZES = CONSTANTS, SERIES, OUTPUTS
FRAMES = 2 * FRAMES_IN_BLOCK + 3

pytestmark = pytest.mark.usefixtures("one_torch_thread")


def module_of(*, logarithm: bool = False) -> ParameterModule:
    """A network of torch in float64 with scales that are not trivial."""
    torch.manual_seed(0)
    module = ParameterModule(SIZES, HIDDEN, LAYERS, logarithm=logarithm).double()
    for scale in (module.constants, module.series, module.targets):
        scale.mean, scale.deviation = torch.randn_like(scale.mean), 0.5 + torch.rand_like(scale.mean)
    module.floor, module.most = torch.tensor(0.02).double(), torch.tensor(9.0).double()
    return module


def network_of(module: ParameterModule) -> ParameterNetwork:
    weights = weights_of(module.state_dict())
    return ParameterNetwork.from_weights(weights, SIZES, (HIDDEN, LAYERS), logarithm=module.logarithm)


def inputs(rows: int, tests: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return rng.normal(size=(rows, CONSTANTS)), rng.normal(size=(tests, FRAMES, SERIES))


def by_torch(module: ParameterModule, constants: torch.Tensor, series: np.ndarray):
    repeated = torch.from_numpy(np.tile(series, (len(constants) // len(series), 1, 1)))
    return module({"constants": constants, "series": repeated})


@pytest.mark.parametrize("logarithm", [False, True])
def test_values_and_derivatives_are_those_of_torch(logarithm: bool) -> None:
    module = module_of(logarithm=logarithm)
    constants, series = inputs(6, 2)
    directions = np.random.default_rng(2).normal(size=(6, 7, CONSTANTS))
    if logarithm:  # a bound that half of the outputs exceed
        median = np.median(network_of(module).outputs(constants, series)[..., 0])
        module.most = torch.tensor(np.log(median + 0.02))
    network = network_of(module)
    values, slopes = network.outputs_with_derivatives(constants, series, directions=directions)

    def along(moved: torch.Tensor) -> torch.Tensor:
        return by_torch(module, moved, series)

    point = torch.from_numpy(constants)
    assert values == pytest.approx(along(point).detach().numpy(), rel=1e-11, abs=1e-13)
    assert network.outputs(constants, series) == pytest.approx(values, rel=1e-12)
    for k in range(7):
        _, exact = torch.autograd.functional.jvp(along, point, torch.from_numpy(directions[:, k]))
        assert slopes[..., k] == pytest.approx(exact.numpy(), rel=1e-10, abs=1e-12)
    bounded = np.isclose(values[..., 0], np.exp(network.most) - network.floor, rtol=1e-13)
    assert not logarithm or (0 < bounded.mean() < 1 and (slopes[..., 0, :][bounded] == 0).all())


@pytest.mark.parametrize("logarithm", [False, True])
def test_single_precision_is_double_to_its_rounding(logarithm: bool) -> None:
    module = module_of(logarithm=logarithm)
    weights, (constants, series) = weights_of(module.state_dict()), inputs(6, 2)
    directions = np.random.default_rng(2).normal(size=(6, 4, CONSTANTS))
    single, double = (
        ParameterNetwork.from_weights(weights, SIZES, (HIDDEN, LAYERS), logarithm=logarithm, precision=precision)
        for precision in (np.float32, np.float64)
    )
    for rounded, exact in zip(
        single.outputs_with_derivatives(constants, series, directions),
        double.outputs_with_derivatives(constants, series, directions),
        strict=True,
    ):
        assert rounded.dtype == np.float64
        assert 0 < np.abs(rounded - exact).max() < 3e-6 * np.abs(exact).max()


@pytest.mark.parametrize("rows", [1, 600])
def test_batches_of_rows_are_one(rows: int) -> None:
    module = module_of()
    constants, series = inputs(2 * rows, 2)
    values = network_of(module).outputs(constants, series)
    with torch.no_grad():
        assert values == pytest.approx(by_torch(module, torch.from_numpy(constants), series).numpy(), rel=1e-10)


def test_a_coefficient_that_is_off_stands_at_zero_and_does_not_move() -> None:
    module, (constants, series) = module_of(), inputs(2, 1)
    constants[1, 0] = np.nan
    with torch.no_grad():
        exact = by_torch(module, torch.from_numpy(constants), series).numpy()
    assert network_of(module).outputs(constants, series) == pytest.approx(exact, rel=1e-11)


def test_weights_of_another_network_are_refused() -> None:
    weights = dict(weights_of(module_of().state_dict()))
    for other in ({**weights, "head.bias": np.zeros(2)}, {**weights, "more": np.zeros(1)}):
        with pytest.raises(SurrogateError, match="do not belong together"):
            ParameterNetwork.from_weights(other, SIZES, (HIDDEN, LAYERS), logarithm=False)


TRAINING = {"surrogates.parameter_network", "surrogates.training"}
"""Modules that import torch when they are imported, beside the functions of the torch target of kernels."""


def test_only_training_and_the_torch_target_import_torch() -> None:
    found = set()
    for module, path in source_tree.modules().items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = [a.name for node in tree.body if isinstance(node, ast.Import) for a in node.names]
        names += [str(node.module) for node in tree.body if isinstance(node, ast.ImportFrom)]
        if any(name.split(".")[0] == "torch" for name in names):
            found.add(module.removeprefix("creepkit."))
    assert found == {*TRAINING, "kernels.torch_functions"}


# ---- applicability domain --------------------------------------------------------------------------------------------

# The domain guard: its leave-one-out distances, boxes, combinations that never occurred, and its document.


def mahalanobis(row: np.ndarray, others: np.ndarray) -> float:
    apart = row - others.mean(axis=0)
    return float(np.sqrt(apart @ np.linalg.solve(np.cov(others, rowvar=False), apart)))


def test_the_limit_is_the_largest_distance_of_a_row_from_all_others() -> None:
    rows = np.random.default_rng(0).normal(size=(30, 3)) * [1.0, 100.0, 1e-3]
    brute = max(mahalanobis(row, np.delete(rows, k, axis=0)) for k, row in enumerate(rows))
    assert ApplicabilityDomain.from_rows("abc", rows).limit == pytest.approx(brute, rel=1e-9)


def test_one_input_beyond_its_range_is_outside() -> None:
    domain = ApplicabilityDomain.from_rows(
        ("log10 A", "n"), np.random.default_rng(2).uniform(size=(100, 2)) * [10, 1] + [-20, 3]
    )
    assert domain.outside(np.array([[-15.0, 4.2], [-15.0, 3.5]])).tolist() == [True, False]


def test_a_combination_that_never_occurred_is_outside_though_each_input_is_within_its_range() -> None:
    n = np.linspace(2.0, 8.0, 60)
    rows = np.stack([-7.0 - 2.0 * n + 0.3 * np.random.default_rng(3).normal(size=60), n], axis=1)
    domain = ApplicabilityDomain.from_rows(("log10 A", "n"), rows)
    odd = np.array([-11.0, 7.5])
    assert (domain.low < odd).all()
    assert (odd < domain.high).all()
    assert domain.outside(odd)
    assert not domain.outside(np.array([-7.0 - 2.0 * 5.0, 5.0]))


def test_the_document_is_json_and_gives_the_same_distances() -> None:
    rows = np.random.default_rng(5).normal(size=(40, 4))
    domain = ApplicabilityDomain.from_rows("abcd", rows)
    again = CODEC.from_json(ApplicabilityDomain, json.loads(json.dumps(CODEC.to_json(domain))))
    assert np.array_equal(again.distance(rows), domain.distance(rows))


def test_a_damaged_document_says_so() -> None:
    document = CODEC.to_json(ApplicabilityDomain.from_rows("ab", np.random.default_rng(6).normal(size=(9, 2))))
    for changes, message in (
        ({"low": [0.0]}, "its arrays do not belong to 2 inputs"),
        ({"mean": "x"}, "mean is 'x'; allowed is a list"),
        ({"names": None}, "names is null; allowed is a list"),
        ({"whitening": [[1.0, 0.0]]}, "its arrays do not belong to 2 inputs"),
        ({"whitening": [[1.0], 0.0]}, "whitening.1 is 0.0; allowed is a list"),
        ({"limits": 1.0}, "unknown key 'limits'; did you mean 'limit'"),
    ):
        with pytest.raises(CreepkitError, match=message):
            CODEC.from_json(ApplicabilityDomain, {**document, **changes})
