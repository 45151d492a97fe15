"""The stress update of a creep law over one increment of strain, with its consistent tangent: an algorithm, once.

This text is what exporters print as C and as Fortran (algorithm_printers.py): loops over numbers and arrays of fixed
size, no more of Python than those languages have. `law` and `moduli`, and the numbers in capitals, are put in for each
law. Stress is in MPa, time in s, and tensors are six components 11, 22, 33, 12, 13, 23; those of strains that come in,
and the tangent, have engineering shear strains, those inside half of that.

Elasticity is isotropic and creep flows along the deviator of stress. With elastic strain deviator e (e^2 = 2/3 e:e,
what the strain at a time less the creep strain so far gives), rate r and shear modulus G, backward Euler over h is
    D = h r(q, p + D, t, T, s_1, s_m, w),  w = w_0 + h w'(...),  q = 3 G (e - D),  creep strain + D e_ij/e:
the deviator stays parallel to e, so that the direction is known, the mean stress s_m does not change with D, and the
largest principal stress is s_m + 2 G e_1 (1 - D/e), with e_1 the largest principal value of e. Unknown are D and the
internal variables w alone. Newton's method works in x of D = e/(1 + exp(-x)), which keeps 0 < D < e and in which laws
are nearly straight lines, with the law's own derivatives.

Two such stages make a step of order 2, L-stable (Alexander (1977), SIAM J. Numer. Anal. 14, 1006). Steps are
increments halved as often as the estimated error asks; a virgin material begins in the time elapsed^beta, in which its
strain is a straight line. The derivatives of each stage to the increment of strain, by the implicit function theorem,
are carried along: the tangent is that of the steps that were taken.
"""

from __future__ import annotations

from math import exp, log, sqrt

from numpy import zeros

from creepkit.arrays import Floats

NS = 0
"""Internal variables of the law."""

NC = 0
"""Conditions of the material."""

NY = 1 + NS
"""Unknowns of a stage: the equivalent creep strain and the internal variables."""

NV = 6 + NY
"""What a point carries through an increment: creep strain since it began (6), then the unknowns."""

NX = 6 + NS
"""Variables of the law: stress, strain, time, temperature, largest principal and mean stress, internal variables."""

PRINCIPAL = False
"""Whether the law uses the largest principal stress."""

BETA = 1.0
"""Exponent of time in the first strain of a virgin material."""

INITIAL, LIMIT, SIDE = (0.0,), (1e308,), (1.0,)
"""Of each unknown: its start, the value at which the material has failed, and 1 where that is above the start, or -1.

The equivalent creep strain comes first, and has no limit.
"""

MPA, SECONDS = 1.0, 1.0
"""One unit of stress, in MPa, and of time, in s."""

TOLERANCE = 1e-3
"""Error of a step that is allowed, over the elastic strain and over internal variables."""

TICKS = 65536
"""The smallest steps in an increment."""

GAMMA = 0.2928932188134524
"""1 - 1/sqrt(2), of Alexander's method."""

SHAPES = {
    "x": (NX + NC,),
    "out": (NY * (1 + NX),),
    "modulus": (2,),
    "tensor": (6,),
    "dyad": (6,),
    "outside": (2, 1 + NC),
    "path": (2, 8 + NC),
    "clock": (3,),
    "place": (3,),
    "value": (NV,),
    "slope": (NV, 6),
    "base": (NV,),
    "bend": (NV, 6),
    "last": (NV,),
    "turn": (NV, 6),
    "matrix": (NY, NY),
    "right": (NY, 7),
    "dstrain": (6,),
    "stress": (6,),
    "state": (NY,),
    "tangent": (6, 6),
}
"""The shape of every array that is an argument, by its name."""


def law(x: Floats, out: Floats) -> None:
    """The law at a point x (NX + NC,): NY values and, row by row, their derivatives to x but conditions.

    out : (NY + NY NX,) ln of the rate and each internal variable's rate, 1/s, then the derivatives.
    """


