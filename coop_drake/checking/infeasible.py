"""A proof holds: forbidden sets and cells cover all configurations, labels separate start from goal."""

from collections.abc import Iterator
from itertools import pairwise, product
from math import isqrt, prod
from typing import Any

from coop_drake.checking import plane, regions, team
from coop_drake.checking.plane import (
    BITS,
    ONE,
    Interval,
    Point,
    demand,
    hull,
    index,
    points,
    spend,
)
from coop_drake.checking.regions import FULL, Convex, Region
from coop_drake.checking.team import Question, Step, free, intervals

COPIES = 16
"""Copies that enclosures of squeezed pieces are made of, for an interval of angles [-]."""

WIDENING = ONE >> 40
"""Slices are widened by this on either side: ends of a turn in doubles are off by less [rad, m]."""


def check_proof(question: Question, answer: Any, progress: plane.Progress) -> list[tuple[str, int]]:
    """Check a proof that no plan exists; returns the statements that hold and how often each was checked.

    A proof is about the positions in W of a point of a component, and about that component's angle in W.
    """
    slices, (point,), edges = answer["slices"], points([answer["point"]]), 0
    outside = Region(question.floor.rings, odd=False)
    chain = question.chains[index(answer["component"], len(question.chains))]
    boxes = [intervals(value["lower"], value["upper"], question.axes) for value in slices]
    neighbours = _facets(boxes, question) + [(k, k) for k in range(len(boxes))]
    cells = [[(c["reached"], regions.read_region(c["polygon"])) for c in value["cells"]] for value in slices]
    for a, b in neighbours:
        spend(len(cells[a]) * len(cells[b]))
        for (i, (one, cell)), (j, (other, another)) in product(enumerate(cells[a]), enumerate(cells[b])):
            finding = f"touches slices[{b}].cells[{j}], which has another label"
            demand(one == other or not cell.touches(another), f"slices[{a}].cells[{i}]", finding)
    starts = (question.start, 0, question.start_box, False)
    goals = (question.goal, question.room, question.goal_box, True)
    for k, value in enumerate(slices):
        where, wide = f"slices[{k}]", [(low - WIDENING, high + WIDENING) for low, high in boxes[k]]
        demand(all(type(label) is bool for label, _ in cells[k]), where, "has labels that are no booleans")
        for place, room, box, label in (starts, goals):
            wrong = [cell for its, cell in cells[k] if its == label and _meets(wide, box, chain, question)]
            steps, name = [*chain, Step(offset=place)], "goal" if label else "start"
            clear = free([point], room, steps, box, wrong, lambda cell, *at: cell.side(*at) < 0)
            demand(clear, where, f"cells may hold the {name} and have reached: {label}")
        frame = [Step(0, -1, offset=point), *chain]
        forbidden = _forbidden(question, frame, wide, value["witnesses"], where)
        if forbidden is not None:
            squeezes = value.get("squeezes", [])
            pressed = [_squeezed(question, frame, wide, one, f"{where}.squeezes") for one in squeezes]
            edges += _check_cover([cell for _, cell in cells[k]], pressed, forbidden, outside, where)
        progress("checking slices", (k + 1) / len(slices))
    return [
        ("slices tile a turn on circular axes and the limits of all others", len(slices)),
        ("pieces hold witnesses in all of a slice", sum(len(value["witnesses"]) for value in slices)),
        ("pieces are squeezed in all of a slice", sum(len(value.get("squeezes", [])) for value in slices)),
        ("edges of cells and of forbidden positions lie inside others: they are all positions", edges),
        ("cells that touch, in a slice or across a facet, have one label", len(neighbours)),
        ("the start lies in reached cells alone, nothing of the goal in any of them", 2),
    ]


def _meets(wide: list[Interval], box: list[Interval], carrier: list[Step], question: Question) -> bool:
    """Whether a slice, whose first axis is the carrier's angle, may hold configurations of a box."""
    turns = [sorted(step.sign * end + step.angle for end in box[step.axis]) for step in carrier]
    there = [(sum(low for low, _ in turns), sum(high for _, high in turns)), *box[1:]]
    for axis in question.circles:
        there[axis] = team.unwrapped(there[axis], wide[axis], outwards=1)
    return all(a[0] <= b[1] and b[0] <= a[1] for a, b in zip(wide, there, strict=True))


