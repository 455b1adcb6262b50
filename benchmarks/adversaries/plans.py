"""Alterations of plans, and of the questions that they answer."""

from __future__ import annotations

import numpy as np
import shapely

from benchmarks.adversaries.alterations import (
    ANYTHING,
    SOUND,
    STATEMENTS,
    Alteration,
    Change,
    chosen,
    move,
    region_of,
    step,
)
from benchmarks.adversaries.collisions import Document, Team, boxes_sampled, polygon_of, positions_sampled

Random = np.random.Generator


def widened(question: Document, answer: Document, random: Random) -> Change:
    """An interval of a cell is longer at one end."""
    k = chosen(answer["cells"], random)
    cell, axis = answer["cells"][k], chosen(answer["cells"][k]["lower"], random)
    if random.random() < 0.5:
        cell["lower"][axis] -= step(random)
    else:
        cell["upper"][axis] += step(random)
    return Change((k,))


def narrowed(question: Document, answer: Document, random: Random) -> Change | None:
    """An interval of a cell is shorter, but still holds its goal intervals and the start."""
    k = chosen(answer["cells"], random)
    cell, axis = answer["cells"][k], chosen(answer["cells"][k]["lower"], random)
    kept = [
        t[end][axis]
        for t in answer["transitions"][max(k - 1, 0) : k + 1]
        for end in ("goal_lower", "goal_upper")
    ]
    kept += [question["start"][2 + axis]] * (k == 0)
    share = random.uniform(0.0, 1.0)
    cell["lower"][axis] += share * (min(kept) - cell["lower"][axis])
    cell["upper"][axis] -= share * (cell["upper"][axis] - max(kept))
    held = cell["lower"][axis] <= min(kept) and max(kept) <= cell["upper"][axis]
    return SOUND if held else None


def moved_target(question: Document, answer: Document, random: Random) -> Change:
    """A target and the ends of its paths lie elsewhere."""
    k = chosen(answer["transitions"], random)
    target = list(answer["transitions"][k]["target"])
    move(target, random)
    answer["transitions"][k]["target"] = answer["transitions"][k]["path"][-1] = target
    if k + 1 < len(answer["transitions"]):
        answer["transitions"][k + 1]["path"][0] = target
    return STATEMENTS


def swapped(question: Document, answer: Document, random: Random) -> Change | None:
    """Two cells change places, with their transitions or without."""
    i, j = (chosen(answer["cells"], random) for _ in range(2))
    if i == j:
        return None
    for key in ("cells", "transitions")[: int(random.integers(1, 3))]:
        answer[key][i], answer[key][j] = answer[key][j], answer[key][i]
    return STATEMENTS


def dropped(question: Document, answer: Document, random: Random) -> Change | None:
    """A cell is left out with its transition; the next one's path begins where that of this one began."""
    if len(answer["cells"]) < 2:
        return None
    k = chosen(answer["cells"], random)
    del answer["cells"][k]
    gone = answer["transitions"].pop(k)
    if k < len(answer["transitions"]):
        after = answer["transitions"][k]
        after["path"] = [*gone["path"][:-1], *after["path"]]
        after["length"] += gone["length"]
        after["neck"] = min(gone["neck"], after["neck"])
    return STATEMENTS


def doubled(question: Document, answer: Document, random: Random) -> Change:
    """A cell occurs twice: its target is reached, then kept."""
    k = chosen(answer["cells"], random)
    stay = dict(answer["transitions"][k])
    stay |= {"path": [stay["target"]] * 2, "length": 0.0, "neck": 0.5 * stay["inradius"]}
    answer["cells"].insert(k, answer["cells"][k])
    answer["transitions"].insert(k + 1, stay)
    return SOUND


def moved_vertex(question: Document, answer: Document, random: Random) -> Change:
    """A corner of a cell lies elsewhere."""
    k = chosen(answer["cells"], random)
    ring = answer["cells"][k]["tidied"]["outer"]
    move(ring[chosen(ring, random)], random)
    return Change((k,))


def grown(question: Document, answer: Document, random: Random) -> Change | None:
    """A cell is larger all around."""
    k = chosen(answer["cells"], random)
    region = region_of(
        polygon_of(answer["cells"][k]["tidied"]).buffer(step(random, 1e-5), join_style="mitre")
    )
    if region is None:
        return None
    answer["cells"][k]["tidied"] = region
    return Change((k,))


def bridged(question: Document, answer: Document, random: Random) -> Change | None:
    """A cell is the convex hull of two cells."""
    i, j = (chosen(answer["cells"], random) for _ in range(2))
    both = polygon_of(answer["cells"][i]["tidied"]).union(polygon_of(answer["cells"][j]["tidied"]))
    region = region_of(both.convex_hull)
    if region is None:
        return None
    answer["cells"][i]["tidied"] = region
    return Change((i,))


def overstated(question: Document, answer: Document, random: Random) -> Change:
    """A neck, an inradius or a length is larger than it is."""
    transition = answer["transitions"][chosen(answer["transitions"], random)]
    key = ("neck", "inradius", "length")[int(random.integers(3))]
    transition[key] = transition[key] * (1.0 + step(random, 1e-4, 1e4)) + 1e-4
    return STATEMENTS


