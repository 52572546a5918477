"""One joint on one segment between two waypoints: its cubic spline, the rows of its limits, and their condensation.

The position is a cubic B-spline of the class C2 over u = t / h in [0, 1] with K pieces: K + 3 control points, the
first and last three of which the waypoints' positions, velocities and accelerations fix. Rows, R of them, in this
order: velocity's control points 1 … K (the first and the last are the waypoints' own), accelerations at the inner
nodes 1 … K - 1, jerks of the pieces 0 … K - 1, and (where positions are limited) control points 1 … K + 1. Keeping
them between their bounds keeps the limits at all times: a spline lies in the hull of its control points.

With eta = h / h0, row r of order m asks for  lower eta^m <= g <= upper eta^m,  g = sum_p coef[r, p] c[start[r] + p].
Units: a joint's velocity, acceleration and jerk in ``v``, ``a``, ``j``, its position on a segment in v h0.
"""

from numba import njit

#: Columns of what couples to a segment's inner control points: two at each end, eta, the right-hand side.
ENDS, ETA, RIGHT = 4, 4, 5


@njit(cache=True)
def rows_count(pieces, positions):  # type: ignore[no-untyped-def]
    """Return the number of rows."""
    return 4 * pieces if positions else 3 * pieces - 1


@njit(cache=True)
def order_of(r, pieces):  # type: ignore[no-untyped-def]
    """Return the derivative that row r limits."""
    if r < pieces:
        return 1
    if r < 2 * pieces - 1:
        return 2
    return 3 if r < 3 * pieces - 1 else 0


@njit(cache=True)
def _knot(u, k):  # type: ignore[no-untyped-def]
    """Return entry k of the clamped knot vector over the nodes u."""
    pieces = u.shape[0] - 1
    return u[min(max(k - 3, 0), pieces)]


@njit(cache=True)
def fill_rows(u, unit_a, unit_j, coef, start):  # type: ignore[no-untyped-def]
    """Write the rows' coefficients (R, 4) and first control points (R,) for nodes u (K + 1,).

    ``unit_a`` = v / (a h0), ``unit_j`` = v / (j h0^2): what turns derivatives in u into the rows' units.
    """
    pieces = u.shape[0] - 1
    last = pieces - 1  # the first of the last four control points
    coef[:] = 0.0
    for m in range(1, pieces + 1):
        f = 3.0 / (_knot(u, m + 4) - _knot(u, m + 1))
        first = min(m, last)
        start[m - 1] = first
        coef[m - 1, m - first] -= f
        coef[m - 1, m + 1 - first] += f
    for m in range(1, pieces):
        f = 2.0 * unit_a / (_knot(u, m + 4) - _knot(u, m + 2))
        r, first = pieces + m - 1, min(m, last)
        start[r] = first
        for s in range(2):  # f times the difference of velocity's control points m + 1 and m
            g = (f if s else -f) * 3.0 / (_knot(u, m + s + 4) - _knot(u, m + s + 1))
            coef[r, m + s - first] -= g
            coef[r, m + s + 1 - first] += g
    for k in range(pieces):
        r = 2 * pieces - 1 + k
        start[r] = k
        for e in range(2):  # the acceleration at the piece's end, less that at its start
            m = k + e
            f = (1.0 if e else -1.0) * unit_j / (u[k + 1] - u[k]) * 2.0 / (_knot(u, m + 4) - _knot(u, m + 2))
            for s in range(2):
                g = (f if s else -f) * 3.0 / (_knot(u, m + s + 4) - _knot(u, m + s + 1))
                coef[r, e + s] -= g
                coef[r, e + s + 1] += g
    for i in range(3 * pieces - 1, coef.shape[0]):
        j = i - (3 * pieces - 1) + 1
        start[i] = min(j, last)
        coef[i, j - start[i]] = 1.0


@njit(cache=True)
def fill_ends(u, move, unit, eta, v0, a0, v1, a1, c):  # type: ignore[no-untyped-def]
    """Write the first and last three control points; ``unit`` = a h0 / v, ``move`` the way in v h0."""
    pieces = u.shape[0] - 1
    w1, w2 = 1.0 - u[pieces - 1], 1.0 - u[pieces - 2]
    c[0] = 0.0
    c[1] = eta * v0 * u[1] / 3.0
    c[2] = eta * v0 * (u[1] + u[2]) / 3.0 + eta * eta * unit * a0 * u[1] * u[2] / 6.0
    c[pieces] = move - eta * v1 * (w1 + w2) / 3.0 + eta * eta * unit * a1 * w1 * w2 / 6.0
    c[pieces + 1] = move - eta * v1 * w1 / 3.0
    c[pieces + 2] = move


