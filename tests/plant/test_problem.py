"""From a scenario and its models to a question: read once, with limits of speed and joints that are fixed."""

import gc
import re
import shutil
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.document import problem_digest
from coop_drake.cli.task import read_task
from coop_drake.errors import ScenarioError
from coop_drake.plant import build_robot_plant, build_team_plant, parsing, planning_problem, set_configuration
from coop_drake.plant.facts import models_digest, scenario_digest
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import point_levers, turn_levers
from tests.support.cases import CASES, case
from tests.support.edited_scenario import (
    MODELS,
    exchanged,
    shipped,
    team_of,
    write_edited,
    write_with_robot,
)
from tests.support.robot_models import Arm, urdf_arm

START = "object: {x: 0.9, y: 2, theta: 1.57}"

GOAL = "object: {x: 5, y: 8, theta: 4.663}  # joints are free"


def problem_of(scenario):
    team, _builder = team_of(scenario)
    return planning_problem(scenario, team)


@pytest.mark.parametrize("name", sorted(CASES))
def test_shipped_problem_is_that_of_the_case(name):
    problem, expected = problem_of(shipped(name)), case(name)
    assert problem.start == pytest.approx(expected.start)
    assert problem.goal_pose == pytest.approx(expected.goal_pose)
    assert problem.goal_joints == expected.goal_joints
    assert problem.settings == expected.settings
    assert (problem.position_tolerance, problem.angle_tolerance) == (0.01, 0.02)
    assert problem.workspace.symmetric_difference(expected.workspace).area == pytest.approx(0.0, abs=1e-9)


def test_joints_and_settings_go_through(tmp_path):
    path = write_edited(
        tmp_path,
        ("robot_1: [0.0]", "robot_1: [-0.25]"),
        (GOAL, "object: {x: 5, y: 8, theta: 4.663}\n  joints: {robot_1: [-1.6]}"),
        ("angle: 0.02}", "angle: 0.05, joint: 0.1}"),
        ("object: object\n", "object: object\nplanner: {margin: 0.02}\n"),
    )
    problem = problem_of(load_scenario(path))
    assert problem.start == pytest.approx([0.9, 2.0, 1.57, 0.0, -0.25])
    assert problem.goal_joints == (None, -1.6)
    assert (problem.angle_tolerance, problem.joint_tolerance) == (0.05, 0.1)
    assert problem.settings.margin == 0.02


def test_start_in_which_the_team_touches_itself_is_refused(tmp_path):
    path = write_edited(
        tmp_path,
        ("robot_2: [0.0]", "robot_2: [1.87]"),
        ("object: {x: 1.6, y: 2, theta: 1.57}", "object: {x: 1.3, y: 1.8, theta: 1.57}"),
        case="three",
    )
    gap = 0.25 + 0.35 * np.cos(1.87) - 0.25
    with pytest.raises(ScenarioError, match=f"object::body touches robot_2::base, clearance {gap:.4f} m"):
        problem_of(load_scenario(path))


def test_goal_needs_only_the_object_inside(tmp_path):
    """Whether the arms find room there is the planner's question."""
    path = write_edited(tmp_path, (GOAL, "object: {x: 6.3, y: 9.5, theta: 1.5707963}"))
    assert problem_of(load_scenario(path)).goal_pose == pytest.approx(np.array([6.3, 9.5, 1.5707963]))


def test_goal_may_be_beyond_a_wall_or_a_limit_by_its_tolerances(tmp_path):
    """The object is half a metre wide, its middle 0.245 m from the wall, the limit of a joint 1.87 rad."""
    goal = "object: {x: 6.355, y: 8, theta: 1.5707963}\n  joints: {robot_0: [1.885]}"
    path = write_edited(tmp_path, (GOAL.split("  #")[0], goal))
    assert problem_of(load_scenario(path)).goal_joints == (1.885, None)
    given = "tolerances: {position: 0.01, angle: 0.02}"
    for tolerances, message in (
        ("tolerances: {position: 0.001, angle: 0.001}", "object::body touches the walls"),
        ("tolerances: {joint: 0.01}", r"between its limits -1\.87 and 1\.87, or beyond one by"),
    ):
        path = write_edited(tmp_path, (GOAL.split("  #")[0], goal), (given, tolerances))
        with pytest.raises(ScenarioError, match=message):
            problem_of(load_scenario(path))


