r"""Interpolating splines of degree 2k - 1 and class C^(2k-2), k = 2, 3, 4, in one sweep forth and one sweep back.

The spline through the points minimises the integral of the squared k-th derivative, so it is the mean of a (k-1)-fold
integrated Wiener process given its values. Forth, the derivatives of order 1 … k-1 at a knot are estimated (m) from
the points up to there; back, the corrections e owed to the later points are spread. Block elimination for the Hessian,
or for the covariance C of the estimates, subtracts nearly equal numbers where steps are uneven: one gap of 1e-9 among
ones leaves not a digit. Here all minors of C are carried, (1, C_ij, …, det C), in units of the step and up to a common
factor. From knot to knot they change linearly, by a table of numbers >= 0 (the flow is totally positive): nothing is
ever subtracted, every minor keeps its relative accuracy. The common factor makes free ends regular: an infinite C is
(0, …, 0, 1).

References
----------
G. Kimeldorf, G. Wahba, A correspondence between Bayesian estimation on stochastic processes and smoothing by splines,
Ann. Math. Statist. 41 (1970), 495-502; S. Karlin, Total Positivity, Stanford University Press, 1968.
"""

import numpy as np
from numba import njit

# Septic. Rows: the 14 minors after a step (the empty one; 11 12 13 22 23 33; 12|12 12|13 12|23 13|13 13|23 23|23; the
# determinant) times the first number, in terms of the same before it; then the nine gains J times the last minor.
_SEPTIC_ROWS = (
    (252, 1, 252, 252, 84, 63, 42, 7, 0, 0, 0, 0, 0, 0, 0),
    (181440, 1, 4752, 2952, 384, 468, 132, 12, 45360, 60480, 15120, 20160, 10080, 1260, 0),
    (30240, 1, 2772, 1968, 288, 351, 110, 11, 15120, 25200, 7560, 10080, 5880, 840, 0),
    (12096, 1, 1512, 1260, 216, 252, 90, 10, 0, 6048, 3024, 4032, 3024, 504, 0),
    (4725, 1, 1575, 1260, 210, 255, 90, 10, 4725, 9450, 3150, 4725, 3150, 525, 0),
    (1680, 1, 840, 770, 154, 175, 72, 9, 0, 1680, 840, 1680, 1400, 280, 0),
    (448, 1, 448, 448, 112, 112, 56, 8, 0, 0, 0, 448, 448, 112, 0),
    (54432000, 1, 17820, 8100, 780, 975, 210, 15, 972000, 583200, 90000, 115200, 39600, 3600, 1512000),
    (7257600, 1, 11880, 5940, 624, 780, 182, 14, 453600, 311040, 54000, 69120, 26400, 2640, 604800),
    (1814400, 1, 7560, 4230, 486, 615, 156, 13, 226800, 166320, 32400, 40320, 17280, 1920, 302400),
    (725760, 1, 7668, 4248, 492, 612, 156, 13, 181440, 151200, 30240, 39168, 16848, 1872, 181440),
    (161280, 1, 4704, 2936, 376, 472, 132, 12, 80640, 73920, 16800, 21504, 10496, 1312, 80640),
    (33600, 1, 2800, 1960, 280, 355, 110, 11, 33600, 33600, 8400, 11200, 6160, 880, 33600),
    (870912000, 1, 25920, 10800, 960, 1200, 240, 16, 1944000, 1036800, 144000, 184320, 57600, 4800, 3456000),
    (2419200, 0, -68, -13, -1, 0, 0, 0, -11400, -4680, -360, -608, -88, 0, -24000),
    (14515200, 0, 78, 14, 1, 0, 0, 0, 18000, 6600, 480, 768, 104, 0, 43200),
    (217728000, 0, -90, -15, -1, 0, 0, 0, -27000, -9000, -600, -960, -120, 0, -72000),
    (2419200, 0, 0, -68, 0, -13, -1, 0, 30240, 6720, -1080, 0, -608, -88, 80640),
    (14515200, 0, 0, 78, 0, 14, 1, 0, -58320, -11520, 1320, 0, 768, 104, -184320),
    (217728000, 0, 0, -90, 0, -15, -1, 0, 97200, 17280, -1800, 0, -960, -120, 345600),
    (2419200, 0, 0, 0, -68, 0, -13, -1, 0, 30240, 11400, 6720, 3600, 360, -100800),
    (14515200, 0, 0, 0, 78, 0, 14, 1, 0, -58320, -18000, -11520, -5280, -480, 302400),
    (217728000, 0, 0, 0, -90, 0, -15, -1, 0, 97200, 27000, 17280, 7200, 600, -648000),
)
_SEPTIC = np.zeros((14, 24))  # [j, i]: what minor j gives to row i
_SEPTIC[:, :23] = np.array([[x / row[0] for x in row[1:]] for row in _SEPTIC_ROWS]).T


