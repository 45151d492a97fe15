import numpy as np

import creepkit


def test_strain_is_logarithmic_in_time_at_constant_stress() -> None:
    """The kernel's rate at strain e_0 ln(1 + a t / e_0) is that strain's derivative, a / (1 + a t / e_0)."""
    A, n, e_0, stress = 3e-12, 3.0, 2e-3, 80.0
    a, time = A * stress**n, np.geomspace(1.0, 1e6, 25)
    strain = e_0 * np.log1p(a * time / e_0)

    kernel = creepkit.lower(creepkit.law("logarithmic"), "numpy")
    rate = kernel.rate({"A": A, "n": n, "e_0": e_0}, stress=stress, strain=strain)

    np.testing.assert_allclose(rate, a / (1 + a * time / e_0), rtol=1e-12)