JOINTS_OF_GOAL = "object: {x: 5, y: 8, theta: 4.663}\n  joints: "
BEYOND = "robot_0::elbow between its limits -1.87 and 1.87"
REFUSALS = [
    (("robot_0: [0.0]", "robot_7: [0.0]"), "start.joints.robot_7", "one of robot_0, robot_1"),
    (("    robot_0: [0.0]\n", ""), "start.joints.robot_0", "a list of 1, the values of robot_0::elbow"),
    (("robot_0: [0.0]", "robot_0: [0.0, 1.0]"), "start.joints.robot_0", "a list of 1"),
    (("robot_0: [0.0]", "robot_0: [1.9]"), "start.joints.robot_0[0]", BEYOND),
    ((GOAL, JOINTS_OF_GOAL + "{robot_0: [-2]}"), "goal.joints.robot_0[0]", BEYOND),
    ((GOAL, JOINTS_OF_GOAL + "{arm: [0]}"), "goal.joints.arm", "one of robot_0, robot_1"),
    ((GOAL, JOINTS_OF_GOAL + "{robot_0: [0, null]}"), "goal.joints.robot_0", "a list of 1"),
    (
        (START, "object: {x: 0.9, y: 0.9, theta: 1.57}"),
        "start",
        "robot_1::base touches the walls, clearance -0.50",
    ),
    (
        (START, "object: {x: 0.9, y: 1.4, theta: 1.5707963267948966}"),
        "start",
        "robot_1::base touches the walls",
    ),
    ((GOAL, "object: {x: 4.1, y: 9.6, theta: 0}"), "goal.object", "object::body touches the walls"),
]


@pytest.mark.parametrize(("pair", "key", "allowed"), REFUSALS)
def test_nonsense_is_refused_with_its_key_and_what_is_allowed(pair, key, allowed, tmp_path):
    scenario = load_scenario(write_edited(tmp_path, pair))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        problem_of(scenario)
    assert caught.value.key == key


STATED = "angle: 0.02}\n"
"""Where the shipped scenario ends."""


def arm(*more):
    return Arm(joints=tuple(("revolute", "0 0 1", limit) for limit in more))


def limit(velocity, more=""):
    return f"<limit><lower>-1.2</lower><upper>1.5</upper><velocity>{velocity}</velocity>{more}</limit>"


def limits_of(path):
    return planning_problem(load_scenario(path)).limits


@pytest.mark.parametrize(
    ("said", "rates"),
    [
        ("{base_speed: 0.5, base_turn_rate: 0.8}", [0.7, 0.6]),
        ("{joint_rates: [0.2]}", [0.2, 0.2]),
        ("{joint_rates: [null, 0.3]}", [0.7, 0.3]),
    ],
)
def test_the_scenario_replaces_what_models_say(said, rates, tmp_path):
    path = write_with_robot(
        tmp_path, arm(limit(0.7), limit(0.6)).text(), "sdf", ("robot_0: [0.0]", "robot_0: [0.0, 0.0]"),
        (STATED, f"{STATED}limits: {{robot_0: {said}, '*': {{base_speed: 2}}}}"),
    )  # fmt: skip
    limits = limits_of(path)
    assert limits.joint_rates.tolist()[:2] == rates
    assert limits.base_speeds.tolist() == [0.5 if "speed" in said else np.inf, 2.0]
    assert limits.turn_rates.tolist() == [0.8 if "turn" in said else np.inf, np.inf]