def moduli(temperature: float, modulus: Floats) -> None:
    """Shear and bulk modulus, MPa, at a temperature, K, into modulus (2,)."""


def failed(k: int, number: float) -> bool:
    """Whether an unknown has reached the value at which the material has failed."""
    return SIDE[k] * (number - LIMIT[k]) >= 0.0


def held(k: int, number: float) -> float:
    """An unknown, at its limit where it has passed it."""
    return LIMIT[k] if failed(k, number) else number


def deviatoric(k: int, j: int) -> float:
    """Derivative of component k of the strain deviator to component j of strain."""
    result = 0.0
    if k == j:
        result = 1.0 if k < 3 else 0.5
    if k < 3 and j < 3:
        result = result - 1.0 / 3.0
    return result


def times(k: int) -> float:
    """How often a component occurs in its tensor."""
    return 1.0 if k < 3 else 2.0


def equivalent(tensor: Floats) -> float:
    """The equivalent strain of a deviator, tensor (6,)."""
    total = 0.0
    for k in range(6):
        total = total + times(k) * tensor[k] * tensor[k]
    return sqrt(2.0 * total / 3.0)


def largest_principal(tensor: Floats, dyad: Floats) -> float:
    """The largest principal value of tensor (6,), and its direction's dyad (6,), by Jacobi's rotations."""
    a = zeros((3, 3))
    v = zeros((3, 3))
    first: int = 0
    for k in range(3):
        a[k, k] = tensor[k]
        v[k, k] = 1.0
    a[0, 1] = tensor[3]
    a[0, 2] = tensor[4]
    a[1, 2] = tensor[5]
    a[1, 0] = a[0, 1]
    a[2, 0] = a[0, 2]
    a[2, 1] = a[1, 2]
    for _sweep in range(30):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off <= 1e-17 * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] != 0.0:
                    ratio = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                    t = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + sqrt(1.0 + ratio * ratio))
                    c = 1.0 / sqrt(1.0 + t * t)
                    s = t * c
                    for k in range(3):
                        before = a[k, p]
                        a[k, p] = c * before - s * a[k, q]
                        a[k, q] = s * before + c * a[k, q]
                    for k in range(3):
                        before = a[p, k]
                        a[p, k] = c * before - s * a[q, k]
                        a[q, k] = s * before + c * a[q, k]
                    for k in range(3):
                        before = v[k, p]
                        v[k, p] = c * before - s * v[k, q]
                        v[k, q] = s * before + c * v[k, q]
    for k in range(1, 3):
        if a[k, k] > a[first, first]:
            first = k
    for k in range(3):
        dyad[k] = v[k, first] * v[k, first]
    dyad[3] = v[0, first] * v[1, first]
    dyad[4] = v[0, first] * v[2, first]
    dyad[5] = v[1, first] * v[2, first]
    largest: float = a[first, first]
    return largest


def solve(matrix: Floats, right: Floats) -> None:
    """Gaussian elimination with pivots: right (NY, 7) becomes matrix^-1 right, of matrix (NY, NY)."""
    pivot: int = 0
    for k in range(NY):
        pivot = k
        for i in range(k + 1, NY):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        for j in range(NY):
            kept = matrix[k, j]
            matrix[k, j] = matrix[pivot, j]
            matrix[pivot, j] = kept
        for j in range(7):
            kept = right[k, j]
            right[k, j] = right[pivot, j]
            right[pivot, j] = kept
        for i in range(NY):
            if i != k:
                share = matrix[i, k] / matrix[k, k]
                for j in range(NY):
                    matrix[i, j] = matrix[i, j] - share * matrix[k, j]
                for j in range(7):
                    right[i, j] = right[i, j] - share * right[k, j]
    for k in range(NY):
        for j in range(7):
            right[k, j] = right[k, j] / matrix[k, k]


