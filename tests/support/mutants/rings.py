"""Scenarios whose floor is none: rings that cross or touch themselves, holes outside or in each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tests.support.mutants.mutant import Mutant, Place, at, block, dotted, put

Ring = list[list[float]]


def ring_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Broken rings in every place of a scenario where a ring stands."""
    rings: list[Place] = [("workspace", "outer")]
    rings += [("workspace", "holes", k) for k in range(len(data["workspace"]["holes"]))]
    for path in rings:
        for kind, ring, because in _broken(at(data, path)):
            yield Mutant(kind, dotted(path), because, block(put(data, path, ring)).encode(), dotted(path))
    yield from _holes(data)


def _broken(ring: Ring) -> Iterator[tuple[str, Any, str]]:
    """Broken forms of one sound ring."""
    yield "no corners", [], "it encloses nothing"
    yield "one corner", ring[:1], "it encloses nothing"
    yield "two corners", ring[:2], "it encloses nothing"
    yield "one corner many times", [ring[0]] * 5, "it encloses nothing"
    line = [[ring[0][0] + 0.1 * k, ring[0][1] + 0.2 * k] for k in range(4)]
    yield "corners in a line", line, "it encloses nothing"
    (left, low), (right, high) = map(min, zip(*ring, strict=True)), map(max, zip(*ring, strict=True))
    bow = [[left, low], [right, high], [right, low], [left, high]]
    yield "bow tie", bow, "its diagonals cross"
    for k, corner in enumerate(ring):
        spike = [*ring[: k + 1], [corner[0] + 0.01, corner[1] + 0.013], corner, *ring[k + 1 :]]
        yield "spike", spike, f"it runs to a point and back from corner {k}"
        eight = [*ring[: k + 1], *ring[k - 2 : k + 1][:1], *ring[k + 1 :]] if k >= 2 else None
        if eight:
            yield "corner visited twice", eight, f"corner {k - 2} comes again after corner {k}"
        yield "corner of one number", [*ring[:k], corner[:1], *ring[k + 1 :]], "a corner is x and y"
        yield "corner of three", [*ring[:k], [*corner, 0.0], *ring[k + 1 :]], "a corner is x and y"
        yield "corner of nothing", [*ring[:k], [], *ring[k + 1 :]], "a corner is x and y"
        yield "corner as a mapping", [*ring[:k], {"x": 1.0}, *ring[k + 1 :]], "a corner is a list"
        yield "corner of a text", [*ring[:k], [corner[0], "far"], *ring[k + 1 :]], "a corner is two numbers"
        yield "corner of no number", [*ring[:k], [float("nan"), corner[1]], *ring[k + 1 :]], "it is nowhere"
        yield "corner at infinity", [*ring[:k], [corner[0], float("inf")], *ring[k + 1 :]], "it is nowhere"
        yield (
            "corner in another world",
            [*ring[:k], [1e12, corner[1]], *ring[k + 1 :]],
            "no floor is so large",
        )


def _holes(data: dict[str, Any]) -> Iterator[Mutant]:
    outer, holes = data["workspace"]["outer"], data["workspace"]["holes"]
    (left, low), (right, high) = map(min, zip(*outer, strict=True)), map(max, zip(*outer, strict=True))
    away = [[x + 1000.0, y] for x, y in holes[0]]
    around = [[left - 1, low - 1], [right + 1, low - 1], [right + 1, high + 1], [left - 1, high + 1]]
    shifted = [[0.5 * (x + holes[0][0][0]), 0.5 * (y + holes[0][0][1])] for x, y in holes[0]]
    for kind, hole, because in (
        ("hole outside", away, "it is a kilometre off"),
        ("hole around everything", around, "nothing of the floor is left"),
        ("hole as large as the floor", outer, "nothing of the floor is left"),
        ("hole twice", holes[0], "it is there already"),
        ("hole in a hole", shifted, "there is no floor to take away"),
        *(("hole across the wall", _square(corner), "its middle is on the wall") for corner in outer),
    ):
        place: Place = ("workspace", "holes", len(holes))
        changed = put(data, ("workspace", "holes"), [*holes, hole])
        yield Mutant(kind, dotted(place), because, block(changed).encode(), dotted(place))


def _square(centre: list[float]) -> Ring:
    x, y = centre
    return [[x - 0.05, y - 0.05], [x + 0.05, y - 0.05], [x + 0.05, y + 0.05], [x - 0.05, y + 0.05]]