def test_usual_limits_count_for_a_team_that_passes_where_nothing_is_stated():
    """Joints of the shipped models have a limit of their rates, 5 rad/s."""
    problem = planning_problem(shipped("base"))
    kept, resting = problem.kept_limits, replace(problem, passes=False).kept_limits
    assert [kept.base_speeds.tolist(), kept.turn_rates.tolist()] == [[1.0, 1.0], [1.5, 1.5]]
    assert [kept.base_accelerations.tolist(), kept.turn_accelerations.tolist()] == [[1.0, 1.0], [2.0, 2.0]]
    assert [kept.base_jerks.tolist(), kept.frictions.tolist()] == [[10.0, 10.0], [0.5, 0.5]]
    assert [kept.joint_rates.tolist(), kept.joint_accelerations.tolist()] == [[5.0, 5.0], [2.0, 2.0]]
    assert kept.object_acceleration.tolist() == [1.5]
    assert not np.isfinite(resting.base_speeds).any()


@pytest.mark.parametrize("velocity", ["0", "nan"])
def test_an_impossible_limit_is_refused_with_its_joint_or_line(velocity, tmp_path):
    path = write_with_robot(tmp_path, arm(limit(velocity)).text())
    with pytest.raises(ScenarioError) as caught:
        planning_problem(load_scenario(path))
    assert caught.value.key.startswith("directives[")
    assert ("robot_0::joint_0" if velocity == "0" else "'nan' in <velocity>") in str(caught.value)


def test_a_negative_limit_of_urdf_is_refused_before_drake_ends_the_process(tmp_path):
    text = urdf_arm().replace('velocity="1"', 'velocity="-1"', 1)
    with pytest.raises(ScenarioError, match=r"line 2\d: '-1' in velocity of <limit> is negative"):
        planning_problem(load_scenario(write_with_robot(tmp_path, text, "urdf")))


def test_as_many_limits_as_joints_are_expected(tmp_path):
    for key in ("joint_rates", "joint_accelerations"):
        path = write_edited(tmp_path, (STATED, f'{STATED}limits: {{"*": {{{key}: [1, 2]}}}}'))
        with pytest.raises(ScenarioError, match=rf"limits\.\*\.{key}: .* a list of 1, for robot_0::"):
            planning_problem(load_scenario(path))


def test_limits_change_the_question(tmp_path):
    stated = 'limits: {"*": {base_speed: 0.5, joint_accelerations: [3]}}'
    path = write_edited(tmp_path, (STATED, STATED + stated))
    digests = {problem_digest(planning_problem(load_scenario(path)))}
    for less in ("", 'limits: {"*": {base_speed: 0.5}}'):
        digests.add(
            problem_digest(planning_problem(load_scenario(write_edited(tmp_path, (STATED, STATED + less)))))
        )
    assert len(digests) == 3


@pytest.mark.parametrize("name", ["base", "elbow", "three"])
def test_levers_bound_how_a_base_moves(name):
    problem = planning_problem(shipped(name))
    tree, limits, step = problem.tree, problem.limits, 1e-6
    generator = np.random.default_rng(1)
    lower, upper = np.array([-np.pi, *tree.joint_lower]), np.array([np.pi, *tree.joint_upper])
    for component, point in zip(limits.base_components, limits.base_points, strict=True):
        levers, turning = point_levers(tree, component, point), turn_levers(tree, component)
        for axis in range(len(levers)):
            for _ in range(5):
                z = np.array([1.0, 2.0, *generator.uniform(lower, upper)])
                moved = z + step * np.eye(len(z))[2 + axis]
                one, other = tree.poses(z)[component], tree.poses(moved)[component]
                distance = np.hypot(*(other.apply(np.array(point)) - one.apply(np.array(point)))) / step
                assert distance <= levers[axis] + 1e-6
                assert abs(other.angle - one.angle) / step == pytest.approx(turning[axis], abs=1e-6)
    straight = np.zeros(3 + len(tree.joints))
    turned = straight + step * np.eye(len(straight))[2]
    ends = [tree.poses(z)[component].apply(np.array(point)) for z in (straight, turned)]
    assert np.hypot(*(ends[1] - ends[0])) / step == pytest.approx(levers[0], rel=1e-3)  # arms are straight


