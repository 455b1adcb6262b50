"""A map as one array: nothing is lost, and compiled code sees what Python sees."""

import numba
import numpy as np
import pytest
from shapely import Point, affinity, box

from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.fields.flat_field import velocity_in_field
from coop_drake.fields.flat_map import MapArrays, centre_of, flatten, rounding_of, unflatten
from tests.support import domains


@numba.njit
def as_a_kernel_calls_it(flat, field, x, y):
    return velocity_in_field(flat, field, x, y)


@pytest.fixture(scope="module")
def mapped():
    domain, goal = (affinity.translate(shape, 100.0, -40.0) for shape in domains.warehouse())
    return HarmonicMap(domain, goal)


def test_arrays_come_back_by_their_names(mapped):
    arrays = mapped.solution.arrays
    numbered = MapArrays(*(np.full_like(array, k) for k, array in enumerate(arrays)))
    back = unflatten(flatten(numbered, np.array([3.0, -4.0]), 0.5))
    for name in MapArrays._fields:
        np.testing.assert_array_equal(getattr(back, name), getattr(numbered, name))
        assert getattr(back, name).dtype == getattr(numbered, name).dtype
        assert getattr(back, name).size > 0


def test_floats_come_back_bit_by_bit(mapped):
    arrays = mapped.solution.arrays
    odd = arrays._replace(breaks=np.array([np.nan, np.inf, -0.0, 5e-324]))
    back = unflatten(flatten(odd, np.array([3.0, -4.0]), 0.5))
    assert back.breaks.tobytes() == odd.breaks.tobytes()


def test_centre_and_rounding_come_back(mapped):
    flat = flatten(mapped.solution.arrays, np.array([3.0, -4.0]), 0.5)
    assert centre_of(flat) == (3.0, -4.0)
    assert rounding_of(flat) == 0.5


def test_one_point_gets_what_it_gets_among_many(mapped):
    points = domains.inside(mapped.region, 50)
    T, J = mapped(points)
    for k, point in enumerate(points):
        one_T, one_J = mapped(point)
        np.testing.assert_array_equal(one_T, T[k])
        np.testing.assert_array_equal(one_J, J[k])


@pytest.mark.parametrize("goal", [Point(107.0, -35.0), box(107.4, -35.0, 108.0, -34.4)])
def test_compiled_code_evaluates_a_field_by_itself(goal):
    room = box(100.0, -40.0, 108.0, -34.0)
    field = VelocityField(HarmonicMap(room, goal), 0.7)

    for point in domains.inside(room, 20):
        seen = as_a_kernel_calls_it(*field.kernel_arguments, *point)
        # Sums may be added in any order: compiled into another function they may round differently.
        np.testing.assert_allclose(seen, tuple(field(point)), rtol=0.0, atol=1e-14)
