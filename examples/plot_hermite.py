"""Osculating polynomial: one polynomial that takes positions and velocities.

Let lᵢ be the Lagrange polynomial that is 1 at node i and 0 at the others. Its square is flat at the others too, and a
linear factor sets value and slope at node i itself. So with N nodes the polynomial of degree 2N − 1

    p(t) = Σᵢ xᵢ [1 − 2 lᵢ'(tᵢ) (t − tᵢ)] lᵢ(t)²  +  vᵢ (t − tᵢ) lᵢ(t)²

has p(tᵢ) = xᵢ and p'(tᵢ) = vᵢ. It is computed by Newton's divided differences with every node doubled.

**The figure.** A swing, x = sin 3t · e^(−t/2), is known at five instants. Positions alone give a quartic that is
visibly off; positions and velocities give one polynomial of degree 9 that is hard to tell from the swing, or a chain
of four cubics (`cubic_hermite`). Below, the errors: the single polynomial wins where the motion is smooth and the
nodes are few.

**When to use it.** For a handful of nodes with trusted velocities, where every derivative must be continuous.

**When not.** For many nodes: what makes one polynomial swing is squared here. Nor with guessed velocities: it follows
them to the letter, so an error in one velocity is felt on the whole interval.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from planner import PlanRequest, plan


def swing(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of a damped swing."""
    damped = np.exp(-t / 2)
    return np.sin(3 * t) * damped, (3 * np.cos(3 * t) - 0.5 * np.sin(3 * t)) * damped


def figure() -> Figure:
    """Draw three interpolants of a damped swing, and their errors."""
    nodes, t = np.linspace(0, 3, 5), np.linspace(0, 3, 601)
    position, velocity = swing(nodes)
    request = PlanRequest.of(position, times=nodes)
    rates = velocity[:, None].tolist()  # one row a waypoint
    answers = {
        "positions only, degree 4": plan(request, "polynomial"),
        "with velocities, four cubics": plan(request, "cubic_hermite", {"tangents": rates}),
        "with velocities, degree 9": plan(request, "hermite", {"velocities": rates}),
    }

    fig, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    above.plot(t, swing(t)[0], "k", linewidth=4, alpha=0.25, label="the swing")
    for color, style, (name, answer) in zip(("C1", "C2", "C0"), ("--", "-.", "-"), answers.items(), strict=True):
        x = answer.trajectory(t)[:, 0]
        above.plot(t, x, style, color=color, label=name)
        below.semilogy(t, np.maximum(np.abs(x - swing(t)[0]), 1e-8), style, color=color)
    for at, x, v in zip(nodes, position, velocity, strict=True):
        above.plot([at - 0.12, at + 0.12], [x - 0.12 * v, x + 0.12 * v], "k", linewidth=2.5)
    above.plot(nodes, position, "ko", label="given: positions, velocities as slopes")
    above.set(ylabel="position (rad)", title="a damped swing from five instants")
    below.set(xlabel="time (s)", ylabel="error (rad)", ylim=(1e-6, 1))
    above.legend(ncols=2)
    return fig


if __name__ == "__main__":
    from gallery import show

    show(figure)