@pytest.mark.parametrize(
    ("text", "ending", "joints", "expected"),
    [
        (arm(limit(0.7), "", limit(-1)).text(), "sdf", 3, {"joint_rates": [0.7, np.inf, np.inf]}),
        (
            arm(limit(1, "<effort>7</effort><drake:acceleration>3</drake:acceleration>"), limit(1)).text(),
            "sdf",
            2,
            {"joint_accelerations": [3.0, np.inf, 4.0], "joint_efforts": [7.0, np.inf, np.inf]},
        ),
        (
            urdf_arm().replace('velocity="1"', 'velocity="1" drake:acceleration="3"', 1),
            "urdf",
            2,
            {"joint_rates": [1.0, 1.0], "joint_accelerations": [3.0, np.inf], "joint_efforts": [np.inf] * 3},
        ),
    ],
)
def test_limits_of_models_are_read_and_those_without_are_unknown(text, ending, joints, expected, tmp_path):
    """No joint of the URDF has a transmission, so that no effort is known."""
    for root in ("<sdf ", "<robot "):
        text = text.replace(root, root + 'xmlns:drake="drake.mit.edu" ', 1)
    start = "robot_0: [0.0]", f"robot_0: {[0.0, 0.1, 0.0][:joints]}"
    path = write_with_robot(
        tmp_path, text, ending, start, ("y: 2,", "y: 1.8,"),
        (STATED, f"{STATED}limits: {{robot_1: {{joint_accelerations: [4]}}}}"),
    )  # fmt: skip
    limits = limits_of(path)
    for name, values in expected.items():
        assert getattr(limits, name).tolist()[: len(values)] == values
    assert np.isinf(limits.base_speeds).all()


UP, ACROSS, LIFT = ("revolute", "0 0 1", ""), ("revolute", "0 1 0", ""), ("prismatic", "0 0 1", "")


def fixing(folder, arm, fixed, joints="[0.0]", ending="sdf", *pairs):
    text = arm if isinstance(arm, str) else arm.text()
    path = write_with_robot(folder, text, ending, ("robot_0: [0.0]", f"robot_0: {joints}"), *pairs)
    path.write_text(path.read_text() + f"\nfixed_joints: {{robot_0: {fixed}}}\n")
    return path


def joints_of_first(team):
    return [name for name in team.joint_names if name.startswith("robot_0")]


def test_a_joint_that_leaves_the_plane_is_refused_with_its_name_until_it_is_fixed(tmp_path):
    arm = Arm(joints=(UP, ACROSS))
    scenario = load_scenario(write_with_robot(tmp_path, arm.text()))
    with pytest.raises(ScenarioError, match=r"'robot_0::joint_1'.*a value for it under fixed_joints.robot_0"):
        team_of(scenario)
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, "{joint_1: 0}")))
    assert joints_of_first(team) == ["robot_0::joint_0"]


@pytest.mark.parametrize("value", [0.0, 0.3, -1.1])
def test_a_fixed_joint_stands_at_its_value(tmp_path, value):
    """The base hangs where the same arm would hold it with that joint there."""
    arm = Arm(joints=(UP, UP))
    fixed, _ = team_of(load_scenario(fixing(tmp_path, arm, f"{{joint_1: {value}}}")))
    free, _ = team_of(load_scenario(write_with_robot(tmp_path, arm.text())))
    poses = []
    for team, joint in ((fixed, None), (free, "joint_1")):
        context = team.plant.CreateDefaultContext()
        if joint:
            team.plant.GetJointByName(joint).set_angle(context, value)
        poses.append(team.robots[0].base_body.EvalPoseInWorld(context))
    assert poses[0].IsNearlyEqualTo(poses[1], 1e-12)


def test_patterns_fix_all_but_what_is_named_null(tmp_path):
    arm = Arm(joints=(UP, ACROSS, UP, ACROSS))
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, '{"joint_*": 0, joint_2: null}')))
    assert joints_of_first(team) == ["robot_0::joint_2"]
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, '{"joint_?": 0, joint_0: 0.5}')))
    assert joints_of_first(team) == []


def test_other_kinds_of_joints_are_fixed_at_zero(tmp_path):
    path = fixing(tmp_path, urdf_arm("planar"), "{yaw: 0}", "[0.1]", "urdf")
    team, _ = team_of(load_scenario(path))
    assert joints_of_first(team) == ["robot_0::reach"]
    path.write_text(exchanged(path.read_text(), ("{yaw: 0}", "{yaw: 0.5}")))
    with pytest.raises(ScenarioError, match="0, the only place where a planar joint can be fixed"):
        team_of(load_scenario(path))


