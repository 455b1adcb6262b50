import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.tree.team_arrays import place
from tests.support.trees import trees


@settings(max_examples=40)
@given(st.data())
def test_no_point_of_the_team_is_beyond_its_reach(data: st.DataObject) -> None:
    tree = data.draw(trees())
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    for share in random.integers(0, 2, (20, len(tree.joints))):
        joints = tree.range_lower + share * (tree.range_upper - tree.range_lower)
        poses = tree.poses((0.0, 0.0, 0.7, *joints))
        for X_WC, component in zip(poses, tree.components, strict=True):
            for shape in (shape for body in component.bodies for shape in body.shapes):
                assert np.hypot(*X_WC.apply(shape.vertices).T).max() + shape.radius <= tree.reach + 1e-12


@settings(max_examples=40)
@given(st.data())
def test_compiled_poses_are_the_same_numbers(data: st.DataObject) -> None:
    tree = data.draw(trees())
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    z = random.normal(size=3 + len(tree.joints))
    rows = place(tree.arrays, z)
    assert [(pose.x, pose.y, pose.angle) for pose in tree.poses(z)] == [
        tuple(row) for row in rows[:, [0, 1, 4]].tolist()
    ]
