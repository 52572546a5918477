"""Every kind of path followed by every method that follows paths: the curve is kept, the limits hold, the rest is
refused by name."""

import numpy as np
import pytest

from planner import Infeasible, InvalidRequest, PlanRequest, Unsupported, certify, plan
from planner import curves as c
from planner.limits import QUANTITIES

HALF = 0.5**0.5
POINTS = np.array([[0.0, 0.3], [1.0, -0.4], [1.5, 0.8], [0.4, 1.2], [-0.5, 0.2]])
U = c.knots(POINTS)
RNG = np.random.default_rng(8)
SLOPES = RNG.normal(size=POINTS.shape)
WEIGHTS = [1.0, 3.0, 0.4, 2.0, 1.0]
UNEVEN = [0, 0, 0, 0.3, 0.8, 1, 1, 1]
CIRCLE_POINTS = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
CIRCLE_OPTIONS = {
    "degree": 2,
    "knots": [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1],
    "weights": [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
}
CIRCLE = c.nurbs(CIRCLE_POINTS, CIRCLE_OPTIONS["weights"], CIRCLE_OPTIONS["knots"], 2)
ON_CIRCLE = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 0]]


def polynomial_of(curve):
    body = {"breaks": curve.breaks.tolist(), "coefficients": curve.powers().tolist()}
    weights = curve.weight_powers()
    return body if weights is None else {**body, "weights": weights.tolist()}


def given_path(curve):
    return {"polynomial": polynomial_of(curve)}


def through(degree, knots=U):
    vector = c.interpolation_knots(knots, degree)
    return c.bspline(c.interpolating_points(knots, POINTS, vector, degree), vector, degree)


QUINTIC = c.quintic_spline(U, POINTS)
SEGMENTS = np.stack([POINTS[[0, 1, 2]], POINTS[[2, 3, 4]]], axis=1)

#: name: (the option, the curve it means, the waypoints, its class)
KINDS = {
    "linear": ({"kind": "linear"}, c.linear(U, POINTS), POINTS, 0),
    "polynomial": ({"kind": "polynomial"}, c.polynomial(U, POINTS), POINTS, 6),
    "hermite": ({"kind": "hermite", "velocities": SLOPES.tolist()}, c.hermite(U, POINTS, SLOPES), POINTS, 6),
    "hermite_default": (
        {"kind": "hermite"},
        c.hermite(U, POINTS, c.tangents(U, POINTS, "finite_difference")),
        POINTS,
        6,
    ),
    "cubic_hermite": (
        {"kind": "cubic_hermite"},
        c.cubic_hermite(U, POINTS, c.tangents(U, POINTS, "catmull_rom")),
        POINTS,
        1,
    ),
    "cubic_hermite_sent": (
        {"kind": "cubic_hermite", "tangents": SLOPES.tolist()},
        c.cubic_hermite(U, POINTS, SLOPES),
        POINTS,
        1,
    ),
    "natural": ({"kind": "cubic_spline", "boundary": "natural"}, c.cubic_spline(U, POINTS, "natural"), POINTS, 2),
    "not_a_knot": (
        {"kind": "cubic_spline", "boundary": "not_a_knot"},
        c.cubic_spline(U, POINTS, "not_a_knot"),
        POINTS,
        2,
    ),
    "quintic_spline": ({"kind": "quintic_spline"}, QUINTIC, POINTS, 4),
    "septic_spline": ({"kind": "septic_spline"}, c.septic_spline(U, POINTS), POINTS, 6),
    "bspline_through": ({"kind": "bspline"}, through(3), POINTS, 2),
    "bspline_through_4": ({"kind": "bspline", "degree": 4}, through(4), POINTS, 3),
    "bspline_points": (
        {"kind": "bspline", "interpolate": False},
        c.bspline(POINTS, c.clamped_knots(5, 3), 3),
        POINTS,
        2,
    ),
    "bspline_uniform": (
        {"kind": "bspline", "interpolate": False, "degree": 2, "knots": list(range(8))},
        c.bspline(POINTS, np.arange(8.0), 2),
        POINTS,
        1,
    ),
    "bezier": ({"kind": "bezier"}, c.bezier(POINTS), POINTS, 6),
    "bezier_composite": (
        {"kind": "bezier", "degree": 2, "knots": [0, 1, 3]},
        c.composite_bezier(SEGMENTS, [0, 1, 3]),
        POINTS,
        0,
    ),
    "nurbs": (
        {"kind": "nurbs", "degree": 2, "knots": UNEVEN, "weights": WEIGHTS},
        c.nurbs(POINTS, WEIGHTS, UNEVEN, 2),
        POINTS,
        1,
    ),
    "nurbs_default": ({"kind": "nurbs"}, c.bspline(POINTS, c.clamped_knots(5, 3), 3), POINTS, 2),
    "circle": ({"kind": "nurbs", **CIRCLE_OPTIONS}, CIRCLE, np.array(CIRCLE_POINTS, dtype=float), 1),
    "given": (given_path(QUINTIC), QUINTIC, POINTS, 4),
    "given_rational": (given_path(CIRCLE), CIRCLE, np.array(ON_CIRCLE, dtype=float), 1),
}
CONTROL_POINTS = ("bspline_points", "bspline_uniform", "bezier", "bezier_composite", "nurbs", "nurbs_default", "circle")
LIMITS = {"velocity": [1.0, 0.7], "acceleration": {"lower": [-2.0, -3.0], "upper": [2.5, 3.0]}, "jerk": 40.0}
RATIONAL = ("nurbs", "circle", "given_rational")


