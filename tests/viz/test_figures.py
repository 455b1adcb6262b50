"""The figures of a run and of a search for gains: which files, and what is drawn in them."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.patches import FancyBboxPatch
from PIL import Image

from coop_drake.answers.problem import TeamLimits
from coop_drake.answers.speeds import base_speeds
from coop_drake.diagram import TELEMETRY
from coop_drake.drawing.colours import INK, OBJECT, robot_colour
from coop_drake.errors import ProcessError
from coop_drake.laws import ScheduledGains
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tuning import CRITERIA, GainTrial, Limit, Objective, Search, TrialOutcome
from coop_drake.viz import write_figures
from coop_drake.viz.block_diagram import block_diagram_figure, signal_flow
from coop_drake.viz.drawing_processes import DrawingProcesses
from coop_drake.viz.figures import (
    angle_figure,
    break_at_switches,
    figures_of,
    joints_figure,
    path_figure,
    start_and_goal_figure,
    summary_figure,
)
from coop_drake.viz.tuning_figure import tuning_figure
from tests.support.cases import case
from tests.support.figure_names import OF_EVERY_RUN, OF_TWO_ROBOTS
from tests.support.scenarios import MODELS
from tests.support.small_loop import small_loop
from tests.support.synthetic_log import synthetic_log, synthetic_plan


def with_sliding_joint(tree: ComponentTree) -> ComponentTree:
    """The same tree but for its last joint, which slides along its x axis, from -0.1 m to 0.1 m."""
    last = tree.joints[-1]
    slider = replace(last, kind="prismatic", axis=(1.0, 0.0), lower=-0.1, upper=0.1)
    components = [replace(c, joint=slider) if c.joint == last else c for c in tree.components]
    return replace(tree, components=tuple(components))


def run_of(name):
    """Question, plan and log of a run."""
    problem = case(name)
    return problem, synthetic_plan(problem), synthetic_log(problem)


def test_a_run_gets_figures_4_to_13_and_a_summary_as_png(tmp_path):
    written = write_figures(*run_of("three"), tmp_path)
    expected = OF_EVERY_RUN + OF_TWO_ROBOTS + ("fig11_joints_robot_2",)
    assert sorted(path.stem for path in written) == sorted(expected)
    assert sorted(tmp_path.iterdir()) == sorted(written)
    for path in written:
        with Image.open(path) as image:
            assert image.format == "PNG"
            grey = np.asarray(image.convert("L"))
        assert min(grey.shape) > 300
        assert np.ptp(grey) > 100


def test_the_same_run_gives_the_same_pictures_and_a_process_writes_only_those_that_it_is_given(tmp_path):
    run, written = run_of("elbow"), []
    names = [name for name, _ in figures_of(*run)]
    assert sorted(names) == sorted(OF_EVERY_RUN + OF_TWO_ROBOTS)
    for folder in ("one", "other"):
        paths = write_figures(*run, tmp_path / folder, numbers=iter([5, 2]))
        assert [path.stem for path in paths] == [names[5], names[2]]
        written.append([path.read_bytes() for path in paths])
    assert written[0] == written[1]


def test_figure_4_labels_start_and_goal_on_equal_axes_in_metres():
    problem = case("base")
    (axes,) = start_and_goal_figure(problem.workspace, problem.tree, synthetic_plan(problem)).axes
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    labels = {text.get_text(): text.xy for text in axes.texts}
    assert labels["start"] == pytest.approx((0.9, 2.0))
    assert labels["goal"] == pytest.approx((5.0, 8.0))


def test_figure_5_draws_the_path_that_was_logged_and_every_robot_in_its_colour_and_says_when():
    problem = case("base")
    log = synthetic_log(problem)
    figure = path_figure(problem.workspace, problem.tree, log)
    (axes,) = figure.axes
    np.testing.assert_array_equal(axes.lines[0].get_xydata(), log.object_pose[:, :2])
    assert axes.lines[0].get_color() == INK
    assert "(black line)" in figure.texts[0].get_text()
    first, *_, last = [one for one in axes.collections if isinstance(one, PathCollection)]
    shown = {to_hex(colour).lower() for colour in last.get_edgecolors()}
    assert shown == {colour.lower() for colour in (OBJECT, robot_colour(0), robot_colour(1))}
    assert first.get_facecolors()[0, 3] < last.get_facecolors()[0, 3]
    assert axes.texts[-1].get_text() == f"{log.times[-1]:.1f}"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["object", *log.robot_names]


# The summary: what is drawn, beside which limits.


def bases_of(tree: ComponentTree) -> tuple[int, ...]:
    """The component of every robot's base: the last one that its joints carry."""
    joints = [component.joint for component in tree.components]
    robots = [-1 if joint is None else joint.robot for joint in joints]
    return tuple(max(i for i, robot in enumerate(robots) if robot == k) for k in range(max(robots) + 1))