def _forbidden(question: Question, frame: list[Step], box: list[Interval], witnesses: Any, where: str) -> Any:
    """Check that pieces hold witnesses; returns their polygons, None if all positions are forbidden.

    A witness is a convex polygon K inside one piece, relative to the position p that the proof is about and
    in directions of W, or inside both pieces of a pair, in a component's frame. A position p is forbidden if
    the mean of K's corners, a point of the piece, is off the floor, and if p + K meets a wall e: p is in the
    interior of the Minkowski sum of e and -K. K lies at least 2 units inside the piece: the mean, rounded by
    less than that, lies in the piece as well.
    """
    polygons = list[list[Point]]()
    for witness in witnesses:
        pieces = [question.pieces[index(k, len(question.pieces))] for k in witness["pieces"]]
        polygon, paired = hull(points(witness["polygon"])), tuple(witness["pieces"]) in question.pairs
        demand(paired or len(pieces) == 1, where, "has a witness of neither one piece nor a pair")
        seen = question.chains[index(witness["component"], len(question.chains))] if paired else frame
        for piece in pieces:
            motion = team.relative(seen, piece.chain)
            inside = free(polygon, 2 - piece.radius, motion, box, [piece.corners], _inside)
            demand(inside, f"{where}.witnesses", f"may leave the inside of {piece.body}")
        spend(100 + len(question.pairs))
        polygons.append(polygon)
    return None if any(len(witness["pieces"]) == 2 for witness in witnesses) else polygons


def _squeezed(question: Question, frame: list[Step], box: list[Interval], value: Any, where: str) -> Region:
    """Check that two round pieces touch a wall or each other, wherever p is in a polygon; returns it.

    A convex set holds all places of a piece's centre. A cut takes off a convex part, of which all corners are
    nearer to one wall than the radius, and so all of it. What is left to both centres, a and b, gives vectors
    b - a; those that are possible as well by the angles must be shorter than the sum of the radii.
    """
    pieces = [question.pieces[index(k, len(question.pieces))] for k in value["pieces"]]
    paired = tuple(value["pieces"]) in question.pairs and all(len(piece.corners) == 1 for piece in pieces)
    demand(paired, where, "is about what is no pair of round pieces")
    seen = question.chains[index(value["component"], len(question.chains))]
    onwards, positions = team.relative(seen, frame), hull(points(value["polygon"]))
    centres = [team.swept(p.corners, 0, team.relative(p.chain, seen), box, COPIES) for p in pieces]
    places = [team.swept(*centre, onwards, box, COPIES) for centre in centres]
    places = [(hull((x + p, y + q) for x, y in positions for p, q in about), gap) for about, gap in places]
    for cut in value["cuts"]:
        k, (u, v, limit) = index(cut["piece"], 2), plane.numbers([*cut["direction"], cut["limit"]], 3)
        touching, gap = plane.below(*places[k], (-u, -v), -limit << BITS)
        near = question.floor.near(plane.box_of(places[k][0]), pieces[k].radius)
        spend(100 + 10 * len(near) * len(touching))
        walls, room = [question.floor.edges[wall] for wall in near], pieces[k].radius - gap
        held = any(all(plane.nearer(point, wall, room) for point in touching) for wall in walls)
        demand(held or not touching, where, f"may leave {pieces[k].body} clear of the walls beside it")
        places[k] = plane.below(*places[k], (u, v), limit << BITS)
        if not places[k][0]:
            return Region([positions])
    ((a, s), (b, t)), ((first, gap), (second, more)) = centres, places
    turns = [Step(axis, sign, angle) for axis, sign, angle, *_ in onwards]
    apart, spread = team.swept(plane.difference(b, a), s + t, turns, box, COPIES)
    ring = plane.difference(second, first)
    for (x, y), (p, q) in pairwise([ring[-1], *ring]):
        u, v = q - y, x - p  # The outward normal; the growth is multiplied by its length, rounded up.
        bound = u * x + v * y + (isqrt(u * u + v * v) + 1) * (gap + more)
        apart, spread = plane.below(apart, spread, (u, v), bound) if apart else (apart, spread)
    room, origin = sum(piece.radius for piece in pieces) - spread, ((0, 0), (0, 0))
    together = all(plane.nearer(vector, origin, room) for vector in apart)
    demand(together, where, f"may leave room between {pieces[0].body} and {pieces[1].body}")
    return Region([positions])