def test_footprints_are_those_of_the_fixed_place(tmp_path):
    """A link of 0.4 m that is lifted by 60 degrees covers half its length on the floor."""
    path = fixing(tmp_path, Arm(joints=(UP, ACROSS)), "{joint_1: 1.0472}")
    level = "{base_frame: robot_0::gripper, rotation: !Rpy {deg: [0, 60, 0]}}"
    weld = "- add_weld: {parent: object::grasp_0, child: robot_0::gripper}"
    upright = weld.replace("robot_0::gripper", "level")
    frame = f"- add_frame: {{name: level, X_PF: {level}}}"
    text = exchanged(path.read_text(), (weld, f"{frame}\n{upright}"))
    path.write_text(text)
    problem = read_task(path, None).problem
    (link,) = [b for c in problem.tree.components for b in c.bodies if b.name == "robot_0::link_2"]
    width = np.ptp(np.vstack([shape.vertices for shape in link.shapes]), axis=0).max()
    assert width == pytest.approx(0.4 * 0.5 + 0.1 * np.sin(np.pi / 3), abs=1e-3)


REFUSED = {
    "no such joint": ("{wheel: 0}", r"fixed_joints.robot_0.wheel", "a joint that can move, or a pattern"),
    "no match": ('{"*wheel*": 0}', r"fixed_joints.robot_0.*wheel*", "joint_0, joint_1"),
    "twice": ('{"joint*": 0, "*_1": 0}', r"fixed_joints.robot_0.*_1", "one pattern for joint_1"),
    "beyond its limits": ("{joint_1: 2.0}", r"fixed_joints.robot_0.joint_1", "between the joint's limits"),
}


