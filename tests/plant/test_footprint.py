"""Footprints hold every point of the solid shape, and no more than its shadow and a hair."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from shapely import MultiPoint, points

from coop_drake.plant.component_tree import hull, project
from coop_drake.plant.problem import core
from coop_drake.tree.pose import PlanarPose

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 0.7 0\nv 0 0 0.5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def ball(count=40):
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, count), np.linspace(0.0, 2.0 * np.pi, 2 * count))
    return np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    ).reshape(-1, 3)


def rims(radius, length, count=400):
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)], axis=-1)
    up = np.array([0.0, 0.0, 0.5 * length])
    return np.concatenate([rim + up, rim - up])


def corners(size):
    return np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size


@pytest.fixture(scope="module")
def tetrahedron(tmp_path_factory):
    path = tmp_path_factory.mktemp("mesh") / "tetrahedron.obj"
    path.write_text(TETRAHEDRON)
    return str(path)


def solids(mesh):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 0.7, 0], [0, 0, 0.5]], dtype=float)
    return {
        "sphere": (Sphere(0.3), 0.3 * ball()),
        "box": (Box(0.4, 0.2, 0.7), corners([0.4, 0.2, 0.7])),
        "cylinder": (Cylinder(0.2, 0.6), rims(0.2, 0.6)),
        "capsule": (
            Capsule(0.2, 0.6),
            np.concatenate([0.2 * ball() + [0, 0, 0.3], 0.2 * ball() - [0, 0, 0.3]]),
        ),
        "ellipsoid": (Ellipsoid(0.3, 0.2, 0.5), ball(80) * [0.3, 0.2, 0.5]),
        "convex": (Convex(mesh, 1.0), vertices),
        "mesh": (Mesh(mesh, 1.0), vertices),
    }


NAMES = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "convex", "mesh")
angles = st.floats(-3.2, 3.2)


@settings(max_examples=25)
@given(name=st.sampled_from(NAMES), roll=angles, pitch=angles, yaw=angles, x=st.floats(-2, 2))
def test_footprint_is_the_shadow_and_a_hair(tetrahedron, name, roll, pitch, yaw, x):
    shape, surface = solids(tetrahedron)[name]
    X_CG = RigidTransform(RollPitchYaw(roll, pitch, yaw), [x, 0.5, 3.0])
    found = project(shape, X_CG)
    shadow = X_CG.multiply(surface.T).T[:, :2]
    solid = core(found, PlanarPose())
    assert solid.distance(points(shadow)).max() <= found.radius + 1e-9
    grown = solid.buffer(found.radius, quad_segs=64)
    assert grown.area <= 1.006 * MultiPoint(shadow).convex_hull.area + 1e-7


@pytest.mark.parametrize(
    ("shape", "roll", "vertices", "radius"),
    [
        (Cylinder(0.25, 0.5), 0.0, [[1, 2]], 0.25),
        (Cylinder(0.25, 0.5), np.pi, [[1, 2]], 0.25),
        (Cylinder(0.25, 0.5), np.pi / 2, [[0.75, 1.75], [1.25, 1.75], [1.25, 2.25], [0.75, 2.25]], 0.0),
        (Capsule(0.1, 0.6), 0.0, [[1, 2]], 0.1),
        (Capsule(0.1, 0.6), np.pi / 2, [[1, 1.7], [1, 2.3]], 0.1),
        (Sphere(0.3), 0.4, [[1, 2]], 0.3),
        (Ellipsoid(0.3, 0.3, 0.1), 0.0, [[1, 2]], 0.3),
        (Box(0.4, 0.2, 0.6), 0.0, [[0.8, 1.9], [1.2, 1.9], [1.2, 2.1], [0.8, 2.1]], 0.0),
        (Box(0.4, 0.2, 0.6), np.pi / 2, [[0.8, 1.7], [1.2, 1.7], [1.2, 2.3], [0.8, 2.3]], 0.0),
    ],
)
def test_upright_and_lying_shapes_are_exact(shape, roll, vertices, radius):
    found = project(shape, RigidTransform(RollPitchYaw(roll, 0.0, 0.0), [1.0, 2.0, 3.0]))
    assert found.radius == pytest.approx(radius)
    order = np.lexsort(found.vertices.round(9).T)
    expected = np.array(vertices, dtype=float)
    assert found.vertices[order] == pytest.approx(expected[np.lexsort(expected.T)], abs=1e-9)


def test_hulls_are_counter_clockwise():
    ring = hull(np.array([[0, 0], [0, 1], [1, 1], [1, 0], [0.5, 0.5]])).vertices
    x, y = ring.T
    assert len(ring) == 4
    assert 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) == pytest.approx(1.0)


def test_flat_hull_keeps_a_thickness():
    found = hull(np.array([[0, 0], [1, 0], [0.5, 0]]))
    assert found.vertices.tolist() == [[0, 0], [1, 0]]
    assert 0.0 < found.radius <= 1e-6


def test_unbounded_shape_is_refused():
    with pytest.raises(TypeError, match=re.escape("HalfSpace has no bounded footprint")):
        project(HalfSpace(), RigidTransform())