@njit(cache=True)
def fill_tangents(u, unit, eta, v0, a0, v1, a1, tangent):  # type: ignore[no-untyped-def]
    """Write the derivatives of the end control points 1, 2, K, K + 1 by (v0, a0, v1, a1, eta), (4, 5)."""
    pieces = u.shape[0] - 1
    w1, w2 = 1.0 - u[pieces - 1], 1.0 - u[pieces - 2]
    square = eta * eta * unit
    tangent[:] = 0.0
    tangent[0, 0] = eta * u[1] / 3.0
    tangent[1, 0] = eta * (u[1] + u[2]) / 3.0
    tangent[1, 1] = square * u[1] * u[2] / 6.0
    tangent[2, 2] = -eta * (w1 + w2) / 3.0
    tangent[2, 3] = square * w1 * w2 / 6.0
    tangent[3, 2] = -eta * w1 / 3.0
    tangent[0, 4] = v0 * u[1] / 3.0
    tangent[1, 4] = v0 * (u[1] + u[2]) / 3.0 + 2.0 * eta * unit * a0 * u[1] * u[2] / 6.0
    tangent[2, 4] = -v1 * (w1 + w2) / 3.0 + 2.0 * eta * unit * a1 * w1 * w2 / 6.0
    tangent[3, 4] = -v1 * w1 / 3.0


@njit(cache=True)
def curvature(u, unit, eta, a0, a1, force, matrix):  # type: ignore[no-untyped-def]
    """Add force . (second derivatives of the end control points) to the matrix over (v0, a0, v1, a1, eta).

    ``force`` (K + 3,): the Lagrangian's derivative by each control point.
    """
    pieces = u.shape[0] - 1
    w1, w2 = 1.0 - u[pieces - 1], 1.0 - u[pieces - 2]
    left, right = unit * u[1] * u[2] / 6.0, unit * w1 * w2 / 6.0
    v0 = force[1] * u[1] / 3.0 + force[2] * (u[1] + u[2]) / 3.0
    v1 = -force[pieces + 1] * w1 / 3.0 - force[pieces] * (w1 + w2) / 3.0
    matrix[0, 4] += v0
    matrix[4, 0] += v0
    matrix[2, 4] += v1
    matrix[4, 2] += v1
    matrix[1, 4] += 2.0 * eta * left * force[2]
    matrix[4, 1] += 2.0 * eta * left * force[2]
    matrix[3, 4] += 2.0 * eta * right * force[pieces]
    matrix[4, 3] += 2.0 * eta * right * force[pieces]
    matrix[4, 4] += 2.0 * (left * a0 * force[2] + right * a1 * force[pieces])


@njit(cache=True)
def forces(u, coef, start, bound, dual, value, eta, price, force):  # type: ignore[no-untyped-def]
    """Write the Lagrangian's derivative by control points, (K + 3,); return the part of eta's that is not through them.

    Of  price . (jerk rows)^2 eta^-5  less duals times slacks; see ``condense``.
    """
    pieces = u.shape[0] - 1
    force[:] = 0.0
    own = 0.0
    for r in range(coef.shape[0]):
        m = order_of(r, pieces)
        pull = dual[r, 1] - dual[r, 0]
        if m:
            first = m * eta ** (m - 1)
            own += first * (dual[r, 0] * bound[m, 0] - dual[r, 1] * bound[m, 1])
        if price > 0.0 and m == 3:
            k = r - (2 * pieces - 1)
            cost, g = price * (u[k + 1] - u[k]) * eta**-5, value[r]
            pull += 2.0 * cost * g
            own -= 5.0 * cost * g * g / eta
        j = start[r]
        for p in range(4):
            force[j + p] += pull * coef[r, p]
    return own


@njit(cache=True)
def condense(u, coef, start, bound, slack, dual, miss, value, eta, mu, price, band, cross, right):  # type: ignore[no-untyped-def]
    """Add up the rows' barrier terms over the control points; return their part of eta's diagonal and right side.

    The Newton matrix of  price . (jerk rows)^2 eta^-5 - mu sum log slack  with the slacks and duals eliminated:
    ``band[j, o]`` couples control points j and j + o, ``cross[j]`` j and eta; ``right`` is its right-hand side.
    ``bound`` (4, 2) by order; ``miss`` = (what the slack should be) - slack; sides 0 below, 1 above; an infinite bound
    has no term.
    """
    pieces, rows = u.shape[0] - 1, coef.shape[0]
    band[:] = 0.0
    cross[:] = 0.0
    right[:] = 0.0
    diagonal, side = 0.0, 0.0
    for r in range(rows):
        m = order_of(r, pieces)
        first = m * eta ** (m - 1) if m else 0.0
        second = m * (m - 1) * eta ** (m - 2) if m > 1 else 0.0
        lower, upper = bound[m, 0], bound[m, 1]
        weight, coupling, push = 0.0, 0.0, 0.0
        if upper < 1e300:
            inverse = 1.0 / slack[r, 1]
            w, t, e = dual[r, 1] * inverse, (mu - dual[r, 1] * miss[r, 1]) * inverse, upper * first
            weight += w
            coupling -= w * e
            push -= t
            diagonal += w * e * e - dual[r, 1] * upper * second
            side += t * e
        if lower > -1e300:
            inverse = 1.0 / slack[r, 0]
            w, t, e = dual[r, 0] * inverse, (mu - dual[r, 0] * miss[r, 0]) * inverse, -lower * first
            weight += w
            coupling += w * e
            push += t
            diagonal += w * e * e + dual[r, 0] * lower * second
            side += t * e
        if price > 0.0 and m == 3:
            k = r - (2 * pieces - 1)
            cost, g = price * (u[k + 1] - u[k]) * eta**-5, value[r]
            weight += 2.0 * cost
            coupling -= 10.0 * cost * g / eta
            push -= 2.0 * cost * g
            diagonal += 30.0 * cost * g * g / (eta * eta)
            side += 5.0 * cost * g * g / eta
        j = start[r]
        for p in range(4):
            x = coef[r, p]
            cross[j + p] += coupling * x
            right[j + p] += push * x
            x *= weight
            for q in range(p, 4):
                band[j + p, q - p] += x * coef[r, q]
    return diagonal, side


