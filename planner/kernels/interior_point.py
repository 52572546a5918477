"""A primal-dual interior point for quadratic programs with a banded Hessian and rows that stay inside the band.

min 1/2 y'Hy + g'y  s.t.  G y + 1/2 kappa (D y + e)^2 <= h (rowwise, kappa >= 0, mostly 0).  Mehrotra's predictor and
corrector; the normal matrix H + J' diag(z / s) J, J the rows' slopes, has the band of H, so that an iteration costs
O(n width² + rows). Rows are to be scaled to bounds of about one.
"""

import numpy as np
from numba import njit

#: Residuals that pass where rounding slows their fall above the accuracy asked, and where it ends it: there rows are
#: kept all the same, only the optimum is less exact.
PASSES, ENDS, KEPT = 2e-11, 1e-7, 1e-11
#: Costs below this part of their scale are zero but for rounding.
NOTHING = 1e-6
#: Rounding of a product with the Hessian, relative to its largest term.
NOISE = 16 * 2.2e-16
#: By what part the diagonal is lifted where rounding leaves the normal matrix indefinite.
LIFT = 1e-13
#: What part of the way to the boundary a step goes.
TO_THE_BOUNDARY = 0.995

SOLVED, STALLED, INFEASIBLE = 0, 1, 2


@njit(cache=True, error_model="numpy")
def _factor4(a, out):  # type: ignore[no-untyped-def]
    """Do the same for width 3, minimum jerk through fixed waypoints: all in scalars."""
    p0 = p1 = p2 = q0 = q1 = o0 = 0.0  # of the row before: inverted diagonal and the two beside it; and of those before
    for i in range(len(a)):
        x3 = a[i, 3] * o0
        x2 = (a[i, 2] - x3 * q1) * q0
        x1 = (a[i, 1] - x2 * p1 - x3 * p2) * p0
        left = a[i, 0] - x1 * x1 - x2 * x2 - x3 * x3
        if not left > 0.0:
            return False
        x0 = 1.0 / np.sqrt(left)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = x0, x1, x2, x3
        o0, q0, q1, p0, p1, p2 = q0, p0, p1, x0, x1, x2
    return True


@njit(cache=True, error_model="numpy")
def factor(a, out):  # type: ignore[no-untyped-def]
    """Factor a banded matrix, L L': a[i, t] is its entry (i, i - t); the diagonal of L is inverted. False if it fails.

    Parameters
    ----------
    a, out : array (n, width + 1)
    """
    n, size = a.shape
    if size == 4:
        return _factor4(a, out)
    for i in range(n):
        first = min(size - 1, i)
        for t in range(first, -1, -1):
            total = a[i, t]
            j = i - t
            for s in range(1, min(size - t, j + 1)):
                total -= out[i, t + s] * out[j, s]
            if t > 0:
                out[i, t] = total * out[j, 0]
            else:
                if not total > 0.0:
                    return False
                out[i, 0] = 1.0 / np.sqrt(total)
    return True


@njit(cache=True, error_model="numpy")
def substitute(factors, b):  # type: ignore[no-untyped-def]
    """Solve L L' x = b in place."""
    n, size = factors.shape
    if size == 4:
        x1 = x2 = x3 = 0.0
        for i in range(n):
            x1, x2, x3 = (b[i] - factors[i, 3] * x3 - factors[i, 2] * x2 - factors[i, 1] * x1) * factors[i, 0], x1, x2
            b[i] = x1
        x1 = x2 = x3 = 0.0
        for i in range(n - 1, -1, -1):
            x = (b[i] - x1) * factors[i, 0]
            b[i] = x
            x1, x2, x3 = x2 + factors[i, 1] * x, x3 + factors[i, 2] * x, factors[i, 3] * x
        return
    for i in range(n):
        total = b[i]
        for t in range(1, min(size, i + 1)):
            total -= factors[i, t] * b[i - t]
        b[i] = total * factors[i, 0]
    for i in range(n - 1, -1, -1):
        x = b[i] * factors[i, 0]
        b[i] = x
        for t in range(1, min(size, i + 1)):
            b[i - t] -= factors[i, t] * x


@njit(cache=True, error_model="numpy")
def times(a, x, out):  # type: ignore[no-untyped-def]
    """Let out be A x for a symmetric banded matrix."""
    n, size = a.shape
    if size == 4:
        x1 = x2 = x3 = y1 = y2 = y3 = 0.0
        for i in range(n):
            now, a1, a2, a3 = x[i], a[i, 1], a[i, 2], a[i, 3]
            if i >= 3:
                out[i - 3] = y3 + a3 * now
            y3, y2, y1 = y2 + a2 * now, y1 + a1 * now, a[i, 0] * now + a1 * x1 + a2 * x2 + a3 * x3
            x1, x2, x3 = now, x1, x2
        if n >= 1:
            out[n - 1] = y1
        if n >= 2:
            out[n - 2] = y2
        if n >= 3:
            out[n - 3] = y3
        return
    out[:] = 0.0
    for i in range(n):
        total = a[i, 0] * x[i]
        for t in range(1, min(size, i + 1)):
            total += a[i, t] * x[i - t]
            out[i - t] += a[i, t] * x[i]
        out[i] += total


