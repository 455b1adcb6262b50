"""The quadrature nodes on the panels: position, line element and boundary data, corner blocks first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.fields.corners import leg_panels, panel_nodes
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import gauss_nodes
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True)
class Nodes:
    """All nodes of one discretisation: each corner's incoming leg then its outgoing leg, then regular panels.

    On both legs the nodes count from the corner outwards.

    Attributes:
        position: Nodes as x + i y [m], shape (n,).
        element: dt times weight along the boundary's direction, shape (n,).
        edge: Edge of each node, shape (n,).
        corner: Corner whose block holds the node, -1 on regular panels, shape (n,).
        boundary_value: g: exp(i angle) on the outer ring, 0 on holes, shape (n,).
        corner_start: First node of each corner's block, one more entry ends the last, shape (corners + 1,).
    """

    position: ComplexArray
    element: ComplexArray
    edge: IntArray
    corner: IntArray
    boundary_value: ComplexArray
    corner_start: IntArray


def place_nodes(outline: Outline, panels: Panels, angles: FloatArray, nodes: int, closeness: float) -> Nodes:
    """Place ``nodes`` Gauss nodes on every panel.

    The interior angles of the corners have shape (corners,) [rad]. ``closeness``: longest panel per unit of
    distance, see `leg_panels`.
    """
    v, following, preceding = outline.vertices, outline.following, outline.preceding
    length = np.abs(v[following] - v)
    tangent = (v[following] - v) / length
    along, weight, edge, corner, starts = [], [], [], [], [0]
    for k, angle in enumerate(angles):
        x, w = panel_nodes(leg_panels(float(angle), closeness)[0], nodes)
        before, leg = preceding[k], panels.legs[k]
        along += [length[before] - leg * x, leg * x]
        weight += [leg * w, leg * w]
        edge += [np.full(len(x), before), np.full(len(x), k)]
        corner.append(np.full(2 * len(x), k))
        starts.append(starts[-1] + 2 * len(x))
    x, w = gauss_nodes(nodes)
    half = 0.5 * (panels.end - panels.start)[:, None]
    along.append((0.5 * (panels.end + panels.start)[:, None] + half * x).ravel())
    weight.append((half * w).ravel())
    edge.append(np.repeat(panels.edge, nodes))
    corner.append(np.full(half.size * nodes, -1))
    s, e = np.concatenate(along), np.concatenate(edge).astype(np.int64)
    angle_at = outline.angle_start[e] + (outline.angle_end - outline.angle_start)[e] * (s / length[e])
    return Nodes(
        position=v[e] + s * tangent[e],
        element=np.concatenate(weight) * tangent[e],
        edge=e,
        corner=np.concatenate(corner).astype(np.int64),
        boundary_value=np.where(outline.ring[e] == 0, np.exp(1j * angle_at), 0.0),
        corner_start=np.array(starts, dtype=np.int64),
    )