def powers_at(polynomial, times):
    """Values of the polynomial as an answer says it: nothing of the library's evaluation."""
    breaks, powers = np.array(polynomial["breaks"]), np.array(polynomial["coefficients"])
    piece = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
    local = (times - breaks[piece])[:, None]
    above = sum(powers[k][piece] * local**k for k in range(len(powers)))
    if "weights" not in polynomial:
        return above
    return above / sum(np.array(w)[piece][:, None] * local**k for k, w in enumerate(polynomial["weights"]))


def sampled(trajectory, count=4001):
    return np.clip(np.linspace(trajectory.start, trajectory.end, count), trajectory.start, trajectory.end)


def keeps(done, limits):
    """Limits on dense samples of the derivatives, inside the pieces as at their ends."""
    t = done.trajectory
    for order, quantity in enumerate(QUANTITIES):
        if quantity not in limits:
            continue
        bound = limits[quantity]
        low, high = (bound["lower"], bound["upper"]) if isinstance(bound, dict) else (-np.array(bound), np.array(bound))
        left, right = t.ends(order)
        for values in (t(sampled(t), order), left, right):
            assert (values <= np.array(high) * (1 + 1e-9)).all() and (values >= np.array(low) * (1 + 1e-9)).all()


def distance(points, curve, count=20_001):
    """The largest distance of points from the chords of a dense sampling, which miss the curve by some 1e-9."""
    dense, worst = curve(np.union1d(sampled(curve, count), curve.breaks)), 0.0
    for p in points:
        k = int(np.clip(np.argmin(np.linalg.norm(dense - p, axis=1)), 1, len(dense) - 2))
        chords = dense[k - 1 : k + 1], np.diff(dense[k - 1 : k + 2], axis=0)
        share = np.clip(((p - chords[0]) * chords[1]).sum(axis=1) / (chords[1] ** 2).sum(axis=1), 0, 1)
        worst = max(worst, float(np.linalg.norm(chords[0] + share[:, None] * chords[1] - p, axis=1).min()))
    return worst


def holds(done, kind):
    certificate = done.certificate
    assert certificate.holds and certificate.path_deviation <= 1e-9
    assert certificate.basis == ("enclosure" if kind in RATIONAL else "exact")
    _, curve, points, _ = KINDS[kind]
    if kind in CONTROL_POINTS:
        assert done.waypoint_times is None and certificate.waypoint_error is None
    else:
        assert certificate.waypoint_error <= 1e-9
        at = np.clip(done.waypoint_times, done.trajectory.start, done.trajectory.end)
        assert np.abs(done.trajectory(at) - points).max() <= 1e-9
    ends = done.trajectory([done.trajectory.start, done.trajectory.end])
    assert np.abs(ends - curve([curve.start, curve.end])).max() <= 1e-9


