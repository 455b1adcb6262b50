"""Alterations of what a proof shows collisions with: polygons inside pieces, points inside two of them."""

from __future__ import annotations

import numpy as np

from benchmarks.adversaries.alterations import SOUND, Change, chosen, in_slice, move, step
from benchmarks.adversaries.collisions import Document

Random = np.random.Generator


@in_slice("witnesses")
def sweep_altered(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A polygon is larger, moved, another piece's, or in another slice."""
    sweeps = answer["slices"][k]["witnesses"]
    sweep, kind = sweeps[chosen(sweeps, random)], int(random.integers(4))
    ring = np.array(sweep["polygon"])
    if kind == 0:
        ring = ring.mean(axis=0) + (1.0 + step(random, 1e-3, 3.0)) * (ring - ring.mean(axis=0))
    elif kind == 1:
        ring = ring + step(random, 1e-4) * random.uniform(-1.0, 1.0, 2)
    elif kind == 2:
        sweep["pieces"] = [int(random.integers(len(question["pieces"]) + 1))]
    else:
        m = chosen(answer["slices"], random)
        answer["slices"][m]["witnesses"].append(sweep)
        k = m
    sweep["polygon"] = ring.tolist()
    return Change((k,))


@in_slice("witnesses")
def sweep_dropped(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A polygon, or all polygons of a slice, are left out."""
    sweeps = answer["slices"][k]["witnesses"]
    del sweeps[chosen(sweeps, random) if random.random() < 0.7 else slice(None)]
    return Change((k,))


@in_slice("witnesses")
def sweep_added(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A slice has a smaller copy of one of its polygons as well."""
    sweeps = answer["slices"][k]["witnesses"]
    sweep = dict(sweeps[chosen(sweeps, random)])
    ring = np.array(sweep["polygon"])
    sweep["polygon"] = (ring.mean(axis=0) + random.uniform(0.3, 0.9) * (ring - ring.mean(axis=0))).tolist()
    sweeps.append(sweep)
    return SOUND


def overlap_forged(question: Document, answer: Document, random: Random) -> Change:
    """A slice is said to hold an overlap of two pieces, at the origin, at a corner or anywhere."""
    k = chosen(answer["slices"], random)
    pieces = question["pieces"]
    pair = sorted(int(random.integers(len(pieces))) for _ in range(2))
    point = pieces[pair[0]]["corners"][0] if random.random() < 0.5 else random.uniform(-1, 1, 2).tolist()
    component = int(random.integers(len(question["components"]) + 1))
    witness = {"pieces": pair, "component": component, "polygon": [point]}
    answer["slices"][k]["witnesses"].append(witness)
    return Change((k,))


@in_slice("witnesses")
def overlap_altered(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """The point of an overlap lies elsewhere, it names another piece, or it is left out."""
    witnesses, kind = answer["slices"][k]["witnesses"], int(random.integers(3))
    overlaps = [witness for witness in witnesses if len(witness["pieces"]) == 2]
    if not overlaps:
        return None
    overlap = overlaps[chosen(overlaps, random)]
    if kind == 0:
        move(overlap["polygon"][0], random, 1e-3, 1.0)
    elif kind == 1:
        overlap["pieces"][chosen(overlap["pieces"], random)] += int(random.choice([-1, 1]))
    else:
        witnesses.remove(overlap)
    return Change((k,))


@in_slice("squeezes")
def squeeze_altered(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cut lies elsewhere or is turned, by a unit in the last place or more, or a polygon is larger."""
    squeezes = answer["slices"][k]["squeezes"]
    squeeze, kind = squeezes[chosen(squeezes, random)], int(random.integers(4))
    cut = squeeze["cuts"][chosen(squeeze["cuts"], random)]
    by = float(random.choice([-1.0, 1.0])) * step(random, 1e-16)
    if kind == 0:
        cut["limit"] += by
    elif kind == 1:
        cut["direction"][int(random.integers(2))] += by
    elif kind == 2:
        corners = np.array(squeeze["polygon"])
        squeeze["polygon"] = (corners + abs(by) * (corners - corners.mean(axis=0))).tolist()
    else:  # Through a corner of the polygon, as near as rounding allows.
        corner = squeeze["polygon"][chosen(squeeze["polygon"], random)]
        along = float(np.dot(cut["direction"], corner))
        cut["limit"] = along + by * (1.0 if random.random() < 0.5 else 0.0)
    return Change((k,))
