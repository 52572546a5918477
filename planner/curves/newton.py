"""One polynomial of any degree from Newton's form, as pieces on which its coefficients are well conditioned."""

import numpy as np
from numpy.typing import NDArray

from ..pieces import trimmed
from ..trajectory import Trajectory

Array = NDArray[np.float64]

#: Up to this degree one piece is well conditioned: the coefficients are at most some 1e3 times the values.
ONE_PIECE = 5
#: One polynomial has derivatives of all orders; where it is cut into pieces they agree at least up to this one.
SMOOTH = 6
#: Terms kept of a piece's expansion; on pieces this short further ones are below the last bit.
TERMS = 64


def ordered(nodes: Array) -> NDArray[np.int64]:
    """Return the Leja order of distinct nodes: each next one has the largest product of distances to those before.

    Divided differences in this order keep their digits.
    """
    scaled = 4.0 * (nodes - nodes.mean()) / max(float(np.ptp(nodes)), 1e-300)
    order = [int(np.argmax(np.abs(scaled)))]
    with np.errstate(divide="ignore"):
        size = np.log(np.abs(scaled - scaled[order[0]]))
        for _ in range(len(nodes) - 1):
            order.append(int(np.argmax(size)))
            size = size + np.log(np.abs(scaled - scaled[order[-1]]))
    return np.array(order)


def newton_trajectory(nodes: Array, values: Array, slopes: Array | None, start: float, end: float) -> Trajectory:
    """Return the polynomial through the values (and with the slopes) at distinct nodes, on [start, end].

    Newton's form with divided differences; with slopes every node counts twice. Above degree 5 it is expanded on as
    many pieces as its degree, denser towards the ends, all of them parts of one and the same polynomial.

    Parameters
    ----------
    nodes : (N,), distinct
    values : (N, D)
    slopes : (N, D) or None
    """
    order = ordered(nodes)
    repeat = 1 if slopes is None else 2
    middle, unit = 0.5 * (start + end), 0.25 * (end - start)  # to an interval of length 4, where products stay near one
    z = np.repeat((nodes[order] - middle) / unit, repeat)
    table = np.repeat(values[order], repeat, axis=0)
    rates = None if slopes is None else slopes[order] * unit
    newton = [table[0]]
    for k in range(1, len(z)):
        gap = (z[k:] - z[:-k])[:, None]
        new = np.diff(table, axis=0)
        if k == 1 and rates is not None:
            new[1::2] /= gap[1::2]
            new[0::2] = rates
        else:
            new = new / gap
        table = new
        newton.append(table[0])
    degree = len(z) - 1
    pieces = 1 if degree <= ONE_PIECE else degree
    breaks = middle - 2.0 * unit * np.cos(np.pi * np.arange(pieces + 1) / pieces)
    breaks[0], breaks[-1] = start, end
    breaks = _onto_nodes(breaks, np.sort(nodes))
    s = (breaks - middle) / unit
    left, width = s[:-1, None], np.diff(s)[:, None]
    taylor = np.zeros((min(degree, TERMS) + 1, pieces, values.shape[1]))  # lowest power first
    taylor[0] = newton[-1]
    for k in range(degree - 1, -1, -1):  # Horner with a linear factor: a_k + (left + width u - z_k) (…)
        size = min(degree - k, TERMS) + 1  # further terms are zero as yet
        shifted = (left - z[k]) * taylor[:size]
        shifted[1:] += width * taylor[: size - 1]
        shifted[0] += newton[k]
        taylor[:size] = shifted
    return Trajectory(breaks, trimmed(taylor[::-1]))


def _onto_nodes(breaks: Array, nodes: Array) -> Array:
    """Return the breaks, inner ones that nearly meet a node put there: no sliver is left between the two."""
    inner, reach = breaks[1:-1], 0.05 * np.minimum(np.diff(breaks)[:-1], np.diff(breaks)[1:])
    after = np.clip(np.searchsorted(nodes, inner), 1, max(len(nodes) - 1, 1))
    for k in (after - 1, np.minimum(after, len(nodes) - 1)):
        inner = np.where(np.abs(nodes[k] - inner) <= reach, nodes[k], inner)
    return np.concatenate([breaks[:1], inner, breaks[-1:]])