# -- every kind ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_time_scaled_follows_every_kind(kind):
    """The path itself at a slower clock: compared with the curve value by value, the limit that binds is met."""
    option, curve, points, smooth = KINDS[kind]
    honoured = dict(list(LIMITS.items())[: smooth + 1])
    done = plan(PlanRequest.of(points, limits=honoured), "time_scaled", {"path": option})
    holds(done, kind)
    keeps(done, honoured)
    t = done.trajectory
    at = sampled(t, 301)
    there = np.clip(curve.start + (at - t.start) * (curve.duration / t.duration), curve.start, curve.end)
    assert np.abs(t(at) - curve(there)).max() <= 1e-9
    assert np.abs(powers_at(polynomial_of(t), at) - curve(there)).max() <= 1e-8
    assert max(check.ratio for check in done.certificate.checks) == pytest.approx(1, abs=1e-9)


#: At rest in the parameter at both ends, where the fastest speed along the parameter is infinite.
AT_REST = ("quintic_spline", "septic_spline", "given")


@pytest.mark.parametrize("kind", [k for k in KINDS if k not in AT_REST])
def test_toppra_follows_every_kind(kind):
    option, curve, points, _ = KINDS[kind]
    limits = {"velocity": LIMITS["velocity"], "acceleration": LIMITS["acceleration"]}
    done = plan(PlanRequest.of(points, limits=limits), "toppra", {"path": option})
    holds(done, kind)
    keeps(done, limits)
    t = done.trajectory
    assert distance(t(sampled(t, 60)), curve) <= 1e-7
    at = sampled(t, 301)
    assert np.abs(powers_at(polynomial_of(t), at) - t(at)).max() <= 1e-8
    assert np.abs(t([t.start, t.end], 1)).max() <= 1e-9
    scaled = plan(PlanRequest.of(points, limits={"velocity": LIMITS["velocity"]}), "time_scaled", {"path": option})
    if kind not in ("linear", "bezier_composite"):  # it stops at corners, uniform scaling flies through them
        assert t.duration <= scaled.trajectory.duration * 4


@pytest.mark.parametrize("kind", AT_REST)
def test_paths_at_rest_at_their_ends_are_followed_or_refused_by_name(kind):
    """The toppra library finds no parameterisation of some; what is named instead does."""
    option, curve, points, _ = KINDS[kind]
    limits = {"velocity": LIMITS["velocity"], "acceleration": LIMITS["acceleration"]}
    request = PlanRequest.of(points, limits=limits)
    try:
        done = plan(request, "toppra", {"path": option})
    except Unsupported as refused:
        assert (refused.method, refused.what) == ("toppra", "path") and "time_optimal_nlp" in refused.alternatives
        done = plan(request, "time_optimal_nlp", {"path": option, "stations": 60})
    holds(done, kind)
    keeps(done, limits)
    assert distance(done.trajectory(sampled(done.trajectory, 60)), curve) <= 1e-7


@pytest.mark.parametrize("kind", ["circle", "bspline_points"])
def test_the_nonlinear_program_follows_them_too(kind):
    option, curve, points, _ = KINDS[kind]
    limits = {"velocity": LIMITS["velocity"], "acceleration": LIMITS["acceleration"]}
    done = plan(PlanRequest.of(points, limits=limits), "time_optimal_nlp", {"path": option, "stations": 60})
    holds(done, kind)
    keeps(done, limits)
    assert distance(done.trajectory(sampled(done.trajectory, 60)), curve) <= 1e-7
    other = plan(PlanRequest.of(points, limits=limits), "toppra", {"path": option})
    assert done.trajectory.duration == pytest.approx(other.trajectory.duration, rel=0.05)


@pytest.mark.parametrize("method", ["time_scaled", "toppra", "time_optimal_nlp"])
@pytest.mark.parametrize("kind", ["circle", "given_rational"])
def test_the_circle_stays_a_circle(method, kind):
    option, _, points, _ = KINDS[kind]
    limits = {"velocity": 1.0, "acceleration": 2.0}
    options = {"path": option, "stations": 60} if method == "time_optimal_nlp" else {"path": option}
    done = plan(PlanRequest.of(points, limits=limits), method, options)
    at = sampled(done.trajectory, 2001)
    assert np.abs(np.linalg.norm(powers_at(polynomial_of(done.trajectory), at), axis=1) - 1).max() <= 1e-9
    assert np.abs(np.linalg.norm(done.trajectory(at), axis=1) - 1).max() <= 1e-9
    assert done.certificate.cost["path_length"] == pytest.approx(2 * np.pi, rel=1e-8)
    assert done.trajectory.duration >= 2 * np.pi / (1.0 * 2**0.5)  # each joint at most 1, so the speed at most √2


