"""Forged proofs that no way exists, for questions that have one: a cut through the floor."""

from __future__ import annotations

from math import pi

import numpy as np
import shapely
from shapely import Polygon

from benchmarks.adversaries.collisions import Document, Team

GAPS = (0.0, 1e-16, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4)
"""Widths of the cut [m]; with zero both sides share their edge."""


def forged_proof(question: Document, seed: int) -> Document | None:
    """A proof of two cells, one with the start and one with the goal, on either side of a slanted cut.

    A disc inside a piece, or a polygon inside the object in slices of its angle, is what forbids positions.
    Ends of the cut are moved by units in the last place, so that no rounding tells the sides apart.

    Args:
        question: A question that has a way.
        seed: Of the cut.
    """
    random = np.random.default_rng(seed)
    start, goal = np.array(question["start"][:2]), np.array(question["goal"])
    if np.hypot(*(goal - start)) < 0.1:
        return None
    place = start + random.uniform(0.2, 0.8) * (goal - start)
    across = np.array([start[1] - goal[1], goal[0] - start[0]])
    turn = random.uniform(-0.6, 0.6)
    along = 10.0 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ across
    gap = GAPS[int(random.integers(len(GAPS)))]
    aside = gap * (goal - start) / np.hypot(*(goal - start))
    ends = np.array([place - along, place + along])
    others = np.nextafter(ends, np.inf) if random.random() < 0.3 else ends + aside
    back, ahead = ends - 20.0 * (goal - start), ends + 20.0 * (goal - start)
    near = [*ends.tolist(), *back[::-1].tolist()]
    far = [*others.tolist(), *ahead[::-1].tolist()]
    cells = [
        {"reached": label, "polygon": {"outer": ring, "holes": []}}
        for label, ring in ((True, near), (False, far))
    ]
    sweep = _sweep(question)
    if sweep is None:
        return None
    piece, centre, polygon = sweep
    witness = {"pieces": [piece], "component": 0, "polygon": polygon}
    slice_ends = {"lower": [-pi, *question["lower"]], "upper": [pi, *question["upper"]]}
    head = {"format": "coop_drake proof of infeasibility", "version": 4, "problem": ""}
    return head | {
        "kind": "slices",
        "component": 0,
        "point": centre,
        "slices": [{**slice_ends, "witnesses": [witness], "cells": cells}],
    }


def _sweep(question: Document) -> tuple[int, list[float], list[list[float]]] | None:
    """A piece of the object, the middle of a disc in it, and a polygon in the disc about its middle."""
    for k, piece in enumerate(Team(question).pieces):
        if piece.component == 0 and isinstance(piece.inner, Polygon) and not piece.inner.is_empty:
            ray = shapely.get_coordinates(shapely.maximum_inscribed_circle(piece.inner, tolerance=1e-3))
            angles = np.arange(8) * (pi / 4.0)
            ring = 0.9 * np.hypot(*(ray[1] - ray[0])) * np.column_stack((np.cos(angles), np.sin(angles)))
            return k, ray[0].tolist(), ring.tolist()
    return None