def summary_of(name, *, passes, **limits):
    """Question, log and panels of the summary of a run whose bases start to turn, with some limits."""
    problem = case(name)
    bases = bases_of(problem.tree)
    known = TeamLimits(
        bases, ((0.0, 0.0),) * len(bases), joint_rates=np.full(len(problem.tree.joints), np.inf)
    )
    problem, log = replace(problem, limits=replace(known, **limits)), synthetic_log(problem)
    turning = np.zeros_like(log.accelerations)
    turning[:, 2] = 3.0
    log = replace(log, accelerations=turning, object_twist=np.zeros_like(log.object_twist))
    log = replace(log, joint_rates=np.zeros_like(log.joint_rates))
    phases = np.zeros((len(log.times), len(bases), 3)) if passes else log.phases
    log = replace(log, phases=phases)
    return problem, log, summary_figure(problem, log).axes


def limits_drawn(axes):
    """Heights and colours of the dashed lines of a panel."""
    lines = [line for line in axes.lines if line.get_linestyle() == "--"]
    return [(float(line.get_ydata()[0]), line.get_color()) for line in lines]


def words_of(axes):
    return [text.get_text() for text in axes.texts]


def test_the_summary_shows_speeds_accelerations_forces_and_clearances():
    problem, log = case("three"), synthetic_log(case("three"))
    speeds, accelerations, forces, clearances = summary_figure(problem, log).axes
    fastest, of_object = speeds.lines
    assert fastest.get_ydata().max() == pytest.approx(base_speeds(log)[1][..., 0].max())
    np.testing.assert_allclose(of_object.get_ydata(), np.hypot(*log.object_twist[:, :2].T))
    (of_object,) = accelerations.lines  # It is not known where the bases are.
    np.testing.assert_allclose(of_object.get_ydata(), np.hypot(*log.accelerations[:, :2].T))
    (strongest,) = forces.lines
    np.testing.assert_allclose(
        strongest.get_ydata(), np.linalg.norm(log.base_wrenches[..., :2], axis=2).max(axis=1)
    )
    np.testing.assert_array_equal(clearances.lines[0].get_ydata(), log.workspace_clearance)
    np.testing.assert_array_equal(clearances.lines[1].get_ydata(), log.body_clearance)
    assert not any(isinstance(lines, LineCollection) and lines.get_segments() for lines in speeds.collections)
    assert [ax.get_title(loc="left") for ax in (accelerations, forces)] == ["no limit is known"] * 2


def test_a_base_is_accelerated_by_what_turns_the_object_under_it():
    problem, log, (_, accelerations, *_) = summary_of("base", passes=False)
    most, of_object = accelerations.lines
    (x, y, _), poses = log.object_pose[0], problem.tree.poses(np.append(log.object_pose[0], log.joints[0]))
    arms = [np.hypot(poses[i].x - x, poses[i].y - y) for i in bases_of(problem.tree)]
    assert most.get_ydata()[0] == pytest.approx(3.0 * max(arms))
    assert not of_object.get_ydata().any()


def test_usual_limits_are_drawn_once_where_a_team_passes_and_none_where_it_rests():
    assert [limits_drawn(ax) for ax in summary_of("base", passes=False)[2]] == [[], [], [], []]
    _, _, (speeds, accelerations, forces, _) = summary_of("base", passes=True)
    assert limits_drawn(speeds) == [(1.0, INK)]
    assert limits_drawn(accelerations) == [(1.0, INK), (1.5, OBJECT)]
    assert limits_drawn(forces) == []  # The masses are not known.
    assert words_of(speeds) == ["limit of bases: 1 m/s"]
    assert words_of(accelerations) == ["limit of bases: 1 m/s²", "limit of the object: 1.5 m/s²"]


