"""A predictor in the place of a surrogate: bars themselves, but for laws that it does not know."""

from dataclasses import dataclass

import creepkit as ck
from creepkit.records import Predictor, Status, unpredicted

BARS = ck.specimen("uniaxial")


@dataclass(frozen=True)
class Narrow(Predictor):
    """Knows all laws but those named in `unknown`, of which it predicts nothing."""

    unknown: tuple[str, ...] = ("norton",)
    name: str = "narrow"
    outputs: tuple[str, ...] = ("strain",)

    specimen = BARS

    def outside_class(self, law: ck.CreepLaw) -> str:
        return f"law '{law.name}' is none of its laws" if law.name in self.unknown else ""

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        if self.outside_class(law):
            return unpredicted(histories, self.outputs, len(theta), Status.OUTSIDE_CLASS, self.outside_class(law))
        return BARS.predict(law, theta, histories, sensitivities=sensitivities)