@njit(cache=True)
def eliminate(pieces, band, cross, right, factor, reach, ends, eta):  # type: ignore[no-untyped-def]
    """Eliminate the inner control points 3 … K - 1; return whether they are positive definite.

    Writes the banded Cholesky ``factor`` (K - 3, 4), what it leaves of the coupled columns, ``reach`` (K - 3, 6), and
    their Schur complement: ``ends`` (5, 6) over the end control points 1, 2, K, K + 1 and eta, and the right side;
    ``eta`` (diagonal, right-hand side) comes from ``condense``.
    """
    at = (1, 2, pieces, pieces + 1)
    for p in range(ENDS):
        for q in range(ENDS):
            i, j = min(at[p], at[q]), max(at[p], at[q])
            ends[p, q] = band[i, j - i] if j - i < 4 else 0.0
        ends[p, ETA] = cross[at[p]]
        ends[ETA, p] = cross[at[p]]
        ends[p, RIGHT] = right[at[p]]
    ends[ETA, ETA], ends[ETA, RIGHT] = eta[0], eta[1]
    inner = pieces - 3
    for i in range(inner):
        j = 3 + i
        pivot = band[j, 0]
        for p in range(1, min(3, i) + 1):
            pivot -= factor[i - p, p] ** 2
        if not pivot > 0.0:
            return False
        root = pivot**0.5
        factor[i, 0] = root
        for o in range(1, 4):
            entry = band[j, o] if i + o < inner else 0.0
            for p in range(1, min(3 - o, i) + 1):
                entry -= factor[i - p, p] * factor[i - p, p + o]
            factor[i, o] = entry / root
        reach[i, 0] = band[1, j - 1] if j - 1 < 4 else 0.0
        reach[i, 1] = band[2, j - 2] if j - 2 < 4 else 0.0
        reach[i, 2] = band[j, pieces - j] if pieces - j < 4 else 0.0
        reach[i, 3] = band[j, pieces + 1 - j] if pieces + 1 - j < 4 else 0.0
        reach[i, ETA] = cross[j]
        reach[i, RIGHT] = right[j]
        for p in range(1, min(3, i) + 1):
            for q in range(6):
                reach[i, q] -= factor[i - p, p] * reach[i - p, q]
        for q in range(6):
            reach[i, q] /= root
        for p in range(5):
            for q in range(6):
                ends[p, q] -= reach[i, p] * reach[i, q]
    return True


@njit(cache=True)
def inner_step(pieces, factor, reach, ends, eta, step):  # type: ignore[no-untyped-def]
    """Write the step (K + 3,) of all control points from that of the end ones (4,) and of eta."""
    step[0], step[pieces + 2] = 0.0, 0.0
    step[1], step[2], step[pieces], step[pieces + 1] = ends[0], ends[1], ends[2], ends[3]
    inner = pieces - 3
    for i in range(inner - 1, -1, -1):
        x = reach[i, RIGHT] - reach[i, ETA] * eta
        for q in range(ENDS):
            x -= reach[i, q] * ends[q]
        for o in range(1, min(3, inner - 1 - i) + 1):
            x -= factor[i, o] * step[3 + i + o]
        step[3 + i] = x / factor[i, 0]


@njit(cache=True)
def fold(tangent, ends, matrix, right):  # type: ignore[no-untyped-def]
    """Write the matrix (5, 5) and right side (5,) over (v0, a0, v1, a1, eta) from those over end points and eta."""
    for p in range(5):
        right[p] = 0.0
        for k in range(4):
            right[p] += tangent[k, p] * ends[k, RIGHT]
        for q in range(5):
            x = 0.0
            for k in range(4):
                if tangent[k, p] == 0.0:
                    continue
                for n in range(4):
                    x += tangent[k, p] * ends[k, n] * tangent[n, q]
            matrix[p, q] = x
    for p in range(5):
        x = 0.0
        for k in range(4):
            x += tangent[k, p] * ends[k, ETA]
        matrix[p, 4] += x
        matrix[4, p] += x
    matrix[4, 4] += ends[ETA, ETA]
    right[4] += ends[ETA, RIGHT]
