from dataclasses import fields, replace

import numpy as np
import pytest

from coop_drake.answers.log import SimulationLog
from coop_drake.errors import PlanError

ROWS, ROBOTS, JOINTS = 5, 2, 3
SIZES = {"N": ROBOTS, "n": JOINTS, "1 + n": 1 + JOINTS, "3 + n": 3 + JOINTS}
ROW_SHAPES = {f.name: f.metadata["shape"][1:] for f in fields(SimulationLog) if "T" in f.metadata["shape"]}
SHAPES = {name: tuple(SIZES.get(size, size) for size in shape) for name, shape in ROW_SHAPES.items()}


@pytest.fixture
def log():
    generator = np.random.default_rng(7)
    arrays = {name: generator.normal(size=(ROWS, *shape)) for name, shape in SHAPES.items()}
    arrays["cell_index"] = np.arange(ROWS)
    return SimulationLog(
        **arrays,
        reached=True,
        violation="",
        joint_names=("a::one", "a::two", "b::one"),
        robot_names=("a", "b"),
        plan_digest="1f",
        scenario_digest="2e",
    )


def test_a_log_survives_its_file_bit_by_bit(log, tmp_path):
    path = tmp_path / "log.npz"
    log.save(path)
    again = SimulationLog.load(path)
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))
    assert (again.reached, again.violation) == (True, "")
    assert again.joint_names == log.joint_names
    assert again.robot_names == log.robot_names
    assert (again.plan_digest, again.scenario_digest) == ("1f", "2e")


@pytest.mark.parametrize("lacking", ["times", "object_pose", "plan_digest"])
def test_a_file_that_lacks_an_array_is_no_log_and_names_it(log, tmp_path, lacking):
    path = tmp_path / "log.npz"
    log.save(path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files if name != lacking}
    np.savez(path, **arrays)
    with pytest.raises(PlanError, match=rf"log\.npz: not a simulation log; it lacks {lacking}; expected"):
        SimulationLog.load(path)


def test_a_violation_survives_its_file(log, tmp_path):
    path = tmp_path / "log.npz"
    replace(log, reached=False, violation="workspace clearance -0.01 m at t = 2 s").save(path)
    again = SimulationLog.load(path)
    assert again.reached is False
    assert again.violation == "workspace clearance -0.01 m at t = 2 s"