@pytest.mark.parametrize("method", ["time_scaled", "toppra"])
@pytest.mark.parametrize("kind", ["circle", "bezier", "given", "bspline_through"])
def test_what_was_planned_is_certified_again(method, kind):
    option, _, points, _ = KINDS[kind]
    limits = {"velocity": 1.0, "acceleration": 2.0}
    done = plan(PlanRequest.of(points, limits=limits), method, {"path": option})
    again = certify(done.trajectory, limits=limits)
    assert again.holds and again.basis == done.certificate.basis
    for ours, theirs in zip(done.certificate.checks, again.checks, strict=True):
        assert (theirs.quantity, theirs.joint) == (ours.quantity, ours.joint)
        assert theirs.value == pytest.approx(ours.value, rel=1e-9)
    reached = abs(again.checks[0].value)
    assert not certify(done.trajectory, limits={"velocity": reached * (1 - 1e-5)}).holds
    assert certify(done.trajectory, limits={"velocity": reached}).holds


# -- options -------------------------------------------------------------------------------------------------------

SPACED = (
    "linear",
    "polynomial",
    "hermite",
    "cubic_hermite",
    "cubic_spline",
    "quintic_spline",
    "septic_spline",
    "bspline",
)


@pytest.mark.parametrize("kind", SPACED)
@pytest.mark.parametrize("spacing", ["centripetal", "chord_length", "uniform"])
def test_spacing_is_that_of_the_knots(kind, spacing):
    """The same path as with the knots sent, and not that of another spacing."""
    limits = {"velocity": 1.0}
    request = PlanRequest.of(POINTS, limits=limits)
    done = plan(request, "time_scaled", {"path": {"kind": kind, "spacing": spacing}})
    knots = c.knots(POINTS, spacing)
    same = plan(request, "time_scaled", {"path": {"kind": kind, "knots": knots.tolist()}})
    at = sampled(done.trajectory, 41)
    assert done.trajectory.duration == pytest.approx(same.trajectory.duration, rel=1e-12)
    assert np.abs(done.trajectory(at) - same.trajectory(np.minimum(at, same.trajectory.end))).max() <= 1e-9
    steps = np.diff(done.waypoint_times) / done.trajectory.duration
    np.testing.assert_allclose(steps, np.diff(knots), atol=1e-9)
    power = {"centripetal": 0.5, "chord_length": 1.0, "uniform": 0.0}[spacing]
    chords = np.linalg.norm(np.diff(POINTS, axis=0), axis=1) ** power
    np.testing.assert_allclose(steps, chords / chords.sum(), atol=1e-9)


@pytest.mark.parametrize("scale, shift", [(1.0, 0.0), (7.0, -3.0)])
def test_only_the_shape_of_the_knots_counts(scale, shift):
    """Knots stretched and shifted are the same path; the timing that keeps the limits is the same too."""
    limits = {"velocity": 1.0, "acceleration": 2.0}
    knots = scale * np.array([0, 0.1, 0.5, 0.7, 1.0]) + shift
    done = plan(
        PlanRequest.of(POINTS, limits=limits), "toppra", {"path": {"kind": "cubic_spline", "knots": knots.tolist()}}
    )
    plain = {"path": {"kind": "cubic_spline", "knots": [0, 0.1, 0.5, 0.7, 1.0]}}
    assert done.trajectory.duration == pytest.approx(
        plan(PlanRequest.of(POINTS, limits=limits), "toppra", plain).trajectory.duration, rel=1e-6
    )


def test_times_are_the_knots_and_the_clock():
    times = [2.0, 3.0, 3.5, 5.0, 6.0]
    for kind, curve in (("quintic_spline", c.quintic_spline), ("polynomial", c.polynomial)):
        done = plan(
            PlanRequest.of(POINTS, times=times, limits={"velocity": 1e3}), "time_scaled", {"path": {"kind": kind}}
        )
        assert done.waypoint_times.tolist() == times
        at = np.linspace(2, 6, 50)
        assert np.abs(done.trajectory(at) - curve(times, POINTS)(at)).max() <= 1e-9