def stage(place: Floats, path: Floats, base: Floats, bend: Floats, value: Floats, slope: Floats) -> bool:
    """Backward Euler from base (NV,) to value (NV,).

    place : (3,) length of the stage, s, time of its end, s, and what share of the increment has passed there.
    path : (2, 8 + NC) elastic strain where the increment begins, a deviator and its trace, then temperature and
        conditions; in a second row what they change by.
    bend, slope : (NV, 6) derivatives of base and value to the increment of strain.

    False where Newton's method finds no solution, or one in which a variable runs backwards.
    """
    x = zeros(NX + NC)
    out = zeros(NY * (1 + NX))
    modulus = zeros(2)
    e = zeros(6)
    dyad = zeros(6)
    by_size = zeros(6)
    by_top = zeros(6)
    by_mean = zeros(6)
    de = zeros((6, 6))
    z = zeros(NY)
    matrix = zeros((NY, NY))
    right = zeros((NY, 7))
    row: int = 0
    forwards: bool = True
    # the strain less the creep strain so far, and what follows from it
    weight = place[0]
    share = place[2]
    x[2] = place[1]
    x[3] = path[0, 7] + share * path[1, 7]
    for k in range(NC):
        x[NX + k] = path[0, 8 + k] + share * path[1, 8 + k]
    moduli(x[3], modulus)
    shear = modulus[0]
    mean = modulus[1] * (path[0, 6] + share * path[1, 6])
    x[5] = mean
    for k in range(6):
        e[k] = path[0, k] + share * path[1, k] - base[k]
        for j in range(6):
            de[k, j] = share * deviatoric(k, j) - bend[k, j]
    size = max(equivalent(e), 1e-30)
    top = 0.0
    if PRINCIPAL:
        top = largest_principal(e, dyad)
    for j in range(6):
        by_mean[j] = modulus[1] * share if j < 3 else 0.0
        for k in range(6):
            by_size[j] = by_size[j] + times(k) * e[k] * de[k, j] * 2.0 / (3.0 * size)
            by_top[j] = by_top[j] + times(k) * dyad[k] * de[k, j]
    # a first guess: the rate at the stress before this stage creeps
    x[0] = 3.0 * shear * size
    x[1] = base[6]
    x[4] = mean + 2.0 * shear * top
    for k in range(1, NY):
        z[k] = base[6 + k]
        x[5 + k] = held(k, z[k])
    law(x, out)
    nothing = log(size) - 600.0
    z[0] = min(max(log(weight) + out[0] - log(size), -600.0), 50.0)
    change = 1.0
    grown = 0.0
    left = 1.0
    for _pass in range(60):
        grown = size / (1.0 + exp(-z[0]))
        left = 1.0 / (1.0 + exp(z[0]))
        if change < 1e-9:
            break
        x[0] = max(3.0 * shear * size * left, 1e-30)
        x[1] = base[6] + grown
        x[4] = mean + 2.0 * shear * top * left
        for k in range(1, NY):
            x[5 + k] = held(k, z[k])
        law(x, out)
        # row by row: the equation of ln D, then those of internal variables; derivatives at fixed D on the right
        for i in range(NY):
            row = NY + i * NX
            h = weight if i > 0 else 1.0
            by_stress = 3.0 * shear * h * out[row]
            by_strain = h * out[row + 1]
            by_first = h * out[row + 4]
            by_grown = by_strain - by_stress - 2.0 * shear * by_first * top / size
            by_both = by_first + h * out[row + 5]
            matrix[i, 0] = -by_grown * grown * left
            for k in range(1, NY):
                matrix[i, k] = 0.0 if failed(k, z[k]) else -h * out[row + 5 + k]
            for j in range(6):
                right[i, 1 + j] = by_strain * bend[6, j] + by_stress * by_size[j] + by_both * by_mean[j]
                if PRINCIPAL:
                    turned = left * by_top[j] + (1.0 - left) * top / size * by_size[j]
                    right[i, 1 + j] = right[i, 1 + j] + 2.0 * shear * by_first * turned
        right[0, 0] = max(log(weight) + out[0], nothing) - log(grown)
        matrix[0, 0] = matrix[0, 0] + left
        if log(weight) + out[0] < nothing:
            for k in range(NY):
                matrix[0, k] = 0.0
            matrix[0, 0] = 1.0
            for j in range(6):
                right[0, 1 + j] = 0.0
        for i in range(1, NY):
            right[i, 0] = base[6 + i] + weight * out[i] - z[i]
            matrix[i, i] = matrix[i, i] + 1.0
            for j in range(6):
                right[i, 1 + j] = right[i, 1 + j] + bend[6 + i, j]
            if failed(i, base[6 + i]):
                for k in range(NY):
                    matrix[i, k] = 0.0
                matrix[i, i] = 1.0
                for j in range(7):
                    right[i, j] = 0.0
        forwards = True
        for i in range(NY):
            forwards = forwards and matrix[i, i] > 0.0
        solve(matrix, right)
        change = abs(right[0, 0])
        z[0] = min(max(z[0] + right[0, 0], -600.0), 600.0)
        for k in range(1, NY):
            change = max(change, abs(right[k, 0]) / (1e-3 + abs(z[k])))
            z[k] = z[k] + right[k, 0]
    if not (forwards and change < 1e-9):
        return False
    for j in range(6):
        by_grown = grown * left * right[0, 1 + j]
        for k in range(6):
            along = (grown * (de[k, j] - e[k] * by_size[j] / size) + by_grown * e[k]) / size
            slope[k, j] = bend[k, j] + along
        slope[6, j] = bend[6, j] + by_grown
        for k in range(1, NY):
            slope[6 + k, j] = 0.0 if failed(k, z[k]) else right[k, 1 + j]
    for k in range(6):
        value[k] = base[k] + grown * e[k] / size
    value[6] = base[6] + grown
    for k in range(1, NY):
        value[6 + k] = held(k, z[k])
    return True