def _inside(piece: list[Point], corners: list[Point], depth: int) -> bool:
    """Whether corners lie more than a depth inside a convex polygon, or less than -depth outside."""
    least, gap = (1, depth) if depth >= 0 else (0, -depth - 1)
    return all(Region([piece]).side([corner], gap) >= least for corner in corners)


class _Sets:
    """Open sets of positions: given ones, and what polygons K forbid, made as far as it is looked for.

    Attributes:
        known: A set by its number, and how far its points are moved to be positions.
        taken: Numbers of the sets whose edges are to be covered, or have been.
        last: Numbers of those that covered the last edge.
    """

    def __init__(self, given: list[Region], polygons: list[list[Point]], outside: Region) -> None:
        self.known = dict[int, tuple[Region | Convex, Point]](enumerate((one, (0, 0)) for one in given))
        self.given, self.polygons, self.outside = given, polygons, outside
        self.boxes, self.reaches = [one.box for one in given], [plane.box_of(its) for its in polygons]
        self.taken, self.last = set[int](), set[int]()
        for polygon in polygons:
            x, y = (sum(values) // len(polygon) for values in zip(*polygon, strict=True))
            self.known[len(self.known)] = outside, (-x, -y)

    def near(self, edge: tuple[Point, Point]) -> list[int]:
        """The given sets, and those of positions where K meets a wall, that may meet an edge."""
        box = plane.box_of(edge)
        spend(len(self.given))
        found = plane.boxes_near(self.boxes, range(len(self.boxes)), box, 0)
        for number, polygon in enumerate(self.polygons):
            zone = [end + off for end, off in zip(box, self.reaches[number], strict=True)]
            for wall in self.outside.near(zone, 0):
                k = len(self.given) + len(self.polygons) + number * len(self.outside.edges) + wall
                if k not in self.known:
                    ends = self.outside.edges[wall]
                    corners = hull((wx - x, wy - y) for wx, wy in ends for x, y in polygon)
                    self.known[k] = Convex(corners), (0, 0)
                found.append(k)
        return found

    def edges(self, k: int) -> list[tuple[Point, Point]]:
        """The edges of a set."""
        region, (x, y) = self.known[k]
        return [((ax + x, ay + y), (bx + x, by + y)) for (ax, ay), (bx, by) in region.edges]

    def covering(self, edge: tuple[Point, Point]) -> set[int]:
        """One set that covers an edge, or some that do together, taken ones if possible; none if they do not.

        What covered the last edge often covers this one. Of sets that were not taken yet, positions at which
        K is off the floor come last, because their stretches take longest.
        """
        stretches, tried = list[tuple[int, int, int]](), set[int]()
        for among in self._candidates(edge):
            for k in sorted(among - tried):
                region, (x, y) = self.known[k]
                own = region.stretches([(px - x, py - y) for px, py in edge])
                if own == [(0, FULL)]:
                    return {k}
                stretches += [(low, high, k) for low, high in own]
            tried |= among
            if chosen := _chosen(stretches):
                return chosen
        return set()

    def _candidates(self, edge: tuple[Point, Point]) -> Iterator[set[int]]:
        """Sets that may cover an edge, those to be tried first in front."""
        yield self.last
        near = set(self.near(edge))
        yield near & self.taken
        off_floor = set(range(len(self.given), len(self.given) + len(self.polygons)))
        yield off_floor & self.taken
        yield near
        yield off_floor


def _check_cover(
    cells: list[Region], pressed: list[Region], polygons: list[list[Point]], outside: Region, where: str
) -> int:
    """Check that the interiors of cells and forbidden sets cover the plane; counts their edges.

    The union of some open sets is open. If each point of each of their boundaries lies in one of them, it is
    closed as well, thus the whole plane. All cells belong to these sets; a forbidden one does as soon as it
    covers a part of a boundary. Of many edges it is tested first whether a box about them lies in a cell.
    """
    demand(len(cells) + len(polygons) > 0, where, "has neither cells nor witnesses")
    sets, count = _Sets([*cells, *pressed], polygons, outside), 0
    sets.taken = set(range(max(len(cells), 1)))
    left = [sets.edges(k) for k in sets.taken]
    while left:
        edges = left.pop()
        if len(edges) > regions.MANY:
            low_x, low_y, high_x, high_y = plane.box_of([corner for edge in edges for corner in edge])
            around = hull(product((low_x, high_x), (low_y, high_y)))  # Edges on one line have a flat box.
            if any(cell.side(around, 0) > 0 for cell in cells):
                count += len(edges)
                continue
            left += [edges[: len(edges) // 2], edges[len(edges) // 2 :]]
            continue
        for edge in edges:
            count, (x, y) = count + 1, edge[0]
            chosen = sets.last = sets.covering(edge)
            place = f"({x / ONE:.6f}, {y / ONE:.6f})"
            demand(len(chosen) > 0, where, f"no cell covers {place}, which may be free")
            left += [sets.edges(k) for k in sorted(chosen - sets.taken)]
            sets.taken |= chosen
    return count


def _chosen(stretches: list[tuple[int, int, int]]) -> set[int]:
    """Numbers of some stretches that together cover an edge, the far-reaching first; none if they do not."""
    left, chosen, covered, furthest = sorted(stretches, reverse=True), set[int](), -1, (-1, 0)
    spend(4 * len(left))
    while covered < FULL:
        while left and left[-1][0] <= max(covered, 0):
            _, high, k = left.pop()
            furthest = max(furthest, (high, -k))
        if furthest[0] <= covered:
            return set()
        covered = furthest[0]
        chosen.add(-furthest[1])
    return chosen


def _facets(boxes: list[list[Interval]], question: Question) -> list[tuple[int, int]]:
    """Check that boxes tile turns and limits; returns pairs that share a facet, modulo turns.

    Boxes within a range whose interiors are disjoint tile it if their volumes add up to its volume. An axis
    on which the range is a single value does not count. Boxes at the beginning of a circular axis are placed
    again behind its end: what they share a facet with there is beside them on the circle. No box crosses the
    end of an axis, so that a facet is shared across the end of one circular axis at a time.
    """
    whole = [(0, 0), *question.limits]
    for a in sorted(question.circles):
        first, last = (pick((box[a][end] for box in boxes), default=0) for end, pick in ((0, min), (1, max)))
        whole[a] = first, last
        where = f"slices, axis {a}" if a else "slices"
        demand(abs(last - first - plane.TURN) <= WIDENING, where, "are not about a whole turn")
    wide = [axis for axis, (low, high) in enumerate(whole) if low < high]
    volume, *volumes = [prod(box[a][1] - box[a][0] for a in wide) for box in (whole, *boxes)]
    tiled = all(team.holds(whole, box) for box in boxes) and sum(volumes) == volume
    demand(tiled, "slices", "do not tile their range: they leave it, leave a gap or overlap")
    placed, pairs = [*enumerate(boxes)], list[tuple[int, int]]()
    for a in sorted(question.circles):
        first, last = whole[a]
        beyond = [(k, box, (last, last + box[a][1] - first)) for k, box in enumerate(boxes)]
        placed += [(k, [*b[:a], end, *b[a + 1 :]]) for k, b, end in beyond if b[a][0] == first]
    placed.sort(key=lambda entry: entry[1])
    for n, (i, one) in enumerate(placed):
        spend(4 * len(placed))
        for j, other in placed[n + 1 :]:
            if other[0][0] > one[0][1]:
                break
            shared = [min(one[a][1], other[a][1]) - max(one[a][0], other[a][0]) for a in wide]
            demand(min(shared) <= 0, f"slices[{i}], slices[{j}]", "overlap")
            pairs += [(i, j)] if min(shared) == 0 and shared.count(0) == 1 else []
    return pairs
