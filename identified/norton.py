"""A creep law with its values, exported by creepkit."""

# norton: Norton power law (PL)
#
# rate = A*stress**n    [power law]
#
# Stress in MPa, time in s, rates in 1/s. stress is a ratio to 1 MPa, time to 1 s, rates are per s.
# Parameters, for stress as a ratio to 1 MPa and time to 1 s:
#   A = 1.4694986238582108e-15 1/s, rate coefficient
#   n = 4.9129811009282145, stress exponent
# Stress, strain and internal variables that are bases of powers act as 1e-30 below it, time as 1e-120.
# Note: identified with creepkit 0.1.0 from 1 test
# Note: A = 1.4694986e-15 1/s, 95 % interval 4.334e-16 to 4.983e-15, determined
# Note: n = 4.9129811, 95 % interval 4.678 to 5.148, determined
# Note: valid within the tests: stress 0.08901 to 87.62 MPa, temperature 1050 to 1050 K, strain 0 to 0.003794, time 12.24 to 592.2 s
# Note: relative squared error of amplitude 0.000354; relative squared error of width 0.101; relative squared error of shape 1.38; rates of single tests scatter by 30 % (one sd)
# Note: the law explains the tests to their stated noise, with rates of tests that scatter by 30 %: reduced chi-square 0.708, p = 1
# Note: fewer than 3 tests: their rates are assumed to scatter by 30 %
# Note: at the optimum bulge differs from bulge on a finer mesh by 8e-05 mm in amplitude, 0.0015 mm in width, 0.00085 in shape (rms; at most 0.061 noises); this is corrected, and would have moved values by up to 0.081 of their standard deviations
# Note: intervals take for granted what no nuisance parameter models; the rate at the reference would change: by a thickness of 0.01 mm 20 %
# Source: Norton (1929), The Creep of Steel at High Temperatures
# A result beyond 1.8e308 raises OverflowError.

from math import exp, inf, log


def log_floor(x, floor):
    """ln max(x, floor)."""
    return log(floor if x < floor else x)


def rate(
    stress,
    *,
    strain=None,
    time=None,
    temperature=None,
    A=1.4694986238582108e-15,
    n=4.9129811009282145,
):
    """Rate of equivalent creep strain, 1/s.

    stress : von Mises stress, MPa
    strain, time, temperature : not used by this law
    """
    ln_A = log(A) if A != 0.0 else -inf
    # power law
    return exp(ln_A + n*log_floor(stress, 1e-30))