def put(s: float, ds: float, clock: Floats, place: Floats) -> None:
    """The place (3,) of a stage that ends at s and is ds long, shares of the increment in the time elapsed^beta.

    clock : (3,) time where the increment begins and its length, s, and beta.
    """
    share = s ** (1.0 / clock[2])
    place[0] = ds * clock[1] * share / (clock[2] * s)
    place[1] = clock[0] + clock[1] * share
    place[2] = share


def elastic_strain(share: float, path: Floats, value: Floats) -> float:
    """The equivalent elastic strain at a share of path (2, 8 + NC), with the creep strain of value (NV,)."""
    e = zeros(6)
    for k in range(6):
        e[k] = path[0, k] + share * path[1, k] - value[k]
    return equivalent(e)


def taken(
    s: float, ds: float, clock: Floats, path: Floats, value: Floats, slope: Floats, last: Floats, turn: Floats
) -> float:
    """A step of two stages from s to s + ds: its error over what is allowed, -1 without a solution.

    clock : (3,). path : (2, 8 + NC). value, last : (NV,) before and after; slope, turn : (NV, 6) their derivatives.
    """
    place = zeros(3)
    middle = zeros(NV)
    tilt = zeros((NV, 6))
    base = zeros(NV)
    bend = zeros((NV, 6))
    e = zeros(6)
    put(s + GAMMA * ds, GAMMA * ds, clock, place)
    if not stage(place, path, value, slope, middle, tilt):
        return -1.0
    ratio = (1.0 - GAMMA) / GAMMA
    for k in range(NV):
        base[k] = value[k] + ratio * (middle[k] - value[k])
        for j in range(6):
            bend[k, j] = slope[k, j] + ratio * (tilt[k, j] - slope[k, j])
    put(s + ds, GAMMA * ds, clock, place)
    if not stage(place, path, base, bend, last, turn):
        return -1.0
    # what both stages differ by, over the larger elastic strain; while there is little creep strain, over that
    for k in range(6):
        e[k] = last[k] - base[k] - middle[k] + value[k]
    before = elastic_strain(s ** (1.0 / clock[2]), path, value)
    elastic = max(before, elastic_strain(place[2], path, last))
    allowed = max(min(elastic, last[6]), 0.01 * elastic) + 1e-9
    worst = equivalent(e) / allowed
    for k in range(7, NV):
        difference = abs(last[k] - base[k] - middle[k] + value[k])
        worst = max(worst, difference / (max(abs(value[k]), abs(last[k])) + 1e-3))
    over: float = worst / TOLERANCE
    return over