def test_bases_with_limits_of_their_own_have_curves_of_their_own_in_their_colours():
    stated = np.array([0.5, 2.0, 0.5])
    _, log, (speeds, *_) = summary_of("three", passes=False, base_speeds=stated)
    slow, fast, _, *_ = speeds.lines
    means = base_speeds(log)[1][..., 0]
    np.testing.assert_array_equal(slow.get_ydata(), means[:, [0, 2]].max(axis=1))
    np.testing.assert_array_equal(fast.get_ydata(), means[:, 1])
    assert limits_drawn(speeds) == [(0.5, robot_colour(0)), (2.0, robot_colour(1))]
    assert words_of(speeds) == ["limit of robot_0, robot_2: 0.5 m/s", "limit of robot_1: 2 m/s"]
    share = max(means[:, [0, 2]].max() / 0.5, means[:, 1].max() / 2.0)
    assert speeds.get_title(loc="left").startswith(f"at most {share:.1%} of a limit")


def test_a_limit_that_is_far_from_all_values_is_named_and_does_not_press_the_curves_flat():
    _, log, (_, _, forces, _) = summary_of("base", passes=False, base_forces=np.full(2, 1000.0))
    assert words_of(forces) == ["↑ limit of bases: 1000 N"]
    largest = np.linalg.norm(log.base_wrenches[..., :2], axis=2).max()
    assert forces.get_ylim()[1] == pytest.approx(1.25 * largest)


def test_figure_7_shows_the_angle_its_funnel_and_a_dashed_line_at_every_switch():
    problem = case("base")
    log = synthetic_log(problem)
    axes, from_middle = angle_figure(log).axes
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.lines]
    _, theta = break_at_switches(log, log.object_pose[:, 2])
    assert any(np.array_equal(values, theta, equal_nan=True) for values in drawn)
    lower, upper = (np.asarray(line.get_ydata(), dtype=float) for line in from_middle.lines[:2])
    np.testing.assert_allclose(lower, -upper, rtol=0, atol=1e-12)
    switches = log.times[1:][np.diff(log.cell_index) != 0]
    assert len(switches) == log.cell_index.max()
    dashed = next(lines for lines in axes.collections if isinstance(lines, LineCollection))
    assert [segment[:, 0].tolist() for segment in dashed.get_segments()] == [[t, t] for t in switches]


@pytest.mark.parametrize(("changed", "unit"), [(lambda tree: tree, "rad"), (with_sliding_joint, "m")])
def test_every_joint_of_a_robot_has_its_own_axes_in_its_unit(changed, unit):
    problem = case("elbow")
    figure = joints_figure(changed(problem.tree), synthetic_log(problem), 1)
    assert figure is not None
    assert [axes.get_ylabel() for axes in figure.axes] == ["joint_1 [rad]", f"joint_2 [{unit}]"]


BEFORE = dict.fromkeys(CRITERIA, 1.0) | {"time": 20.0, "peak_force": 200.0}


def trial(time, force, *, arrived=True):
    values = BEFORE | {"time": time, "peak_force": force} if arrived else {}
    return GainTrial(ScheduledGains(), TrialOutcome(arrived, float(arrived), values, ""))


@pytest.fixture
def found():
    objective = Objective({"peak_force": 1.0}, (Limit("time", at_most=True, value=15.0),), BEFORE)
    search = Search(objective)
    for one in (trial(20.0, 200.0), trial(0.0, 0.0, arrived=False), trial(14.0, 150.0), trial(14.0, 180.0)):
        search.add(one)
    return search


def test_the_best_score_falls_from_the_first_run_within_all_limits(found):
    _, fall = tuning_figure(found).axes
    (line,) = fall.lines
    np.testing.assert_allclose(line.get_xydata(), [(2.0, 0.75), (3.0, 0.75)])


