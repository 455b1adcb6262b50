"""Builds the arrays of a map from a solved density: refined panels, corners at all scales, far fields."""

from __future__ import annotations

import numpy as np

from coop_drake.fields.corners import corner_operator, leg_panels, panel_nodes
from coop_drake.fields.density import Density
from coop_drake.fields.expansions import grown
from coop_drake.fields.flat_map import LEVELS, ON_BOUNDARY, ORDER, REFINED_NODES, MapArrays
from coop_drake.fields.nodes import Nodes
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import legendre_transform
from coop_drake.fields.refinement import refine
from coop_drake.tree.pose import FloatArray, IntArray

_MARGIN = 1.0 + 1e-9
"""Size of the quadtree's square per size of the domain, so that rounding leaves no vertex outside [-]."""


def pack_layers(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float
) -> MapArrays:
    """Everything that evaluates the map of a density; arguments as in `solve_density`."""
    m = grown(_bare(outline, panels, angles, density), opened=False)
    refined, incoming = refine(outline, panels, angles, density, closeness, m)
    sources = density.nodes.corner_start
    regular = incoming[refined.corner_start[-1] :].reshape(-1, REFINED_NODES, 2)
    index, grid, breaks, rings, tails = _pack_corners(angles, sources, refined, incoming, closeness)
    index[:, 5] += len(regular)
    values = np.concatenate((regular, rings))
    m = m._replace(
        corner_index=index,
        grid=grid,
        breaks=breaks,
        densities=np.stack((values, legendre_transform(REFINED_NODES) @ values), axis=1),
        tails=tails,
    )
    return grown(m, opened=True)


def _bare(outline: Outline, panels: Panels, angles: FloatArray, density: Density) -> MapArrays:
    """A map with the solved nodes alone, in a quadtree of one leaf that is near to all of them."""
    v, ends, nodes = outline.vertices, outline.ends, density.nodes
    tangent = (ends - v) / np.abs(ends - v)
    inward = tangent * np.exp(0.5j * angles)
    leg_ends_in, leg_ends_out, panel_ends = _panel_ends(outline, panels)
    collapsed = np.vstack((np.zeros((1, 2)), density.hole_images))[outline.ring]
    index = np.zeros((len(v) + 1, 7), dtype=np.int64)
    index[:, 0] = nodes.corner_start
    low, high = _columns(v).min(axis=0), _columns(v).max(axis=0)
    root = np.array([*(0.5 * (low + high)), 0.5 * _MARGIN * (high - low).max()])
    near = np.zeros((len(panel_ends) + len(v), 3), dtype=np.int64)
    near[: len(panel_ends), 0], near[: len(panel_ends), 1] = -1, np.arange(len(panel_ends))
    near[len(panel_ends) :, 0], near[len(panel_ends) :, 1] = np.arange(len(v)), -1
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
                np.where(outline.ring[:, None] == 0, _columns(np.exp(1j * outline.angle_start)), collapsed),
            )
        ),
        corner_index=index,
        grid=np.empty((0, 2)),
        breaks=np.empty(0),
        densities=np.empty((0, 2, REFINED_NODES, 2)),
        tails=np.empty((0, 2)),
        panels=panel_ends,
        root=root,
        boxes=np.array([-1]),
        leaf_square=np.array([[root[0], root[1], np.sqrt(2.0) * root[2]]]),
        leaf_state=np.array([ON_BOUNDARY]),
        local=np.zeros((1, ORDER, 4)),
        near_start=np.array([0, len(near)]),
        near=near,
    )


def _panel_ends(outline: Outline, panels: Panels) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends as x y of the incoming legs, of the outgoing legs (corners, 2), and of the panels (panels, 4).

    Neighbours along an edge get the same numbers to the last bit: otherwise a point between them could be
    missed or counted twice.
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


def _pack_corners(
    angles: FloatArray, sources: IntArray, refined: Nodes, incoming: FloatArray, closeness: float
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
        block = slice(refined.corner_start[k], refined.corner_start[k + 1])
        ring_values, tail_values = _descend(float(angle), closeness, incoming[block])
        index.append((sources[k], len(ring) - 1, len(nodes), at_grid, at_break, first[2], first[3]))
        rings.append(ring_values)
        tails.append(tail_values)
        first[2] += len(ring_values)
        first[3] += len(tail_values)
    index.append((sources[-1], 0, 0, *first))
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
    fields = _descending(operator.inward, np.stack((0.5 * (out + back), 0.5 * (out - back))))
    ring = _legs(operator.ring @ fields[..., : 2 * LEVELS]).reshape(LEVELS, 2, -1, REFINED_NODES, 2)
    ring[:, 0] = ring[:, 0, :, ::-1]  # the boundary runs towards the corner on the incoming leg
    tail = _legs(operator.compressed @ fields)
    return ring.reshape(-1, REFINED_NODES, 2), tail.reshape(-1, 2)


def _descending(inward: FloatArray, field: FloatArray) -> FloatArray:
    """The field that comes in at every level, even and odd part: columns (u, v) level by level.

    ``inward`` leads from one level to the next, shape (2, n, n); the field at the outermost level has shape
    (2, n, 2), the result (2, n, 2 (LEVELS + 1)).
    """
    power = inward
    while field.shape[-1] < 2 * (LEVELS + 1):
        field = np.concatenate((field, power @ field), axis=-1)
        power = power @ power
    return field[..., : 2 * (LEVELS + 1)]


def _legs(parts: FloatArray) -> FloatArray:
    """Even and odd parts (2, k, 2 levels) to the incoming and the outgoing leg, (levels, 2, k, 2)."""
    legs = np.stack((parts[0] - parts[1], parts[0] + parts[1]))
    return np.ascontiguousarray(legs.reshape(*parts.shape[:2], -1, 2).transpose(2, 0, 1, 3))
