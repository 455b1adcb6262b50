"""Everything that evaluates one solved map, as flat arrays for the kernels of `evaluation`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.fields.corners import corner_operator, leg_panels, panel_nodes
from coop_drake.fields.density import REFINED_NODES, Density
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import FloatArray, legendre_transform

__all__ = ["LEVELS", "MapArrays", "pack_layers"]

LEVELS = 44  # dyadic rings kept at each corner: down to 6e-14 of its legs


class MapArrays(NamedTuple):
    """Flat arrays of a map.

    Attributes:
        edges: Rows (x0, y0, x1, y1), shape (edges, 4).
        sources: Rows x, y, dx, dy, mu_u, mu_v of the solved nodes, shape (6, n).
        corners: Rows (vertex, back, out, inward bisector as x y, leg, ends of the incoming and the outgoing
            leg as x y), shape (corners, 13). Panels share their ends with these to the last bit.
        corner_index: Rows (first source, ring panels m, leg nodes n, first grid node, first ring break,
            first ring, first tail), shape (corners + 1, 7).
        grid: Rows (distance, weight) of leg grids scaled to [0, 1].
        breaks: Ring breakpoints scaled to [1/2, 1].
        rings: Values then Legendre coefficients of the density on ring panels, shape (., 2, REFINED, 2).
        tails: Weight-corrected density of the legs at every level, shape (., 2).
        panels: Rows (start, end) as x y of regular panels, shape (panels, 4).
        panel_density: As ``rings`` for regular panels, shape (panels, 2, REFINED, 2).
    """

    edges: FloatArray
    sources: FloatArray
    corners: FloatArray
    corner_index: np.ndarray
    grid: FloatArray
    breaks: FloatArray
    rings: FloatArray
    tails: FloatArray
    panels: FloatArray
    panel_density: FloatArray


def pack_layers(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float
) -> MapArrays:
    """Reconstruct the density down every corner and lay all of it out flat."""
    v, ends, nodes = outline.vertices, outline.ends, density.nodes
    tangent = (ends - v) / np.abs(ends - v)
    regular = density.incoming[density.refined.corner_start[-1] :].reshape(-1, REFINED_NODES, 2)
    inward = tangent * np.exp(0.5j * angles)
    leg_ends_in, leg_ends_out, panel_ends = _panel_ends(outline, panels)
    index, grid, breaks, rings, tails = _pack_corners(angles, density, closeness)
    return MapArrays(
        edges=_columns(v, ends),
        sources=np.ascontiguousarray(
            np.column_stack((_columns(nodes.position, nodes.element), density.weighted)).T
        ),
        corners=np.column_stack(
            (
                _columns(v, -tangent[outline.preceding], tangent, inward),
                panels.legs,
                leg_ends_in,
                leg_ends_out,
            )
        ),
        corner_index=index,
        grid=grid,
        breaks=breaks,
        rings=_with_coefficients(rings),
        tails=tails,
        panels=panel_ends,
        panel_density=_with_coefficients(regular),
    )


def _panel_ends(outline: Outline, panels: Panels) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends as x y of the incoming legs, of the outgoing legs (corners, 2), and of the panels (panels, 4).

    Neighbours along an edge get the very same numbers, lest a point between them be missed or counted twice.
    """
    v = outline.vertices
    tangent = (outline.ends - v) / np.abs(outline.ends - v)
    start = v[panels.edge] + panels.start * tangent[panels.edge]
    end = v[panels.edge] + panels.end * tangent[panels.edge]
    following = panels.edge[1:] == panels.edge[:-1]
    end[:-1] = np.where(following, start[1:], end[:-1])
    out = v + panels.legs * tangent
    filled, first, count = np.unique(panels.edge, return_index=True, return_counts=True)
    out[filled] = start[first]
    last = out.copy()  # without a panel between them, the edge's two legs end in the same point
    last[filled] = end[first + count - 1]
    return _columns(last[outline.preceding]), _columns(out), _columns(start, end)


def _columns(*arrays: np.ndarray) -> FloatArray:
    """Real and imaginary parts of complex arrays side by side."""
    return np.column_stack([part for z in arrays for part in (z.real, z.imag)])


def _with_coefficients(values: FloatArray) -> FloatArray:
    """Stack values at Gauss nodes (k, REFINED, 2) with their Legendre coefficients: (k, 2, REFINED, 2)."""
    return np.ascontiguousarray(np.stack((values, legendre_transform(REFINED_NODES) @ values), axis=1))


def _pack_corners(
    angles: FloatArray, density: Density, closeness: float
) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Index table, grids, ring breakpoints, ring densities and tails of all corners."""
    index, rings, tails = [], [], []
    grids: dict[int, tuple[int, int, FloatArray, FloatArray]] = {}
    first = [0, 0, 0, 0]  # grid node, break, ring, tail
    for k, angle in enumerate(angles):
        leg, ring = leg_panels(float(angle), closeness)
        key = len(leg) * 1_000 + len(ring) if len(leg) == 2 else k + 1_000_000
        if key not in grids:
            grids[key] = (first[0], first[1], np.column_stack(panel_nodes(leg, REFINED_NODES)), ring)
            first[0] += len(grids[key][2])
            first[1] += len(ring)
        at_grid, at_break, nodes, _ = grids[key]
        block = slice(density.refined.corner_start[k], density.refined.corner_start[k + 1])
        ring_values, tail_values = _descend(float(angle), closeness, density.incoming[block])
        source = density.nodes.corner_start[k]
        index.append((source, len(ring) - 1, len(nodes), at_grid, at_break, first[2], first[3]))
        rings.append(ring_values)
        tails.append(tail_values)
        first[2] += len(ring_values)
        first[3] += len(tail_values)
    index.append((density.nodes.corner_start[-1], 0, 0, *first))
    return (
        np.array(index, dtype=np.int64),
        np.concatenate([g[2] for g in grids.values()]),
        np.concatenate([g[3] for g in grids.values()]),
        np.concatenate(rings),
        np.concatenate(tails),
    )


def _descend(angle: float, closeness: float, incoming: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Densities of one corner at every level, from the field that comes in on its two legs (2 n, 2).

    Returns:
        Ring densities in the boundary's direction, shape (LEVELS * 2 legs * m, REFINED, 2), and
        weight-corrected densities of the legs, shape ((LEVELS + 1) * 2 legs * n, 2).
    """
    operator = corner_operator(angle, REFINED_NODES, closeness)
    n = len(incoming) // 2
    back, out = incoming[:n], incoming[n:]
    fields = np.empty((LEVELS + 1, 2, n, 2))
    fields[0, 0], fields[0, 1] = 0.5 * (out + back), 0.5 * (out - back)
    for level in range(LEVELS):
        np.matmul(operator.inward, fields[level], out=fields[level + 1])
    ring = _legs(operator.ring @ fields[:-1]).reshape(LEVELS, 2, -1, REFINED_NODES, 2)
    ring[:, 0] = ring[:, 0, :, ::-1]  # the boundary runs towards the corner on the incoming leg
    tail = _legs(operator.compressed @ fields)
    return ring.reshape(-1, REFINED_NODES, 2), tail.reshape(-1, 2)


def _legs(parts: FloatArray) -> FloatArray:
    """Even and odd parts (levels, 2, k, 2) to the incoming and the outgoing leg."""
    legs = np.empty_like(parts)
    np.subtract(parts[:, 0], parts[:, 1], out=legs[:, 0])
    np.add(parts[:, 0], parts[:, 1], out=legs[:, 1])
    return legs