def test_what_breaks_a_limit_and_what_is_chosen_are_distinguished(found):
    plane, _ = tuning_figure(found).axes
    drawn = {line.get_label(): line.get_xydata().tolist() for line in plane.lines if len(line.get_xdata())}
    assert drawn["breaks a limit"] == [[20.0, 200.0]]
    assert drawn["keeps all limits"] == [[14.0, 150.0], [14.0, 180.0]]
    assert drawn["chosen"] == [[14.0, 150.0]]


# The block diagram shows what is wired, and nothing else.


@pytest.fixture(scope="module")
def loop():
    return small_loop("three")


@pytest.fixture(scope="module")
def controller(loop):
    return signal_flow(loop.bare_controllers[1], "controller", telemetry=frozenset(TELEMETRY))


def test_every_block_and_every_connection_of_the_loop_is_there(loop):
    flow = signal_flow(loop.diagram, "loop")
    assert {block.name for block in flow.blocks} == {
        system.get_name() for system in loop.diagram.GetSystems()
    }
    assert len(flow.signals) == len(loop.diagram.connection_map())
    assert {(s.source, s.sink) for s in flow.signals if s.output == "ready"} == {
        (f"robot_{k}_controller", "cell_planner") for k in range(3)
    }


def test_the_picture_names_every_block_and_port(loop, controller):
    figure = block_diagram_figure(loop, robot=1)
    texts = {text.get_text() for ax in figure.axes for text in ax.texts}
    for block in controller.blocks:
        assert {block.name.replace("_", " "), *block.inputs, *block.outputs} <= texts
    assert {"robot 2 controller", "cell planner", "transport station"} <= texts
    assert "Controller of robot 1" in {text.get_text() for text in figure.axes[1].texts}


def test_the_picture_fits_a_page_turned_sideways_and_its_texts_their_blocks(loop):
    figure = block_diagram_figure(loop)
    width, height = figure.get_size_inches()
    assert width <= 11.69
    assert height <= 8.27
    figure.draw_without_rendering()
    for ax in figure.axes:
        blocks = [patch.get_window_extent() for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
        for text in ax.texts[1:]:
            place = text.get_window_extent()
            assert any(block.x0 <= place.x0 and place.x1 <= block.x1 for block in blocks)


def test_a_robot_that_is_not_there_is_refused(loop):
    with pytest.raises(IndexError, match="robot 3 is not in the team of 3"):
        block_diagram_figure(loop, robot=3)


# Processes that draw a run: what they write, and how their failures and the end of a command reach them.


@pytest.fixture
def drawing():
    """Processes that were told the plan of a run, and the run's log."""
    problem, scenario = case("base"), load_scenario(MODELS / "base.scenario.yaml")
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        yield processes, synthetic_log(problem)


def alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_both_write_what_they_draw_and_end(drawing, tmp_path):
    processes, log = drawing
    processes.draw(log, tmp_path)
    processes.wait("recording", "figures")
    names = {path.name for path in tmp_path.iterdir()}
    assert {"transport.html", "fig04_start_and_goal.png", "fig05_path.png", "summary.png"} <= names
    assert not any(alive(process.pid) for process, _ in processes._running.values())


def test_what_goes_wrong_in_a_process_is_raised_here(drawing, tmp_path):
    processes, log = drawing
    taken = tmp_path / "taken"
    taken.write_text("")
    processes.draw(log, taken)
    with pytest.raises(OSError, match=r"Not a directory|File exists"):
        processes.wait("recording", "figures")


def test_a_process_that_is_ended_is_named(drawing, tmp_path):
    processes, log = drawing
    processes._running["recording"][0].kill()
    processes.draw(log, tmp_path)
    with pytest.raises(ProcessError, match="the process that draws the recording ended with code -9"):
        processes.wait("recording", "figures")


def test_both_end_with_the_block_and_with_the_command():
    problem, scenario = case("base"), load_scenario(MODELS / "base.scenario.yaml")
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        begun = [process for process, _ in processes._running.values()]
        assert [process.is_alive() for process in begun] == [True, True]
    assert not any(process.is_alive() for process in begun)
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        for _, connection in processes._running.values():
            connection.close()  # As the end of the command closes it.
        for process, _ in processes._running.values():
            process.join(timeout=300)
            assert process.exitcode == 0
