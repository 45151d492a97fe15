"""The integrators, each once."""

from .batch_integration import Integration as Integration
from .batch_integration import PointTest as PointTest
from .batch_integration import integrate as integrate
from .core_structures import REASONS as REASONS
from .core_structures import IntegrationSettings as IntegrationSettings
from .fibre_integration import FibreHistory as FibreHistory
from .fibre_integration import FibreTest as FibreTest
from .fibre_integration import integrate_fibres as integrate_fibres
from .fibre_model import FibreInput as FibreInput
from .fibre_model import FibreModel as FibreModel
from .fibre_model import gauss_fibres as gauss_fibres
from .fibre_model import gauss_points as gauss_points