@njit(cache=True, error_model="numpy")
def _add_rows(columns, values, weight, out):  # type: ignore[no-untyped-def]
    """Add G' diag(weight) G to a banded matrix."""
    count, wide = columns.shape
    for r in range(count):
        if weight[r] == 0.0:
            continue
        for a in range(wide):
            i = columns[r, a]
            if i < 0:
                continue
            scaled = weight[r] * values[r, a]
            for b in range(wide):
                j = columns[r, b]
                if 0 <= j < i:
                    out[i, i - j] += scaled * values[r, b]
                elif j == i:
                    out[i, 0] += scaled * values[r, b]


@njit(cache=True, error_model="numpy")
def _dot(columns, values, r, x):  # type: ignore[no-untyped-def]
    total = 0.0
    for a in range(columns.shape[1]):
        if columns[r, a] >= 0:
            total += values[r, a] * x[columns[r, a]]
    return total


@njit(cache=True, error_model="numpy")
def _dual(own, gradient, columns, values, upper, z, work):  # type: ignore[no-untyped-def]
    """Return the dual value, less the objective's constant, of the best multiple of z: a bound for all feasible y.

    With r = G'z it is the largest over t >= 0 of -1/2 (g + t r)' H^{-1} (g + t r) - t h'z. ``own`` are factors of H.
    """
    work[:] = 0.0
    press = 0.0
    for r in range(len(z)):
        press += upper[r] * z[r]
        for a in range(columns.shape[1]):
            if columns[r, a] >= 0:
                work[columns[r, a]] += values[r, a] * z[r]
    base = bend = slope = 0.0
    free, pushed = gradient.copy(), work.copy()
    substitute(own, free)
    substitute(own, pushed)
    for i in range(len(work)):
        base -= 0.5 * gradient[i] * free[i]
        slope -= gradient[i] * pushed[i]
        bend += work[i] * pushed[i]
    slope -= press
    if not slope > 0.0:
        return base
    return base + 0.5 * slope * slope / bend


