"""creepkit: a creep law is written once, as symbols; kernels, simulation, identification and exports follow from it.

Names load their modules when they are first used, so `import creepkit` itself is quick.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit import errors as errors
    from creepkit.inverse.search.evolution import CmaEs as CmaEs
    from creepkit.inverse.search.multistart import MultiStart as MultiStart
    from creepkit.inverse.search.swarm import ParticleSwarm as ParticleSwarm
    from creepkit.inverse.sparsity.penalties import L2 as L2
    from creepkit.inverse.sparsity.penalties import GroupL2 as GroupL2
    from creepkit.inverse.sparsity.penalties import Sqrt as Sqrt
    from creepkit.inverse.sparsity.penalties import Subsets as Subsets
    from creepkit.kernels import lower as lower
    from creepkit.language import CreepLaw as CreepLaw
    from creepkit.language import Elastic as Elastic
    from creepkit.language import Param as Param
    from creepkit.language import State as State
    from creepkit.language import activated as activated
    from creepkit.language import arrhenius as arrhenius
    from creepkit.language import exponential as exponential
    from creepkit.language import inverse_temperature as inverse_temperature
    from creepkit.language import linear as linear
    from creepkit.language import wachtman as wachtman
    from creepkit.records import History as History
    from creepkit.records import Nuisance as Nuisance
    from creepkit.records import PointLoading as PointLoading
    from creepkit.records import PressureJump as PressureJump
    from creepkit.records import Program as Program
    from creepkit.records import StrainSteps as StrainSteps
    from creepkit.records import StressSteps as StressSteps
    from creepkit.records import Units as Units
    from creepkit.records import constant_strain as constant_strain
    from creepkit.records import constant_stress as constant_stress
    from creepkit.study import confirm as confirm
    from creepkit.study import discover as discover
    from creepkit.study import export as export
    from creepkit.study import exporters as exporters
    from creepkit.study import generate as generate
    from creepkit.study import identify as identify
    from creepkit.study import law as law
    from creepkit.study import laws as laws
    from creepkit.study import load as load
    from creepkit.study import moduli as moduli
    from creepkit.study import rank as rank
    from creepkit.study import rate_family as rate_family
    from creepkit.study import read_dataset as read_dataset
    from creepkit.study import read_histories as read_histories
    from creepkit.study import screen as screen
    from creepkit.study import select as select
    from creepkit.study import simulate as simulate
    from creepkit.study import specimen as specimen
    from creepkit.study import specimens as specimens
    from creepkit.study import surrogate as surrogate
    from creepkit.study import check_data_quality as check_data_quality
    from creepkit.study import temperature_study as temperature_study
    from creepkit.study import train as train
    from creepkit.study import exclude_suspect_frames as exclude_suspect_frames
    from creepkit.surrogate.parameter_gru import ParameterGru as ParameterGru
    from creepkit.surrogate.rate_net import RateNet as RateNet
    from creepkit.surrogate.recipe import Training as Training

    __version__: str

_HOMES = {
    "creepkit.inverse.search.evolution": "CmaEs",
    "creepkit.inverse.search.multistart": "MultiStart",
    "creepkit.inverse.search.swarm": "ParticleSwarm",
    "creepkit.inverse.sparsity.penalties": "GroupL2 L2 Sqrt Subsets",
    "creepkit.kernels": "lower",
    "creepkit.language": "CreepLaw Elastic Param State activated arrhenius exponential inverse linear wachtman",
    "creepkit.records": "History Nuisance PointLoading PressureJump Program StrainSteps StressSteps Units "
    "constant_strain constant_stress",
    "creepkit.study": "confirm discover export exporters generate identify law laws load moduli rank rate_family "
    "read_dataset read_histories screen select simulate specimen specimens surrogate suspects temperature_study train "
    "with_suspects_marked",
    "creepkit.surrogate.parameter_gru": "ParameterGru",
    "creepkit.surrogate.rate_net": "RateNet",
    "creepkit.surrogate.recipe": "Training",
}
_PUBLIC = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        value = getattr(import_module(_PUBLIC[name]), name)
    elif name == "errors":
        return import_module("creepkit.errors")
    elif name == "__version__":
        value = import_module("importlib.metadata").version("creepkit")
    else:
        raise AttributeError(f"module 'creepkit' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC, "errors", "__version__"})


class _Door(ModuleType):
    """The package as a module on which a public name stays what it is.

    Importing the package creepkit.export (or laws, specimens, inverse) would put that module in the place of the verb
    of the same name, or not, depending on who imports first.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _PUBLIC and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Door