@pytest.mark.parametrize("kind", SPACED)
def test_spacing_beside_knots_is_a_conflict(kind):
    path = {"kind": kind, "spacing": "uniform", "knots": U.tolist()}
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of(POINTS, limits={"velocity": 1.0}), "time_scaled", {"path": path})
    assert [(e.field, e.code) for e in caught.value.errors] == [("/options/path/spacing", "conflict")]


@pytest.mark.parametrize("kind", ["cubic_spline", "bspline"])
def test_spacing_beside_times_is_a_conflict(kind):
    """The times are the knots: nothing is left to be spread, and nothing given is ignored."""
    path = {"kind": kind, "spacing": "uniform"}
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of(POINTS, times=[0, 1, 2, 3, 4], limits={"velocity": 1.0}), "time_scaled", {"path": path})
    assert [(e.field, e.code) for e in caught.value.errors] == [("/options/path/spacing", "conflict")]


@pytest.mark.parametrize(
    "path, field, code",
    [
        ({"kind": "linear", "knots": [0, 1, 2, 3]}, "/options/path/knots", "shape_mismatch"),
        ({"kind": "linear", "knots": [0, 1, 2, 2, 3]}, "/options/path/knots/3", "not_increasing"),
        ({"kind": "bspline", "knots": [0, 1, 2, 3]}, "/options/path/knots", "shape_mismatch"),
        ({"kind": "bspline", "degree": 5}, "/waypoints", "too_few_points"),
        ({"kind": "bspline", "degree": 0}, "/options/path/degree", "bad_degree"),
        ({"kind": "bspline", "interpolate": False, "knots": [0, 1, 2, 3, 4]}, "/options/path/knots", "bad_knots"),
        ({"kind": "bspline", "interpolate": False, "spacing": "uniform"}, "/options/path/spacing", "conflict"),
        ({"kind": "bezier", "degree": 3}, "/options/path/degree", "bad_degree"),
        ({"kind": "bezier", "degree": 2, "joints": "C1"}, "/waypoints", "conflict"),
        ({"kind": "bezier", "knots": [1, 0]}, "/options/path/knots", "bad_knots"),
        ({"kind": "nurbs", "weights": [1, 1, 0, 1, 1]}, "/options/path/weights/2", "bad_weights"),
        ({"kind": "nurbs", "weights": [1, 1, 1]}, "/options/path/weights", "shape_mismatch"),
        ({"kind": "nurbs", "knots": [0, 0, 0, 0, 1, 0.5, 1, 1, 1]}, "/options/path/knots/5", "bad_knots"),
        ({"kind": "hermite", "velocities": [[0, 0]] * 4}, "/options/path/velocities", "shape_mismatch"),
    ],
)
def test_bad_path_options_are_told_where_they_are(path, field, code):
    for method, more in (("time_scaled", {}), ("toppra", {"acceleration": 2.0})):
        with pytest.raises(InvalidRequest) as caught:
            plan(PlanRequest.of(POINTS, limits={"velocity": 1.0, **more}), method, {"path": path})
        assert [(e.field, e.code) for e in caught.value.errors] == [(field, code)]


CIRCLE_BODY = polynomial_of(CIRCLE)


@pytest.mark.parametrize(
    "path, points, field, code",
    [
        ({**CIRCLE_BODY, "weights": CIRCLE_BODY["weights"][:2]}, ON_CIRCLE, "/weights", "shape_mismatch"),
        ({**CIRCLE_BODY, "weights": [w[:3] for w in CIRCLE_BODY["weights"]]}, ON_CIRCLE, "/weights", "shape_mismatch"),
        ({**CIRCLE_BODY, "weights": [[-1.0] * 4, *CIRCLE_BODY["weights"][1:]]}, ON_CIRCLE, "/weights", "bad_weights"),
        ({**CIRCLE_BODY, "weights": [[1.0] * 4, [-16.0] * 4, [0.0] * 4]}, ON_CIRCLE, "/weights", "bad_weights"),
        ({**CIRCLE_BODY, "breaks": [0, 0.25, 0.5, 0.5, 1]}, ON_CIRCLE, "/breaks", "not_increasing"),
        ({**CIRCLE_BODY, "coefficients": CIRCLE_BODY["coefficients"][0]}, ON_CIRCLE, "/coefficients", None),
        ({**CIRCLE_BODY, "weights": [[2.0] * 4, *CIRCLE_BODY["weights"][1:]]}, ON_CIRCLE, None, "conflict"),
    ],
)
def test_bad_given_paths(path, points, field, code):
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of(points, limits={"velocity": 1.0}), "time_scaled", {"path": {"polynomial": path}})
    error = caught.value.errors[0]
    assert code is None or error.code == code
    expected = "/waypoints" if field is None else "/options/path/polynomial" + field
    assert error.field.startswith(expected), error


