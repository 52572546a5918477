"""The rows that forbid broken limits, against the statement's own rows and the curve's exact extrema."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import PlanRequest
from planner.smoothing.posing import pose
from planner.smoothing.rounds import Cuts

SEEDS = st.integers(0, 2**32 - 1)


def made(seed):
    """Return cuts of a request with limits of all kinds, at fractions of what a random curve does, and that curve."""
    rng = np.random.default_rng(seed)
    n, dims, order = int(rng.integers(2, 8)), int(rng.integers(1, 4)), int(rng.integers(2, 5))
    points, times = rng.normal(size=(n, dims)) + rng.normal(), np.cumsum(10 ** rng.uniform(-0.5, 0.5, n))
    limits = {q: {"lower": -float(x), "upper": float(y)} for q, x, y in
              zip(("velocity", "acceleration", "jerk"), 10 ** rng.uniform(-1, 2, 3), 10 ** rng.uniform(-1, 2, 3),
                  strict=True)}  # fmt: skip
    limits["position"] = {"lower": float(points.min() - 1e-3), "upper": float(points.max() + rng.random())}
    if order == 2:
        del limits["jerk"]
    body = {"times": times, "limits": limits}
    if rng.random() < 0.5:
        body["tube"] = float(10 ** rng.uniform(-2, 0))
    if rng.random() < 0.5:
        body["waypoint_tolerance"] = float(10 ** rng.uniform(-2, 0))
    posed = pose(PlanRequest.of(points, **body), order, str(rng.choice(["fixed", "free"])), int(rng.integers(1, 3)))
    return posed, Cuts.of(posed, posed.limits, 1e-9), rng.normal(size=posed.statement.size), rng


def rows_of(rows, y):
    filled = np.where(rows.columns >= 0, np.append(y, 0.0)[rows.columns], 0.0)
    return (rows.values * filled).sum(axis=1), (rows.bends * filled).sum(axis=1) + rows.offsets


@given(SEEDS, st.booleans())
def test_rows_are_the_statements(seed, curved):
    posed, cuts, y, rng = made(seed)
    rows, _ = cuts.at(y, 0.0, curved)
    program = cuts.program(rows, own=False)
    for point in (y, rng.normal(size=len(y))):
        found, _ = rows_of(rows, point)
        size = abs(program.rows) @ abs(point) + abs(program.upper) + 1.0
        assert (abs(found - program.rows @ point) <= 1e-9 * size).all()
    assert (abs(rows.upper - program.upper) <= 1e-9 * (1 + abs(program.upper))).all()


@given(SEEDS)
def test_every_broken_limit_gets_a_row_at_its_extremum(seed):
    """By the extrema of the combination of joints on every gap; the worst excess is told."""
    posed, cuts, y, _ = made(seed)
    rows, worst = cuts.at(y, 0.0, False)
    motion, limits = posed.motion(y), cuts.limits
    places = {(g, c, s): u for g, c, s, u in zip(*rows.place, rows.u, strict=True)}
    most = -np.inf
    for c, order in enumerate(limits.orders):
        for i, h in enumerate(posed.statement.h):
            along = motion.coefficients[:, i : i + 1] @ limits.directions[c, i]
            piece = type(motion)(np.array([0.0, h]), along[:, :, None])
            found = piece.extrema(4)
            if limits.everywhere[c]:
                ends = found.high[order, 0, 0], found.low[order, 0, 0]
                at = found.at_high[order, 0, 0] / h, found.at_low[order, 0, 0] / h
            else:
                ends, at = (piece(0.0, order)[0],) * 2, (0.0, 0.0)
            size = limits.sizes[c, i]
            for side, value, bound, u in zip((1, -1), ends, (cuts.bounds[3], cuts.bounds[2]), at, strict=True):
                excess = side * (value - bound[c, i]) / size
                noise = 1e-9 * (1 + np.abs(piece.coefficients).max() / (h**order * size))
                if abs(excess) <= noise:
                    continue
                assert ((i, c, side) in places) == (excess > 0), (seed, i, c, side, excess)
                if excess > 0:
                    most = max(most, excess)
                    there = piece(min(places[i, c, side] * h, h), order)[0]
                    assert there == pytest.approx(value, abs=1e-7 * noise * 1e9 * size), (seed, u)
    assert worst <= 0 or worst == pytest.approx(most, rel=1e-6, abs=1e-6) or most == -np.inf


@given(SEEDS)
def test_bent_rows_follow_the_extremum(seed):
    """Where the curve moves by e, the extremum is the bent row's value but for e³, the plain row's but for e²."""
    posed, cuts, y, rng = made(seed)
    rows, worst = cuts.at(y, 0.0, True)
    bent = np.flatnonzero(rows.kappa > 0)
    if not len(bent):
        return
    _, slope = rows_of(rows, y)
    scale = 1 + np.abs(rows.upper[bent])
    assert (rows.kappa[bent] * slope[bent] ** 2 <= 1e-9 * scale).all()  # an extremum: no slope
    step = rng.normal(size=len(y)) * 1e-4
    moved, after = posed.motion(y + step), rows_of(rows, y + step)
    for r in bent:
        gap, c, side = rows.place[:, r]
        order, h, size = int(cuts.limits.orders[c]), posed.statement.h[gap], cuts.limits.sizes[c, gap]
        u = np.clip(rows.u[r] + np.linspace(-0.01, 0.01, 4001), 0, 1)
        along = cuts.limits.directions[c, gap]
        piece = type(moved)(np.array([0.0, 1.0]), moved.coefficients[:, gap : gap + 1])
        values = side * (piece(u, order) @ along) / h**order / size
        shift = abs(rows.kappa[r] * after[1][r])
        if shift > 5e-3 or rows.u[r] < 0.02 or rows.u[r] > 0.98:
            continue
        plain = after[0][r] - rows.upper[r] + side * cuts.bounds[1 if side > 0 else 0][c, gap] / size
        second = 0.5 * rows.kappa[r] * after[1][r] ** 2
        third = np.abs(piece(u, min(order + 3, piece.degree)) @ along).max() / h**order / size
        room = 1e-9 * (1 + np.abs(values).max()) + 2 * second * shift * (1 + third * rows.kappa[r]) + 1e-6 * second
        assert values.max() == pytest.approx(plain + second, abs=room + 30 * second * 1e-2), (seed, r)


def test_nothing_touched_needs_no_row():
    request = PlanRequest.of([[0.0], [1.0], [0.5]], times=[0, 1, 2], limits={"velocity": 1e3, "acceleration": 1e4})
    posed = pose(request, 3, "fixed", 1)
    rows, worst = Cuts.of(posed, posed.limits, 1e-9).at(np.zeros(posed.statement.size), 0.0, True)
    assert len(rows.u) == 0 and worst == -np.inf