@njit(cache=True, error_model="numpy")
def _prior(k, fixed, minors):  # type: ignore[no-untyped-def]
    """Make zeros the minors at the first knot: C is zero where a derivative is fixed, infinite where it is free."""
    free = 0
    for r in range(k - 1):
        if not fixed[r]:
            free += 1 << r
    place = (0, 1, 3, 4)[free] if k < 4 else (0, 1, 4, 7, 6, 10, 12, 13)[free]
    minors[place] = 1.0


# One step each: minors of C at the left knot, in units of the step before, to those at the right knot, in units of this
# one, the last of them made 1. A row of gains is J by rows, G, K: with ``new`` what the next point differs from its
# prediction, e_left = J e_right + G new, m_right = Taylor's m_left + K new.


@njit(cache=True, error_model="numpy")
def _step2(ratio, h, c, gains, i):  # type: ignore[no-untyped-def]
    one, p = c[0], c[1] * ratio
    x = one * (1.0 / 3.0) + p
    scale = 12.0 / (one + 4.0 * p)
    c[0], c[1] = x * scale, 1.0
    gains[i, 0] = p * scale * (-1.0 / 6.0)
    rate = 1.0 / (x * h)
    gains[i, 1] = p * rate
    gains[i, 2] = (p + 0.5 * one) * rate


@njit(cache=True, error_model="numpy")
def _step3(ratio, h, c, gains, i):  # type: ignore[no-untyped-def]
    square = ratio * ratio
    one, p, q, r, d = c[0], c[1] * (square * ratio), c[2] * square, c[3] * ratio, c[4] * (square * square)
    left_v, left_a = p + 0.5 * q, q + 0.5 * r
    x = 0.05 * one + left_v + 0.5 * left_a
    scale = 8640.0 / (one + 192.0 * p + 72.0 * q + 9.0 * r + 432.0 * d)
    c[0] = x * scale
    c[1] = (one + 128.0 * p + 56.0 * q + 8.0 * r + 240.0 * d) * (scale * (1.0 / 960.0))
    c[2] = (one + 80.0 * p + 42.0 * q + 7.0 * r + 120.0 * d) * (scale * (1.0 / 240.0))
    c[3] = (one + 45.0 * p + 30.0 * q + 6.0 * r + 45.0 * d) * (scale * (1.0 / 45.0))
    c[4] = 1.0
    rate = 1.0 / h
    gains[i, 0] = (7.0 * p + q + 27.0 * d) * (scale * (-1.0 / 360.0))
    gains[i, 1] = (8.0 * p + q + 36.0 * d) * (scale * h * (1.0 / 2880.0))
    gains[i, 2] = (60.0 * d - 7.0 * q - r) * (scale * rate * (1.0 / 360.0))
    gains[i, 3] = (8.0 * q + r - 96.0 * d) * (scale * (1.0 / 2880.0))
    if x > 0.0:
        inverse = rate / x
        gains[i, 4], gains[i, 5] = left_v * inverse, left_a * inverse * rate
        gains[i, 6] = (0.125 * one + left_v + left_a) * inverse
        gains[i, 7] = ((1.0 / 6.0) * one + left_a) * inverse * rate
    else:  # all free so far: a line
        gains[i, 4], gains[i, 5], gains[i, 6], gains[i, 7] = rate, 0.0, rate, 0.0