def test_waypoints_beside_a_rational_path_are_refused():
    """The first that is missed is named, with the distance."""
    points = np.array(ON_CIRCLE, dtype=float)
    points[2] = [-1.01, 0]
    with pytest.raises(InvalidRequest) as caught:
        plan(PlanRequest.of(points, limits={"velocity": 1.0}), "time_scaled", {"path": given_path(CIRCLE)})
    error = caught.value.errors[0]
    assert (error.field, error.code) == ("/waypoints/2", "conflict") and "0.01" in error.reason
    knots = [0, 0.125, 0.5, 1]
    on = CIRCLE(knots)
    done = plan(
        PlanRequest.of(on, limits={"velocity": 1.0}), "time_scaled", {"path": {**given_path(CIRCLE), "knots": knots}}
    )
    np.testing.assert_allclose(done.waypoint_times / done.trajectory.duration, knots, atol=1e-12)


# -- what a path cannot honour -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quantity", ["acceleration", "jerk"])
def test_uniform_scaling_refuses_what_is_unbounded_by_name(kind, quantity):
    """Where the class is known beforehand: unsupported; where only the numbers tell: infeasible."""
    option, curve, points, smooth = KINDS[kind]
    order = QUANTITIES.index(quantity)
    request = PlanRequest.of(points, limits={quantity: 5.0})
    if order <= smooth + 1:
        assert plan(request, "time_scaled", {"path": option}).certificate.holds
        return
    with pytest.raises((Unsupported, Infeasible)) as caught:
        plan(request, "time_scaled", {"path": option})
    found = caught.value
    if isinstance(found, Unsupported):
        assert found.what == quantity and kind in ("linear", "cubic_hermite", "cubic_hermite_sent")
    else:
        assert found.quantity == quantity and found.certified
        assert kind in (*CONTROL_POINTS, "given", "given_rational")


@pytest.mark.parametrize("method", ["time_scaled", "toppra", "time_optimal_nlp"])
@pytest.mark.parametrize("kind", CONTROL_POINTS)
def test_control_points_have_no_segments_and_no_times(method, kind):
    option, _, points, _ = KINDS[kind]
    limits = {"velocity": 1.0} if method == "time_scaled" else {"velocity": 1.0, "acceleration": 2.0}
    gaps = len(points) - 1
    for name, value in (
        ("segment_limits", [{"velocity": 0.5}] + [None] * (gaps - 1)),
        ("segment_durations", [{"min": 1.0}] + [None] * (gaps - 1)),
        ("times", list(range(gaps + 1))),
    ):
        with pytest.raises(Unsupported) as caught:
            plan(PlanRequest.of(points, limits=limits, **{name: value}), method, {"path": option})
        assert caught.value.what == name and caught.value.method == method


def test_toppra_takes_no_jerk_and_says_who_does():
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": 30.0}
    with pytest.raises(Unsupported) as caught:
        plan(PlanRequest.of(POINTS, limits=limits), "toppra", {"path": {"kind": "bezier"}})
    assert caught.value.what == "jerk" and "time_optimal_nlp" in caught.value.alternatives


def test_segment_limits_on_a_path_through_waypoints_hold_where_asked():
    path = {"path": {"kind": "quintic_spline"}}
    free = plan(PlanRequest.of(POINTS, limits={"velocity": 1.0}), "time_scaled", path)

    def peaks(done):
        t, at = done.trajectory, done.waypoint_times
        spans = zip(at[:-1], at[1:], strict=True)
        return np.array([np.abs(t(np.clip(np.linspace(a, b, 1001), t.start, t.end), 1)).max() for a, b in spans])

    slowest = int(np.argmin(peaks(free)))
    bound = 0.7 * float(peaks(free).min())
    segment_limits = [{"velocity": bound} if i == slowest else None for i in range(4)]
    done = plan(PlanRequest.of(POINTS, limits={"velocity": 1.0}, segment_limits=segment_limits), "time_scaled", path)
    assert peaks(done)[slowest] == pytest.approx(bound, rel=1e-4) and peaks(done)[slowest] <= bound * (1 + 1e-9)
    assert peaks(done).max() > bound * 1.1
    assert done.trajectory.duration == pytest.approx(free.trajectory.duration / 0.7, rel=1e-4)


