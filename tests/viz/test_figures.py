"""The figures of a run and of a search for gains: which files, and what is drawn in them."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex
from PIL import Image

from coop_drake.answers.speeds import base_speeds
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.drawing.colours import INK, OBJECT, robot_colour
from coop_drake.laws import ScheduledGains
from coop_drake.tuning import CRITERIA, GainTrial, Limit, Objective, Search, TrialOutcome
from coop_drake.viz import write_figures
from coop_drake.viz.figures import (
    RunFigures,
    TimeAxes,
    angle_figure,
    break_at_switches,
    joints_figure,
    path_figure,
    position_figure,
    start_and_goal_figure,
    summary_figure,
)
from coop_drake.viz.tuning_figure import tuning_figure
from tests.support.cases import case
from tests.support.figure_names import OF_EVERY_RUN, OF_TWO_ROBOTS
from tests.support.sliding import with_sliding_joint
from tests.support.synthetic_log import synthetic_log, synthetic_plan


def run_of(name):
    """Floor, tree, plan and log of a run."""
    problem = case(name)
    return problem.workspace, problem.tree, synthetic_plan(problem), synthetic_log(problem)


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
    *known, log = run_of("elbow")
    written = []
    for folder in ("one", "other"):
        figures = RunFigures(*known)
        names = figures.names(log)
        assert sorted(names) == sorted(OF_EVERY_RUN + OF_TWO_ROBOTS)
        paths = figures.write(log, tmp_path / folder, numbers=iter([5, 2]))
        assert [path.stem for path in paths] == [names[5], names[2]]
        written.append([path.read_bytes() for path in paths])
    assert written[0] == written[1]


def test_axes_made_ahead_give_the_same_pictures():
    log = synthetic_log(case("elbow"))
    with house_style():
        ahead = TimeAxes([2, 3, 2])
        for draw in (position_figure, angle_figure, summary_figure, position_figure):
            assert picture_of(draw(log, ahead)) == picture_of(draw(log))


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


def test_the_summary_has_five_lines():
    log = synthetic_log(case("three"))
    clearances, speeds, forces = summary_figure(log).axes
    np.testing.assert_array_equal(clearances.lines[0].get_ydata(), log.workspace_clearance)
    np.testing.assert_array_equal(clearances.lines[1].get_ydata(), log.body_clearance)
    fastest, of_object = speeds.lines
    assert fastest.get_ydata().max() == pytest.approx(base_speeds(log)[1][..., 0].max())
    np.testing.assert_allclose(of_object.get_ydata(), np.hypot(*log.object_twist[:, :2].T))
    (strongest,) = forces.lines
    np.testing.assert_allclose(
        strongest.get_ydata(), np.linalg.norm(log.base_wrenches[..., :2], axis=2).max(axis=1)
    )
    assert not any(isinstance(lines, LineCollection) and lines.get_segments() for lines in speeds.collections)


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


def test_a_jump_at_a_switch_is_broken_not_sloped():
    log = replace(synthetic_log(case("base")), times=np.arange(3.0), cell_index=np.array([0, 0, 1]))
    times, values = break_at_switches(log, np.array([1.0, 1.0, 5.0]))
    np.testing.assert_array_equal(times, [0.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(values, [1.0, 1.0, np.nan, 5.0])


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
