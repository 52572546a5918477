"""Minimum jerk waypoint by waypoint: the reported difference is a bound, and nothing grows."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner import Trajectory
from planner.curves import quintic_spline
from planner.errors import InvalidRequest
from planner.smoothing.stream import Stream

Array = NDArray[np.float64]


def run(t: Array, x: Array, start: Array, window: int, batches: list[int]) -> tuple[Stream, list[Trajectory]]:
    """Return the stream of all waypoints, appended in batches of these sizes, in turn, and the pieces committed."""
    stream, parts, i = Stream.begin(t[0], x[0], *start, window=window), [], 1
    while i < len(t):
        size = batches[i % len(batches)]
        stream = stream.append(t[i : i + size], x[i : i + size])
        if stream.committed is not None:
            parts.append(stream.committed)
        i += size
    return stream, parts


def problem(seed: int, n: int, dims: int, ratio: float) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    t = rng.uniform(-10, 10) + np.cumsum(ratio ** rng.uniform(-0.5, 0.5, n))
    ends = rng.standard_normal((2, 2, dims))
    return t, rng.standard_normal((n, dims)) * 10.0 ** rng.uniform(-3, 3), ends[0], ends[1]


def distance(one: Trajectory, other: Trajectory) -> Array:
    """Return the largest difference of the first three derivatives, (3, D), seen at many times."""
    inner = one.breaks[:-1, None] + np.diff(one.breaks)[:, None] * np.linspace(0, 0.999, 17)
    at = np.minimum(np.append(inner.ravel(), one.end), other.end)
    return np.asarray(np.abs(one.states(at, 3) - other.states(at, 3)).max(axis=1))


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 150),
    dims=st.integers(1, 3),
    window=st.integers(1, 40),
    ratio=st.floats(1, 30),
    batches=st.lists(st.integers(1, 50), min_size=1, max_size=3),
)
def test_difference_is_a_bound(seed: int, n: int, dims: int, window: int, ratio: float, batches: list[int]) -> None:
    t, x, start, end = problem(seed, n, dims, ratio)
    stream, parts = run(t, x, start, window, batches)
    whole = Trajectory.concatenate([*parts, stream.tail(*end)])
    assert (whole.breaks == t).all()
    assert (distance(whole, quintic_spline(t, x, start, end)) <= stream.difference(*end)).all()


@pytest.mark.parametrize("seed", range(3))
def test_difference_is_a_bound_after_every_append(seed: int) -> None:
    """Of old pieces too, while points jump far away and steps change their scale."""
    t, x, start, _ = problem(seed, 120, 2, 30.0)
    t[60:] = t[59] + np.cumsum(np.diff(t[59:]) * 1e-3)
    x[90:] *= 1e4
    stream, parts = Stream.begin(t[0], x[0], *start, window=6), []
    for i in range(1, len(t)):
        stream = stream.append(t[i], x[i])
        parts += [] if stream.committed is None else [stream.committed]
        whole = Trajectory.concatenate([*parts, stream.tail()])
        full = quintic_spline(t[: i + 1], x[: i + 1], start)
        assert (distance(whole, full) <= stream.difference()).all(), i


@given(seed=st.integers(0, 2**32 - 1), window=st.integers(4, 40))
def test_bound_is_not_loose_and_falls_with_the_window(seed: int, window: int) -> None:
    t, x, *_ = problem(seed, 150, 1, 2.0)
    stream, parts = run(t, x, np.zeros((2, 1)), window, [1])
    found = stream.difference()[0]
    seen = distance(Trajectory.concatenate([*parts, stream.tail()]), quintic_spline(t, x))[0]
    size = np.abs(x).max()
    assert found <= 10 * seen + 1e-11 * size
    assert found <= 30 * 0.5**window * size + 1e-11 * size


@given(seed=st.integers(0, 2**32 - 1), window=st.integers(1, 10))
def test_curve_is_smooth_and_committed_pieces_stay(seed: int, window: int) -> None:
    t, x, start, end = problem(seed, 60, 2, 5.0)
    stream, parts = run(t, x, start, window, [1, 4])
    parts.append(stream.tail(*end))
    whole = Trajectory.concatenate(parts)
    size = [whole.extrema(3).peak(m).max() for m in range(3)]
    for m in range(3):
        assert np.abs(whole.jumps(m)).max() <= 1e-11 * size[m]
        for time, state in ((t[0], start), (t[-1], end)):
            assert m == 0 or np.abs(whole(time, m) - state[m - 1]).max() <= 1e-11 * size[m]
    assert np.abs(whole(t) - x).max() <= 1e-12 * size[0]


def test_without_anything_committed_it_is_the_spline() -> None:
    t, x, start, end = problem(1, 20, 3, 5.0)
    stream, parts = run(t, x, start, 32, [1])
    assert not parts
    full = quintic_spline(t, x, start, end)
    assert np.abs(stream.tail(*end).coefficients - full.coefficients).max() < 1e-12 * np.abs(full.coefficients).max()
    assert (stream.difference(*end)[0] < 1e-10 * np.abs(x).max()).all()


def numbers_held(stream: Stream) -> int:
    arrays = [v for v in vars(stream).values() if isinstance(v, np.ndarray)]
    assert all(a.base is None or a.base.size <= 2 * a.size for a in arrays)  # no view of something large
    return sum(a.size for a in arrays)


def test_nothing_grows_with_the_number_of_waypoints() -> None:
    """Every append goes over what is held and appended, once or twice; so its work is bounded as that is."""
    rng, window = np.random.default_rng(0), 8
    stream, held = Stream.begin(0.0, np.zeros(2), window=window), []
    for i in range(1, 400):
        stream = stream.append(float(i), rng.standard_normal(2))
        held.append(numbers_held(stream))
        assert stream.tail().pieces <= window
        assert stream.committed is None or stream.committed.pieces == 1
    assert max(held) == held[3 * window] == held[-1]
    assert stream.count == 400
    stream = stream.append(np.arange(400.0, 1400.0), rng.standard_normal((1000, 2)))
    assert numbers_held(stream) == held[-1] and stream.count == 1400
    stream = stream.append(1400.0, [0.0, 0.0])
    assert stream.committed is not None and stream.committed.pieces == 1


def test_appending_leaves_the_stream_as_it_was() -> None:
    stream = Stream.begin(0, [0.0], window=2).append([1, 2, 3, 4, 5], [1.0, 0.0, 2.0, 1.0, 0.0])
    before, bound = stream.tail().coefficients.copy(), stream.difference()
    one, other = stream.append(6, [3.0]), stream.append(6, [3.0])
    assert (stream.tail().coefficients == before).all() and (stream.difference() == bound).all()
    assert (one.tail().coefficients == other.tail().coefficients).all()


def test_a_single_waypoint_is_held() -> None:
    stream = Stream.begin(2.0, [1.0, 2.0])
    assert stream.committed is None and stream.count == 1
    assert (stream.tail()(2.0) == [1.0, 2.0]).all() and (stream.difference() <= 1e-12).all()


@pytest.mark.parametrize(
    ("times", "points", "field", "code"),
    [
        ([2.0], [[0.0, 0.0]], "/times/0", "not_increasing"),
        ([3.0, 3.0], np.zeros((2, 2)), "/times/1", "not_increasing"),
        ([3.0, 4.0], np.zeros((1, 2)), "/times", "shape_mismatch"),
        (3.0, [0.0], "/times", "shape_mismatch"),
        ([], np.zeros((0, 2)), "/times", "shape_mismatch"),
        (3.0, [np.nan, 0.0], "/waypoints", "not_finite"),
        (np.inf, [0.0, 0.0], "/times", "not_finite"),
        (2.0 + 1e-7, [0.0, 0.0], "/times/0", "out_of_range"),
        ([3.0, 3.0 + 1e-7, 4.0], np.zeros((3, 2)), "/times/1", "out_of_range"),
    ],
)
def test_refused(times: Any, points: Any, field: str, code: str) -> None:
    stream = Stream.begin(0.0, [0.0, 0.0]).append([1.0, 2.0], np.ones((2, 2)))
    with pytest.raises(InvalidRequest) as refused:
        stream.append(times, points)
    assert [(e.field, e.code) for e in refused.value.errors] == [(field, code)]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"window": 0}, "out_of_range"),
        ({"time": np.nan}, "not_finite"),
        ({"point": [np.inf]}, "not_finite"),
        ({"point": []}, "shape_mismatch"),
        ({"velocity": [1.0, 2.0]}, "shape_mismatch"),
        ({"acceleration": [np.nan]}, "not_finite"),
    ],
)
def test_refused_at_the_start(arguments: dict[str, Any], code: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        Stream.begin(**({"time": 0.0, "point": [0.0]} | arguments))
    assert refused.value.errors[0].code == code
