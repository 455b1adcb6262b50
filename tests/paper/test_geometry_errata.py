"""E4, E6 and E9: which configurations are free, and what over- and under-approximations are."""

import numpy as np
from shapely import box
from shapely.affinity import rotate, translate
from shapely.ops import unary_union

WORKSPACE = box(0.0, 0.0, 4.0, 2.0)
BAR = box(-0.5, -0.05, 0.5, 0.05)
FOOTPRINTS = [rotate(BAR, angle, origin=(0.0, 0.0)) for angle in np.linspace(0.0, 60.0, 13)]


def intersection(shapes):
    common = shapes[0]
    for shape in shapes[1:]:
        common = common.intersection(shape)
    return common


def outside(shape):
    """Return the part of a shape in the complement of the workspace."""
    return shape.difference(WORKSPACE)


def test_e4_the_workspace_is_where_the_robots_may_be():
    """(4) calls z free if W and R(z) do not meet: the complement of W is meant."""
    in_the_middle, in_the_wall = translate(BAR, 2.0, 1.0), translate(BAR, 9.0, 9.0)
    printed = [WORKSPACE.intersection(body).is_empty for body in (in_the_middle, in_the_wall)]
    corrected = [outside(body).is_empty for body in (in_the_middle, in_the_wall)]
    assert printed == [False, True]
    assert corrected == [True, False]


def test_e6_the_second_line_defines_the_under_approximation():
    """(6) overlines the intersection too; an over-approximation would have to hold every footprint."""
    over, under = unary_union(FOOTPRINTS), intersection(FOOTPRINTS)
    assert all(over.buffer(1e-9).contains(footprint) for footprint in FOOTPRINTS)
    assert all(footprint.buffer(1e-9).contains(under) for footprint in FOOTPRINTS)
    assert not any(under.contains(footprint) for footprint in FOOTPRINTS)


def test_e9_only_positions_free_for_the_union_are_free_for_every_angle():
    """(9) with the intersection in the place of R's over-approximation calls a colliding position safe."""
    over, under = unary_union(FOOTPRINTS), intersection(FOOTPRINTS)
    near_the_wall = (2.0, 0.3)
    collides = [not outside(translate(footprint, *near_the_wall)).is_empty for footprint in FOOTPRINTS]
    assert any(collides)
    safe_as_printed = outside(translate(under, *near_the_wall)).is_empty
    safe_as_corrected = outside(translate(over, *near_the_wall)).is_empty
    assert safe_as_printed
    assert not safe_as_corrected