@njit(cache=True, error_model="numpy")
def _step4(ratio, h, c, gains, i, work):  # type: ignore[no-untyped-def]
    r2 = ratio * ratio
    r3, r4 = r2 * ratio, r2 * r2
    r5, r6, r8 = r4 * ratio, r3 * r3, r4 * r4
    one, c1, c2, c3, c4, c5, c6 = c[0], c[1] * r5, c[2] * r4, c[3] * r3, c[4] * r3, c[5] * r2, c[6] * ratio
    c7, c8, c9, c10, c11, c12 = c[7] * r8, c[8] * (r6 * ratio), c[9] * r6, c[10] * r6, c[11] * r5, c[12] * r4
    c13 = c[13] * (r8 * ratio)
    for n in range(24):
        s = (_SEPTIC[0, n] * one + _SEPTIC[1, n] * c1) + (_SEPTIC[2, n] * c2 + _SEPTIC[3, n] * c3)
        t = (_SEPTIC[4, n] * c4 + _SEPTIC[5, n] * c5) + (_SEPTIC[6, n] * c6 + _SEPTIC[7, n] * c7)
        u = (_SEPTIC[8, n] * c8 + _SEPTIC[9, n] * c9) + (_SEPTIC[10, n] * c10 + _SEPTIC[11, n] * c11)
        work[n] = (s + t) + (u + (_SEPTIC[12, n] * c12 + _SEPTIC[13, n] * c13))
    x, scale, rate = work[0], 1.0 / work[13], 1.0 / h
    rate2 = rate * rate
    for n in range(13):
        c[n] = work[n] * scale
    c[13] = 1.0
    powers = (rate2, rate, 1.0, h, h * h)
    for n in range(9):
        gains[i, n] = work[14 + n] * (scale * powers[2 + n % 3 - n // 3])
    left_v = c1 + 0.5 * c2 + (1.0 / 6.0) * c3
    left_a = c2 + 0.5 * c4 + (1.0 / 6.0) * c5
    left_j = c3 + 0.5 * c5 + (1.0 / 6.0) * c6
    if not x > 0.0:  # too little is fixed so far: a line, or a parabola through the knot before, if there is one
        back = ratio if c7 > 0.0 else 0.0
        both = 1.0 / (1.0 + back)
        gains[i, 9], gains[i, 10], gains[i, 11] = back * both * rate, 2.0 * both * rate2, 0.0
        gains[i, 12], gains[i, 13], gains[i, 14] = (2.0 + back) * both * rate, 2.0 * both * rate2, 0.0
        if not c12 > 0.0:
            gains[i, 9], gains[i, 10], gains[i, 12], gains[i, 13] = rate, 0.0, rate, 0.0
        return
    inverse = rate / x
    gains[i, 9], gains[i, 10], gains[i, 11] = left_v * inverse, left_a * (inverse * rate), left_j * (inverse * rate2)
    gains[i, 12] = ((1.0 / 72.0) * one + left_v + left_a + 0.5 * left_j) * inverse
    gains[i, 13] = ((1.0 / 30.0) * one + left_a + left_j) * (inverse * rate)
    gains[i, 14] = ((1.0 / 24.0) * one + left_j) * (inverse * rate2)


@njit(cache=True, error_model="numpy")
def _gains(k, h, c, gains):  # type: ignore[no-untyped-def]
    """Find the gains of all gaps; ``c`` ends as the minors at the last knot. False if a step is not positive."""
    good, work = True, np.empty(24)
    for i in range(len(h)):
        good &= 0.0 < h[i] < np.inf
        ratio = h[i - 1] / h[i] if i > 0 else 1.0
        if k == 2:
            _step2(ratio, h[i], c, gains, i)
        elif k == 3:
            _step3(ratio, h[i], c, gains, i)
        else:
            _step4(ratio, h[i], c, gains, i, work)
    return good


@njit(cache=True, error_model="numpy")
def _forth(k, h, points, gains, m):  # type: ignore[no-untyped-def]
    """Carry the estimates from the first knot to the last."""
    dims = points.shape[1]
    if k == 2:
        for i in range(len(h)):
            step, kv = h[i], gains[i, 2]
            for d in range(dims):
                v = m[0, i, d]
                m[0, i + 1, d] = v + kv * (points[i + 1, d] - points[i, d] - step * v)
    elif k == 3:
        for i in range(len(h)):
            step, kv, ka = h[i], gains[i, 6], gains[i, 7]
            half = 0.5 * step
            for d in range(dims):
                v, a = m[0, i, d], m[1, i, d]
                new = points[i + 1, d] - points[i, d] - step * (v + half * a)
                m[0, i + 1, d] = v + step * a + kv * new
                m[1, i + 1, d] = a + ka * new
    else:
        for i in range(len(h)):
            step, kv, ka, kj = h[i], gains[i, 12], gains[i, 13], gains[i, 14]
            half, third = 0.5 * step, step * (1.0 / 3.0)
            for d in range(dims):
                v, a, j = m[0, i, d], m[1, i, d], m[2, i, d]
                new = points[i + 1, d] - points[i, d] - step * (v + half * (a + third * j))
                m[0, i + 1, d] = v + step * (a + half * j) + kv * new
                m[1, i + 1, d] = a + step * j + ka * new
                m[2, i + 1, d] = j + kj * new


@njit(cache=True, error_model="numpy")
def _back(k, h, points, gains, m, e):  # type: ignore[no-untyped-def]
    """Carry the corrections back from the last knot to the first and add them; return 0, or NaN if not finite."""
    dims = points.shape[1]
    trouble = 0.0
    for i in range(len(h) - 1, -1, -1):
        step = h[i]
        if k == 2:
            g0, g1 = gains[i, 0], gains[i, 1]
            for d in range(dims):
                v = m[0, i, d]
                new = points[i + 1, d] - points[i, d] - step * v
                e[0, d] = g0 * e[0, d] + g1 * new
                m[0, i, d] = v + e[0, d]
                trouble += e[0, d] - e[0, d]
        elif k == 3:
            half = 0.5 * step
            g0, g1, g4 = gains[i, 0], gains[i, 1], gains[i, 4]
            g2, g3, g5 = gains[i, 2], gains[i, 3], gains[i, 5]
            for d in range(dims):
                v, a = m[0, i, d], m[1, i, d]
                new = points[i + 1, d] - points[i, d] - step * (v + half * a)
                ev = g0 * e[0, d] + g1 * e[1, d] + g4 * new
                ea = g2 * e[0, d] + g3 * e[1, d] + g5 * new
                e[0, d], e[1, d] = ev, ea
                m[0, i, d], m[1, i, d] = v + ev, a + ea
                trouble += ev - ev + (ea - ea)
        else:
            half, third = 0.5 * step, step * (1.0 / 3.0)
            g0, g1, g2, g9 = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 9]
            g3, g4, g5, g10 = gains[i, 3], gains[i, 4], gains[i, 5], gains[i, 10]
            g6, g7, g8, g11 = gains[i, 6], gains[i, 7], gains[i, 8], gains[i, 11]
            for d in range(dims):
                v, a, j = m[0, i, d], m[1, i, d], m[2, i, d]
                new = points[i + 1, d] - points[i, d] - step * (v + half * (a + third * j))
                ev = g0 * e[0, d] + g1 * e[1, d] + g2 * e[2, d] + g9 * new
                ea = g3 * e[0, d] + g4 * e[1, d] + g5 * e[2, d] + g10 * new
                ej = g6 * e[0, d] + g7 * e[1, d] + g8 * e[2, d] + g11 * new
                e[0, d], e[1, d], e[2, d] = ev, ea, ej
                m[0, i, d], m[1, i, d], m[2, i, d] = v + ev, a + ea, j + ej
                trouble += ev - ev + (ea - ea) + (ej - ej)
    return trouble


@njit(cache=True, error_model="numpy")
def _passed_on(k, fixed, c):  # type: ignore[no-untyped-def]
    """Return W, in units of the step: the corrections of the last knot are W times those of its fixed derivatives."""
    w = np.zeros((k - 1, k - 1))
    count = only = 0
    for r in range(k - 1):
        if fixed[r]:
            w[r, r], count, only = 1.0, count + 1, r
    if k == 3 and count == 1:
        w[1 - only, only] = c[2] / c[1 + 2 * only]
    elif k == 4 and count == 1:
        place = ((1, 2, 3), (2, 4, 5), (3, 5, 6))[only]
        for r in range(3):
            if c[place[only]] > 0.0:
                w[r, only] = c[place[r]] / c[place[only]]
            elif c[1] > 0.0:  # a single gap with the third derivative at both ends: u^4 - u
                w[r, only] = (0.125, 0.5, 1.0)[r]
            else:  # a single gap, nothing at the left: u^2 - u, or u^3 - u
                w[r, only] = ((1.0, 2.0, 0.0), (0.5, 1.0, 0.0), (1.0 / 3.0, 1.0, 1.0))[only][r]
    elif k == 4 and count == 2:
        if not fixed[0]:
            w[0, 1], w[0, 2] = c[11] / c[12], -c[9] / c[12]
        elif not fixed[1]:
            w[1, 0], w[1, 2] = c[11] / c[10], c[8] / c[10]
        else:
            w[2, 0], w[2, 1] = -c[9] / c[7], c[8] / c[7]
    return w


@njit(cache=True, error_model="numpy")
def _turn(k, step, end, fixed, c, m, e):  # type: ignore[no-untyped-def]
    """Correct the last knot, ``e`` saying by what; return 0, or NaN if that is not finite."""
    trouble = 0.0
    w = _passed_on(k, fixed, c)
    for d in range(m.shape[2]):
        for r in range(k - 1):
            for s in range(k - 1):
                if fixed[s]:
                    e[r, d] += w[r, s] * (end[s, d] - m[s, -1, d]) * step ** (s - r)
            trouble += e[r, d] - e[r, d]
        for r in range(k - 1):
            m[r, -1, d] = end[r, d] if fixed[r] else m[r, -1, d] + e[r, d]
    return trouble


@njit(cache=True, error_model="numpy")
def hermite_states(h, points, ends, fixed, states):  # type: ignore[no-untyped-def]
    """Find the derivatives of order 1 … k-1 at the knots of the spline of degree 2k - 1 through the points.

    Parameters
    ----------
    h : array (N - 1,)
        Positive steps.
    points : array (N, D)
        N >= 2.
    ends : array (2, k - 1, D)
        Derivatives of order 1 … k-1 at both ends; those not fixed are not read.
    fixed : array (2, k - 1) of bool
        Which of them hold; each of the others is left to the smallest integral of the squared k-th derivative. Where
        too little is known for that to have one solution, a simple one is taken (through two points a line).
    states : array (k - 1, N, D)
        Overwritten; k = 2, 3 or 4 is read off it.

    Returns
    -------
    bool
        False if a step is not positive and finite or a state not finite; the states are then of no use.
    """
    b, count, dims = states.shape
    k, gaps = b + 1, count - 1
    if gaps < 1 or b < 1 or b > 3:
        return False
    gains = np.empty((gaps, b * (b + 2)))
    c = np.zeros((2, 5, 14)[b - 1])
    e = np.zeros((b, dims))
    _prior(k, fixed[0], c)
    for r in range(b):
        for d in range(dims):
            states[r, 0, d] = ends[0, r, d] if fixed[0, r] else 0.0
    if not _gains(k, h, c, gains):
        return False
    _forth(k, h, points, gains, states)
    trouble = _turn(k, h[gaps - 1], ends[1], fixed[1], c, states, e)
    trouble += _back(k, h, points, gains, states, e)
    return trouble == 0.0