def update(
    time: float, dtime: float, outside: Floats, dstrain: Floats, stress: Floats, state: Floats, tangent: Floats
) -> int:
    """The stress and the states at the end of an increment, in the place of those at its start, and the tangent.

    time, dtime : where the increment begins, and its length.
    outside : (2, 1 + NC) temperature in K and conditions, where it begins and where it ends.
    dstrain : (6,) increment of engineering strain, less thermal strain. stress : (6,).
    state : (NY,) equivalent creep strain, then internal variables less their start, so that zeros are a fresh material.
    tangent : (6, 6) derivatives of the stress to the increment of strain.

    0, or 1 where there is no solution: repeat with a shorter increment.
    """
    clock = zeros(3)
    path = zeros((2, 8 + NC))
    value = zeros(NV)
    slope = zeros((NV, 6))
    last = zeros(NV)
    turn = zeros((NV, 6))
    modulus = zeros(2)
    e = zeros(6)
    tick: int = 0
    width: int = TICKS
    ruptured: bool = False
    moduli(outside[0, 0], modulus)
    mean = MPA * (stress[0] + stress[1] + stress[2]) / 3.0
    path[0, 6] = mean / modulus[1]
    path[1, 6] = dstrain[0] + dstrain[1] + dstrain[2]
    for k in range(6):
        path[0, k] = (MPA * stress[k] - (mean if k < 3 else 0.0)) / (2.0 * modulus[0])
        for j in range(6):
            path[1, k] = path[1, k] + deviatoric(k, j) * dstrain[j]
    for k in range(1 + NC):
        path[0, 7 + k] = outside[0, k]
        path[1, 7 + k] = outside[1, k] - outside[0, k]
    for k in range(NY):
        value[6 + k] = held(k, INITIAL[k] + state[k])
    clock[0] = SECONDS * time
    clock[1] = SECONDS * dtime
    clock[2] = BETA if state[0] < 1e-8 else 1.0
    while dtime > 0.0 and tick < TICKS:
        error = taken(float(tick) / TICKS, float(width) / TICKS, clock, path, value, slope, last, turn)
        if error >= 0.0 and (error <= 1.0 or width == 1):
            for k in range(NV):
                value[k] = last[k]
                for j in range(6):
                    slope[k, j] = turn[k, j]
            tick = tick + width
            if error < 0.2 and tick % (2 * width) == 0:
                width = 2 * width
        elif width > 1:
            width = width // 2
        elif ruptured or NS == 0:
            return 1
        else:
            # no step has a solution any more: the material ruptures, and its states are at their limits
            ruptured = True
            for k in range(1, NY):
                if abs(LIMIT[k]) < 1e300:
                    value[6 + k] = LIMIT[k]
                    for j in range(6):
                        slope[6 + k, j] = 0.0
    moduli(outside[1, 0], modulus)
    for k in range(6):
        e[k] = path[0, k] + path[1, k] - value[k]
        stress[k] = 2.0 * modulus[0] * e[k] / MPA
        for j in range(6):
            tangent[k, j] = 2.0 * modulus[0] * (deviatoric(k, j) - slope[k, j]) / MPA
            if k < 3 and j < 3:
                tangent[k, j] = tangent[k, j] + modulus[1] / MPA
    for k in range(3):
        stress[k] = stress[k] + modulus[1] * (path[0, 6] + path[1, 6]) / MPA
    for k in range(NY):
        state[k] = value[6 + k] - INITIAL[k]
    return 0