@njit(cache=True, error_model="numpy")
def interior_point(  # type: ignore[no-untyped-def]
    band,
    own,
    gradient,
    columns,
    values,
    upper,
    bends,
    offsets,
    kappa,
    ceiling,
    least,
    scale,
    push,
    accuracy,
    most,
    y,
    z,
):
    """Solve the program.

    Parameters
    ----------
    band, own : array (n, width + 1)
        H, and its factors (see ``factor``).
    gradient : array (n,)
    columns : array (R, W) of int64
        Where in y the entries of a row are; -1 for none.
    values : array (R, W)
    upper : array (R,)
    bends : array (R, W)
    offsets, kappa : array (R,)
        D, in the columns of G, e and kappa.
    ceiling : float
        Where the dual value, without the objective's constant, rises above this, there is no feasible y.
    least : float
        The objective at y = 0, where the unknowns' gradient vanishes. Errors are relative to it plus 1/2 y'Hy.
    scale : float
        A size of the objective, > 0.
    push : float
        What each row's slack times multiplier is at first, in those: where the optimum costs much more than ``scale``,
        small ones stall.
    accuracy : float
        Of the residuals, relatively.
    most : int
        Iterations at most.
    y : array (n,)
        Where to start; overwritten.
    z : array (R,)
        Overwritten: the multipliers, >= 0.

    Returns
    -------
    status, iterations
        ``SOLVED``; ``STALLED`` where the residuals do not pass; ``INFEASIBLE``: z is the proof.
    """
    n, rows = len(y), len(upper)
    wide = columns.shape[1]
    s, ds, dz = np.empty(rows), np.empty(rows), np.empty(rows)
    primal, weight, force = np.empty(rows), np.empty(rows), np.empty(rows)
    hy, dual, dy = np.empty(n), np.empty(n), np.empty(n)
    right, rest = np.empty(n), np.empty(n)
    normal, factors = np.empty_like(band), np.zeros_like(band)
    slopes = values.copy()
    far = 0.1
    for r in range(rows):
        s[r] = upper[r] - _dot(columns, values, r, y)
        far = max(far, -s[r])
    for r in range(rows):
        s[r] = max(s[r], far)
        z[r] = push * scale / s[r]
    best, stuck, iteration = np.inf, 0, 0
    kept_y, kept_z, closest = np.empty(n), np.empty(rows), np.inf  # the best so far that would pass
    for iteration in range(most):
        times(band, y, hy)
        size, cost = 1e-300, max(least, NOTHING * scale)
        pulled = worth = 0.0  # what is only known to rounding, of the gradient and of the cost
        for i in range(n):
            cost += 0.5 * y[i] * hy[i]
            pulled = max(pulled, NOISE * band[i, 0] * abs(y[i]))
            worth += NOISE * band[i, 0] * y[i] * y[i]
            dual[i] = hy[i] + gradient[i]
            size = max(size, abs(gradient[i]), abs(hy[i]))
        gap = off = 0.0
        for r in range(rows):
            primal[r] = _dot(columns, values, r, y) + s[r] - upper[r]
            if kappa[r] > 0.0:
                away = _dot(columns, bends, r, y) + offsets[r]
                primal[r] += 0.5 * kappa[r] * away * away
                for a in range(wide):
                    slopes[r, a] = values[r, a] + kappa[r] * away * bends[r, a]
            off = max(off, abs(primal[r]))
            gap += s[r] * z[r]
            for a in range(wide):
                if columns[r, a] >= 0:
                    push = slopes[r, a] * z[r]
                    dual[columns[r, a]] += push
                    size = max(size, abs(push))
        left = 0.0
        for i in range(n):
            left = max(left, abs(dual[i]))
        left = max(left - pulled, 0.0) / size
        exact = max(gap - worth, 0.0) / cost
        if off <= 0.1 * accuracy and left <= 10.0 * accuracy and exact <= accuracy:
            return SOLVED, iteration
        merit = off + left + gap / cost
        if merit < 0.5 * best:
            best, stuck = merit, 0
        else:
            stuck += 1
        worst = max(0.1 * left, exact)
        if off <= KEPT and worst <= ENDS and worst < closest:
            closest = worst
            kept_y[:] = y
            kept_z[:] = z
        if (closest <= PASSES and stuck >= 3) or stuck >= 12:  # as far as rounding allows
            break
        if iteration >= 8 and closest == np.inf and (stuck >= 3 or iteration % 8 == 0):
            if _dual(own, gradient, columns, values, upper, z, dy) > ceiling:
                return INFEASIBLE, iteration
        mu = gap / rows
        for r in range(rows):
            weight[r] = z[r] / s[r]
        normal[:] = band
        _add_rows(columns, slopes, weight, normal)
        for r in range(rows):
            weight[r] = kappa[r] * z[r]
        _add_rows(columns, bends, weight, normal)
        for r in range(rows):
            weight[r] = z[r] / s[r]
        if not factor(normal, factors):
            for i in range(n):  # rounding: lifted a little
                normal[i, 0] *= 1.0 + LIFT
            if not factor(normal, factors):
                break
        target = step = 0.0
        for phase in range(2):
            for i in range(n):
                dy[i] = -dual[i]
            for r in range(rows):
                # ds = -primal - G dy;  z ds + s dz = -(s z - target + second);  force: the part of dz without dy
                second = ds[r] * dz[r] if phase == 1 else 0.0
                force[r] = (target - s[r] * z[r] - second + z[r] * primal[r]) / s[r]
                for a in range(wide):
                    if columns[r, a] >= 0:
                        dy[columns[r, a]] -= slopes[r, a] * force[r]
            right[:] = dy
            substitute(factors, dy)
            for _ in range(2 if stuck > 0 else 0):  # refined
                times(normal, dy, rest)
                for i in range(n):
                    rest[i] = right[i] - rest[i]
                substitute(factors, rest)
                for i in range(n):
                    dy[i] += rest[i]
            step = 1.0 if phase == 0 else 1.0 / TO_THE_BOUNDARY
            for r in range(rows):
                move = _dot(columns, slopes, r, dy)
                ds[r] = -primal[r] - move
                dz[r] = force[r] + weight[r] * move
                if ds[r] < 0.0:
                    step = min(step, -s[r] / ds[r])
                if dz[r] < 0.0:
                    step = min(step, -z[r] / dz[r])
            if phase == 0:
                after = 0.0
                for r in range(rows):
                    after += (s[r] + step * ds[r]) * (z[r] + step * dz[r])
                target = mu * (max(after, 0.0) / gap) ** 3
        step *= TO_THE_BOUNDARY
        if not (step > 0.0 and np.isfinite(dy).all()):
            break
        for i in range(n):
            y[i] += step * dy[i]
        for r in range(rows):
            s[r] = max(s[r] + step * ds[r], 1e-300)
            z[r] = max(z[r] + step * dz[r], 1e-300)
    if closest < np.inf:
        y[:] = kept_y
        z[:] = kept_z
        return SOLVED, iteration
    if _dual(own, gradient, columns, values, upper, z, dy) > ceiling:
        return INFEASIBLE, iteration
    return STALLED, iteration
