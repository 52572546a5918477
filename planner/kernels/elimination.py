"""Least squared jerk through points, by block elimination on node velocities and accelerations.

The shortest road where neighbouring steps do not differ much; ``splines`` is the one that keeps its digits elsewhere.
With r = 1 / step, node i has the block [[192 (r³ + r'³), 36 (r'² - r²)], [·, 9 (r + r')]] (r to the left, r' to the
right of it) and [[168 r'³, -24 r'²], [24 r'², -3 r']] couples it to the next.
"""

from numba import njit

from .lanes import minus, step

#: Neighbouring steps may differ by this factor: the states are then exact to about 1e-13.
EVEN = 30.0


@njit(cache=True, error_model="numpy")
def jerk_states(h, points, ends, work, states):  # type: ignore[no-untyped-def]
    """Find the velocities and accelerations at the knots, those at the ends being given.

    Parameters
    ----------
    h : array (N - 1,)
    points : array (N, D)
    ends : array (2, 2, D)
        Velocity and acceleration at the start, then at the end.
    work : array (N, 4)
        Overwritten.
    states : array (2, N, D)
        Overwritten.

    Returns
    -------
    bool
        False if the steps are too uneven, or a state is not finite; the states are then of no use.
    """
    count, dims = points.shape
    last = count - 1
    for d in range(dims):
        states[0, 0, d], states[1, 0, d] = ends[0, 0, d], ends[0, 1, d]
        states[0, last, d], states[1, last, d] = ends[1, 0, d], ends[1, 1, d]
    l1 = 1.0 / h[0]
    l2 = l1 * l1
    l3 = l2 * l1
    n00 = n01 = n10 = n11 = 0.0
    for i in range(1, last):
        if not h[i - 1] < EVEN * h[i] < EVEN * EVEN * h[i - 1]:
            return False
        r1 = 1.0 / h[i]
        r2 = r1 * r1
        r3 = r2 * r1
        c00, c01, c11 = 168.0 * l3, -24.0 * l2, -3.0 * l1  # the coupling to the node before; c10 is -c01
        d00 = step(c01, n10, minus(c00, n00, 192.0 * (l3 + r3)))
        d01 = step(c01, n11, minus(c00, n01, 36.0 * (r2 - l2)))
        d11 = minus(c01, n01, minus(c11, n11, 9.0 * (l1 + r1)))
        inverse = 1.0 / minus(d01, d01, d00 * d11)
        q00, q01, q11 = d11 * inverse, -d01 * inverse, d00 * inverse
        e00, e01, e11 = 168.0 * r3, -24.0 * r2, -3.0 * r1
        n00, n01 = minus(q01, e01, q00 * e00), step(q01, e11, q00 * e01)
        n10, n11 = minus(q11, e01, q01 * e00), step(q11, e11, q01 * e01)
        work[i, 0], work[i, 1], work[i, 2], work[i, 3] = n00, n01, n10, n11
        left0, right0, left1, right1 = 360.0 * l2 * l2, 360.0 * r2 * r2, 60.0 * l3, 60.0 * r3
        for d in range(dims):
            before, after = points[i, d] - points[i - 1, d], points[i + 1, d] - points[i, d]
            v, a = states[0, i - 1, d], states[1, i - 1, d]
            b0 = step(c01, a, minus(c00, v, step(left0, before, right0 * after)))
            b1 = minus(c11, a, minus(c01, v, minus(left1, before, right1 * after)))
            states[0, i, d], states[1, i, d] = step(q00, b0, q01 * b1), step(q01, b0, q11 * b1)
        l1, l2, l3 = r1, r2, r3
    trouble = 0.0
    for i in range(last - 1, 0, -1):
        n00, n01, n10, n11 = work[i, 0], work[i, 1], work[i, 2], work[i, 3]
        for d in range(dims):
            v, a = states[0, i + 1, d], states[1, i + 1, d]
            states[0, i, d] = minus(n00, v, minus(n01, a, states[0, i, d]))
            states[1, i, d] = minus(n10, v, minus(n11, a, states[1, i, d]))
            trouble += 0.0 * (states[0, i, d] + states[1, i, d])
    return trouble == 0.0