@pytest.mark.parametrize(("fixed", "key", "allowed"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_fixed_is_refused(tmp_path, fixed, key, allowed):
    with pytest.raises(ScenarioError) as caught:
        team_of(load_scenario(fixing(tmp_path, Arm(joints=(UP, UP)), fixed)))
    assert caught.value.key == key
    assert allowed in caught.value.allowed


def test_an_unknown_robot_is_refused(tmp_path):
    path = fixing(tmp_path, Arm(), "{}")
    path.write_text(exchanged(path.read_text(), ("fixed_joints: {robot_0:", "fixed_joints: {robot_7:")))
    with pytest.raises(ScenarioError, match=r"fixed_joints.robot_7: 'robot_7'.*robot_0, robot_1"):
        load_scenario(path)


LONG_BLUE = "package://coop_drake_models/long_blue.sdf"

MESH = "v 0 0 0\nv 0.1 0 0\nv 0 {y} 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


WITH_MESH = (
    "<collision name='tip'><pose>0.1 0 0.2 0 0 0</pose><geometry><mesh>{uri}</mesh></geometry>"
    "</collision>\n    <collision"
)


def write_team(folder, uri="<uri>tip.obj</uri>", edits=()):
    """The base scenario with a robot of its own, whose collision geometry has a mesh."""
    parts = folder / "parts"
    parts.mkdir(parents=True, exist_ok=True)
    model = exchanged(
        (MODELS / "long_blue.sdf").read_text(), ("<collision", WITH_MESH.format(uri=uri)), *edits
    )
    (parts / "arm.sdf").write_text(model)
    (parts / "tip.obj").write_text(MESH.format(y=0.1))
    return write_edited(folder, (LONG_BLUE, "parts/arm.sdf"))


@pytest.mark.parametrize("uri", ["<uri>tip.obj</uri>", "<uri><!-- the tip -->tip&#46;obj</uri>"])
def test_a_mesh_that_grows_asks_another_question_however_it_is_named(uri, tmp_path):
    path = write_team(tmp_path, uri)
    before, models = read_task(path).problem, models_digest(load_scenario(path))
    (tmp_path / "parts" / "tip.obj").write_text(MESH.format(y=0.3))
    assert problem_digest(read_task(path).problem) != problem_digest(before)
    assert models_digest(load_scenario(path)) != models


def test_a_digest_of_models_sees_what_a_run_takes_from_them_and_not_where_they_are(tmp_path):
    edits = [
        (),
        (("<mass>6</mass>", "<mass>6.1</mass>"),),
        (("</limit>", "</limit><dynamics><damping>1</damping></dynamics>"),),
        (("</limit>", "<effort>7</effort></limit>"),),
        (("</limit>", "</limit><dynamics><spring_stiffness>1</spring_stiffness></dynamics>"),),
        (("</limit>", "</limit><dynamics><spring_stiffness>2</spring_stiffness></dynamics>"),),
    ]
    paths = [write_team(tmp_path / str(place), edits=edit) for place, edit in enumerate(edits)]
    paths += [write_team(tmp_path / "elsewhere" / "same")]
    scenarios = [load_scenario(path) for path in paths]
    digests = [models_digest(one) for one in scenarios]
    assert digests[-1] == digests[0]
    assert len(set(digests)) == len(edits)
    assert len({scenario_digest(one) for one in scenarios}) == len(edits)
    assert scenario_digest(scenarios[0], digests[1]) == scenario_digest(scenarios[1])


@pytest.fixture
def readings(monkeypatch):
    """Receives an entry whenever Drake reads models."""
    made, read = [], parsing.process

    def counted(assembly, indices, *places):
        made.append(len(indices))
        return read(assembly, indices, *places)

    monkeypatch.setattr(parsing, "process", counted)
    return made


def test_plants_of_one_scenario_are_read_once_and_move_apart(readings):
    scenario = shipped("base")
    first, second = (built(scenario) for _ in range(2))
    assert len(readings) == 1
    n = len(first[0].joints)
    z = np.linspace(0.1, 0.5, 3 + n)
    contexts = [diagram.CreateDefaultContext() for _, diagram in (first, second)]
    own = [
        team.plant.GetMyMutableContextFromRoot(c)
        for (team, _), c in zip((first, second), contexts, strict=True)
    ]
    set_configuration(first[0], own[0], z)
    np.testing.assert_array_equal(first[0].plant.GetPositions(own[0])[first[0].position_index], z)
    assert not second[0].plant.GetPositions(own[1]).any()
    for team, _ in (first, second):
        parts = [team.object_frame, team.object_joint, *team.joints, *(r.base_body for r in team.robots)]
        assert all(part.GetParentPlant() is team.plant for part in parts)


def built(scenario):
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    return team, builder.Build()


def test_a_robot_that_errs_about_its_masses_leaves_other_robots_of_the_scenario_alone(readings):
    scenario = shipped("base")
    light, heavy = (build_robot_plant(scenario, 0) for _ in range(2))
    heavy.scale_masses(2.0)
    assert len(readings) == 1
    masses = [robot.plant.CalcTotalMass(robot.context) for robot in (light, heavy)]
    assert masses[1] == pytest.approx(2.0 * masses[0])


def test_models_that_are_read_as_texts_are_those_that_drake_reads_from_files(scenario, monkeypatch):
    digest = models_digest(scenario)
    monkeypatch.setattr(parsing, "_sdf_text", lambda model: "")
    assert models_digest(replace(scenario)) == digest


def test_a_scenario_that_is_loaded_again_reads_changed_models(tmp_path):
    for path in MODELS.iterdir():
        shutil.copy(path, tmp_path)
    before = build_team_plant(load_scenario(tmp_path / "base.scenario.yaml"), DiagramBuilder())
    model = tmp_path / "object.sdf"
    mass = before.object_inertia.mass
    model.write_text(model.read_text().replace(f"<mass>{mass:g}", f"<mass>{2 * mass:g}"))
    after = build_team_plant(load_scenario(tmp_path / "base.scenario.yaml"), DiagramBuilder())
    assert after.object_inertia.mass == pytest.approx(2.0 * mass)


def test_what_was_read_is_forgotten_with_the_scenario():
    scenario = shipped("base")
    build_robot_plant(scenario, 0)
    plant, scenario = ref(build_robot_plant(scenario, 0).plant), None
    gc.collect()
    assert plant() is None
