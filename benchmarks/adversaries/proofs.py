"""Alterations of proofs, and of the questions that they answer."""

from __future__ import annotations

from math import tau

import numpy as np
import shapely
from shapely import affinity

from benchmarks.adversaries.alterations import (
    ANYTHING,
    SOUND,
    STATEMENTS,
    Alteration,
    Change,
    chosen,
    copied,
    having,
    in_slice,
    move,
    region_of,
    step,
)
from benchmarks.adversaries.collisions import Document, polygon_of
from benchmarks.adversaries.plans import other_floor, other_team
from benchmarks.adversaries.witnesses import (
    overlap_altered,
    overlap_forged,
    squeeze_altered,
    sweep_added,
    sweep_altered,
    sweep_dropped,
)

Random = np.random.Generator


@in_slice("cells")
def flipped(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell, or all cells of a slice, have the other label."""
    cells = answer["slices"][k]["cells"]
    for cell in [cells[chosen(cells, random)]] if random.random() < 0.7 else cells:
        cell["reached"] = not cell["reached"]
    return STATEMENTS


def relabelled(question: Document, answer: Document, random: Random) -> Change | None:
    """All cells have one label, or all the other."""
    if not having(answer, "cells"):
        return None
    kind = int(random.integers(3))
    for part in answer["slices"]:
        for cell in part["cells"]:
            cell["reached"] = not cell["reached"] if kind == 2 else bool(kind)
    return STATEMENTS


@in_slice("cells")
def cell_dropped(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell is left out."""
    cells = answer["slices"][k]["cells"]
    del cells[chosen(cells, random)]
    return Change((k,))


@in_slice("cells")
def cell_reshaped(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell is smaller or larger all around, or one of its corners lies elsewhere."""
    cells = answer["slices"][k]["cells"]
    cell = cells[chosen(cells, random)]
    if random.random() < 0.5:
        by = step(random, 1e-6, 0.3) * float(random.choice([-1.0, 1.0]))
        region = region_of(polygon_of(cell["polygon"]).buffer(by, join_style="mitre"))
        if region is None:
            return None
        cell["polygon"] = region
    else:
        move(cell["polygon"]["outer"][chosen(cell["polygon"]["outer"], random)], random)
    return Change((k,))


@in_slice("cells")
def cell_cut(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell is cut by a slanted slit, as thin as rounding or wider; one half may get the other label."""
    cells = answer["slices"][k]["cells"]
    cell = cells.pop(chosen(cells, random))
    whole = polygon_of(cell["polygon"])
    (x, y), turn = whole.representative_point().coords[0], random.uniform(0.0, tau)
    along = 100.0 * np.array([np.cos(turn), np.sin(turn)])
    middle, gap = np.array([x, y]), step(random, 1e-16, 1e-2)
    line = shapely.LineString([middle - along, middle + along])
    halves = [line.buffer(50.0 * side, single_sided=True) for side in (-1.0, 1.0)]
    halves[1] = affinity.translate(halves[1], -gap * along[1] / 100.0, gap * along[0] / 100.0)
    flips = random.random() < 0.7
    for half, label in zip(halves, (cell["reached"], cell["reached"] != flips), strict=True):
        regions = [region_of(part) for part in shapely.get_parts(whole.intersection(half))]
        cells += [{"reached": bool(label), "polygon": region} for region in regions if region is not None]
    return Change((k,))


@in_slice("cells")
def cell_doubled(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell occurs twice, its rings written otherwise, and the cells in another order."""
    cells = answer["slices"][k]["cells"]
    copy = copied(cells[chosen(cells, random)])
    copy["polygon"]["outer"].reverse()
    cells.insert(0, copy)
    answer["slices"][k]["cells"] = [cells[i] for i in random.permutation(len(cells))]
    return SOUND


@in_slice("cells")
def corners_added(question: Document, answer: Document, random: Random, k: int) -> Change | None:
    """A cell has a hair along an axis, with a hundred corners: bounding boxes of its parts are flat."""
    cells = answer["slices"][k]["cells"]
    polygon = cells[chosen(cells, random)]["polygon"]
    ring = [polygon["outer"], *polygon["holes"]][chosen([0, *polygon["holes"]], random)]
    (x, y), corner = ring[-1], int(random.integers(2))
    end = (x + step(random), y) if corner else (x, y + step(random))
    there = np.linspace((x, y), end, 100).tolist()
    ring += [*there[1:], *there[-2:0:-1]]
    return Change((k,))


def slice_dropped(question: Document, answer: Document, random: Random) -> Change:
    """A slice is left out, occurs twice, or stands in the place of another."""
    slices = answer["slices"]
    k, kind = chosen(slices, random), int(random.integers(3))
    if kind == 0 or len(slices) == 1:
        del slices[k]
    elif kind == 1:
        slices.append(slices[k])
    else:
        slices[k] = slices[k - 1]
    return STATEMENTS


def slice_moved(question: Document, answer: Document, random: Random) -> Change:
    """An end of a slice lies elsewhere, by one unit in the last place or more."""
    part = answer["slices"][chosen(answer["slices"], random)]
    end = ("lower", "upper")[int(random.integers(2))]
    axis = chosen(part[end], random)
    value = part[end][axis]
    by = step(random, 1e-9) * float(random.choice([-1.0, 1.0]))
    part[end][axis] = float(np.nextafter(value, np.inf)) if random.random() < 0.3 else value + by
    return STATEMENTS


def slice_exchanged(question: Document, answer: Document, random: Random) -> Change | None:
    """Two slices change all that they hold, but not their intervals."""
    i, j = (chosen(answer["slices"], random) for _ in range(2))
    if i == j:
        return None
    one, other = answer["slices"][i], answer["slices"][j]
    for key in one.keys() - {"lower", "upper"}:
        one[key], other[key] = other[key], one[key]
    return Change((i, j))


def slice_halved(question: Document, answer: Document, random: Random) -> Change | None:
    """A slice is halved; both halves hold what it held. Slices stand in another order."""
    slices = answer["slices"]
    k = chosen(slices, random)
    half = copied(slices[k])
    axis = chosen(half["lower"], random)
    middle = 0.5 * (half["lower"][axis] + half["upper"][axis])
    if not half["lower"][axis] < middle < half["upper"][axis]:
        return None
    half["lower"][axis] = slices[k]["upper"][axis] = middle
    slices.append(half)
    answer["slices"] = [slices[i] for i in random.permutation(len(slices))]
    return SOUND


def other_subject(question: Document, answer: Document, random: Random) -> Change:
    """The proof is about another component or another point."""
    if random.random() < 0.4:
        answer["component"] = int(random.integers(len(question["components"]) + 2))
    else:
        answer["point"] = (np.array(answer["point"]) + step(random, 1e-6) * random.normal(size=2)).tolist()
    return ANYTHING


def other_ends(question: Document, answer: Document, random: Random) -> Change:
    """Start and goal change places, lie elsewhere, or a joint moves further."""
    kind = int(random.integers(3))
    if kind == 0 or not question["upper"]:
        x, y, angle = question["start"][:3]
        question["start"][:3] = [*question["goal"], question["goal_lower"][0]]
        question["goal"], question["goal_lower"][0], question["goal_upper"][0] = [x, y], angle, angle
    elif kind == 1:
        for key in ("start", "goal"):
            question[key][:2] = (np.array(question[key][:2]) + random.uniform(-2.0, 2.0, 2)).tolist()
    else:
        question["upper"][chosen(question["upper"], random)] += step(random, 1e-9, 1.0)
    return ANYTHING


def wider_goal(question: Document, answer: Document, random: Random) -> Change:
    """Tolerances of the goal are up to a thousand times as wide."""
    factors = 10.0 ** random.uniform(0.0, 3.0, len(question["tolerances"]))
    question["tolerances"] = (factors * question["tolerances"]).tolist()
    return ANYTHING


def thinner(question: Document, answer: Document, random: Random) -> Change:
    """Every piece is smaller, or a pillar of the floor is gone."""
    if question["floor"]["holes"] and random.random() < 0.3:
        question["floor"]["holes"].pop()
        return ANYTHING
    factor = random.uniform(0.3, 0.99)
    for piece in question["pieces"]:
        piece["corners"] = (factor * np.array(piece["corners"])).tolist()
        piece["radius"] *= factor
    return ANYTHING


def turned(question: Document, answer: Document, random: Random) -> Change:
    """Start and goal have angles that are whole turns away."""
    question["start"][2] += tau * int(random.integers(-3, 4))
    turns = tau * int(random.integers(-3, 4))
    question["goal_lower"][0] = question["goal_upper"][0] = question["goal_lower"][0] + turns
    return SOUND


PROOF_ALTERATIONS: dict[str, Alteration] = {
    "labels turned": flipped,
    "labels made one": relabelled,
    "cell left out": cell_dropped,
    "cell reshaped": cell_reshaped,
    "cell cut": cell_cut,
    "cell twice": cell_doubled,
    "corners added": corners_added,
    "slice left out": slice_dropped,
    "slice moved": slice_moved,
    "slices exchanged": slice_exchanged,
    "slice halved": slice_halved,
    "polygon altered": sweep_altered,
    "polygon left out": sweep_dropped,
    "polygon added": sweep_added,
    "overlap forged": overlap_forged,
    "overlap altered": overlap_altered,
    "squeeze altered": squeeze_altered,
    "another subject": other_subject,
    "other ends": other_ends,
    "another floor": other_floor,
    "another team": other_team,
    "thinner bodies": thinner,
    "wider goal": wider_goal,
    "whole turns away": turned,
}
"""Every kind of alteration by name."""