def understated(question: Document, answer: Document, random: Random) -> Change:
    """A neck or an inradius is smaller than it is."""
    transition = answer["transitions"][chosen(answer["transitions"], random)]
    transition[("neck", "inradius")[int(random.integers(2))]] *= random.uniform(0.01, 1.0)
    return SOUND


def cut_corner(question: Document, answer: Document, random: Random) -> Change | None:
    """A path goes straight to its target, or by a detour; its length is stated accordingly."""
    transition = answer["transitions"][chosen(answer["transitions"], random)]
    path = transition["path"]
    middle = (np.array(path[0]) + random.uniform(-0.5, 0.5, 2)).tolist()
    way = [path[0], path[-1]] if random.random() < 0.5 else [path[0], middle, path[-1]]
    transition["path"], transition["length"] = way, float(shapely.LineString(way).length)
    return STATEMENTS


def moved_goal_interval(question: Document, answer: Document, random: Random) -> Change:
    """A goal interval is moved, widened, or narrowed to one unit in the last place."""
    transition = answer["transitions"][chosen(answer["transitions"], random)]
    axis, by = chosen(transition["goal_lower"], random), step(random)
    kind = int(random.integers(3))
    if kind == 2:
        transition["goal_upper"][axis] = float(np.nextafter(transition["goal_lower"][axis], np.inf))
    else:
        transition["goal_upper"][axis] += by
        transition["goal_lower"][axis] += by if kind else -by
    return STATEMENTS


def turned_ring(question: Document, answer: Document, random: Random) -> Change:
    """A ring begins elsewhere, runs backwards, or repeats a corner."""
    region = answer["cells"][chosen(answer["cells"], random)]["tidied"]
    ring = region["outer"]
    k = chosen(ring, random)
    region["outer"] = [*ring[k:], *ring[:k], ring[k - 1]][:: int(random.choice([-1, 1]))]
    return SOUND


def hair_post(question: Document, answer: Document, random: Random) -> Change | None:
    """The floor has a post of a picometre to a centimetre where a body passes."""
    k = chosen(answer["cells"], random)
    cell, team = answer["cells"][k], Team(question)
    positions = positions_sampled(polygon_of(cell["tidied"]), random, 5)
    angles = boxes_sampled(np.array(cell["lower"]), np.array(cell["upper"]), random, 1)
    piece = team.placed(chosen(team.pieces, random), angles, inner=False)[0]
    place = np.array(piece.representative_point().coords[0]) + positions[chosen(positions, random)]
    size = step(random, 1e-12, 1e-2)
    question["floor"]["holes"].append((place + size * np.array([[0, 0], [1, 0], [0, 1]])).tolist())
    return Change((k,))


def other_floor(question: Document, answer: Document, random: Random) -> Change:
    """A corner of the floor lies elsewhere."""
    rings = [question["floor"]["outer"], *question["floor"]["holes"]]
    ring = rings[chosen(rings, random)]
    move(ring[chosen(ring, random)], random, 1e-3, 2.0)
    return ANYTHING


def other_team(question: Document, answer: Document, random: Random) -> Change:
    """A piece is thicker, or a joint's frame lies elsewhere."""
    if question["components"] and random.random() < 0.3:
        component = question["components"][chosen(question["components"], random)]
        k = int(random.integers(3))
        if k == 2:
            component["angle"] += step(random, 1e-3)
        else:
            component["offset"][k] += step(random, 1e-3)
    else:
        question["pieces"][chosen(question["pieces"], random)]["radius"] += step(random, 1e-4)
    return ANYTHING


def other_ends(question: Document, answer: Document, random: Random) -> Change:
    """Start, goal, tolerances or a limit are others than those that the plan was made for."""
    key = ("start", "goal", "tolerance", "limit")[int(random.integers(4))]
    if key == "tolerance" or not question["upper"]:
        question["tolerances"][int(random.integers(2))] *= 0.1
    elif key == "limit":
        k = chosen(question["upper"], random)
        low, high = question["lower"][k], question["upper"][k]
        question["upper"][k] = low + random.random() * (high - low)
    else:
        question[key][chosen(question[key], random)] += step(random, 1e-3)
    return STATEMENTS


PLAN_ALTERATIONS: dict[str, Alteration] = {
    "interval widened": widened,
    "interval narrowed": narrowed,
    "target moved": moved_target,
    "cells swapped": swapped,
    "cell left out": dropped,
    "cell twice": doubled,
    "corner of a cell moved": moved_vertex,
    "cell grown": grown,
    "cells bridged": bridged,
    "figure overstated": overstated,
    "figure understated": understated,
    "path changed": cut_corner,
    "goal interval changed": moved_goal_interval,
    "ring written otherwise": turned_ring,
    "post in the way": hair_post,
    "another floor": other_floor,
    "another team": other_team,
    "other ends": other_ends,
}
"""Every kind of alteration by name."""