#: A rational path that is fast at first and slow later: (curve, waypoints at its breaks).
HURRY = c.nurbs(
    [[0], [40], [80], [81], [81.6], [81.2], [82]], [1, 2, 1, 3, 1, 2, 1], [0, 0, 0, 0.2, 0.4, 0.5, 0.7, 1, 1, 1], 2
)


@pytest.mark.parametrize("segment", range(5))
def test_segment_limits_of_a_rational_path_are_met_and_no_slower_than_that(segment):
    """Each segment's own largest value counts, however large those of the others are."""
    points = HURRY(HURRY.breaks)
    limits = [{"velocity": 0.01} if i == segment else None for i in range(5)]
    request = PlanRequest.of(points, limits={"velocity": 1e6}, segment_limits=limits)
    done = plan(request, "time_scaled", {"path": given_path(HURRY)})
    t, (a, b) = done.trajectory, done.waypoint_times[segment : segment + 2]
    at = np.clip(a + (b - a) * (0.5 - 0.5 * np.cos(np.pi * np.linspace(1e-5, 1 - 1e-5, 20_001))), t.start, t.end)
    reached = float(np.abs(t(at, 1)).max())
    assert 0.01 * (1 - 1e-6) <= reached <= 0.01 * (1 + 1e-9)


def test_position_limits_of_a_segment_of_a_rational_path_are_judged_by_what_it_reaches():
    """The fourth segment's top is 81.40695; a limit just above it is no reason to refuse the path."""
    points = HURRY(HURRY.breaks)
    top = float(HURRY(np.linspace(HURRY.breaks[3], HURRY.breaks[4], 100_001))[:, 0].max())
    assert top == pytest.approx(81.40695, abs=1e-5) and top > points[3:5].max() + 0.03
    for upper, fits in ((top + 0.01, True), (top - 0.01, False)):
        limits = [{"position": {"lower": 0, "upper": upper}} if i == 3 else None for i in range(5)]
        request = PlanRequest.of(points, limits={"velocity": 1.0}, segment_limits=limits)
        if fits:
            assert plan(request, "time_scaled", {"path": given_path(HURRY)}).certificate.holds
            continue
        with pytest.raises(Infeasible) as caught:
            plan(request, "time_scaled", {"path": given_path(HURRY)})
        assert caught.value.segment == 3 and caught.value.needed == pytest.approx(top, abs=1e-6)


def test_durations_of_paths_by_control_points():
    request = {"limits": {"velocity": 1.0, "acceleration": 2.0}, "duration": {"min": 30, "max": 30}}
    for method in ("time_scaled", "toppra"):
        done = plan(PlanRequest.of(CIRCLE_POINTS, **request), method, {"path": KINDS["circle"][0]})
        assert done.trajectory.duration == pytest.approx(30, rel=1e-9)
        with pytest.raises(Infeasible) as caught:
            plan(
                PlanRequest.of(CIRCLE_POINTS, **{**request, "duration": {"max": 1}}),
                method,
                {"path": KINDS["circle"][0]},
            )
        assert caught.value.minimum_duration > 1


def test_position_limits_count_for_the_curve_not_for_its_control_points():
    limits = {"velocity": 1.0, "position": {"lower": [-10, -10], "upper": [10, 1.0]}}
    points = [[0, 0], [1, 2], [3, 2], [4, 0]]  # the curve's top is at 1.5
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of(points, limits=limits), "time_scaled", {"path": {"kind": "bezier"}})
    assert caught.value.quantity == "position" and caught.value.needed == pytest.approx(1.5, abs=1e-9)
    limits["position"]["upper"] = [10, 1.6]
    assert plan(PlanRequest.of(points, limits=limits), "time_scaled", {"path": {"kind": "bezier"}}).certificate.holds
    limits["position"] = {"lower": -0.9, "upper": 1.1}
    with pytest.raises(Infeasible) as caught:
        plan(PlanRequest.of(CIRCLE_POINTS, limits=limits), "time_scaled", {"path": KINDS["circle"][0]})
    assert caught.value.needed == pytest.approx(-1, abs=1e-9)
