"""The errata: as printed a formula fails where the corrected one holds.

E4, E6, E9, E10, E15a, E15b, E17a, E17b, E18, E20, E21, E23, E25, E33, E35, E39, E43, EA1 and EA2."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import Point, Polygon, box
from shapely.affinity import rotate, translate

from coop_drake.geometry.minkowski import FreeSpace, to_polygon
from coop_drake.geometry.sweeps import over_revolute, under_revolute
from coop_drake.laws import (
    Funnel,
    energy_margin,
    funnel_bounds,
    total_wrench,
    tracking_energy,
    wrench_share,
)
from coop_drake.laws.readiness import clearance_margin, interval_margin
from coop_drake.laws.robot_dynamics import motion_room, robot_effort
from coop_drake.planning.cells import as_printed
from coop_drake.planning.cells.as_printed import PaperExploration
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.plant import robot_chain
from coop_drake.scenario import load_scenario
from paper import printed
from paper.governor_run import box_clearance, run_governor, straight_field
from paper.table_1 import CORRECTED
from tests.planning.test_search import rod_problem
from tests.support.prescribed import prescribed_acceleration
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_matrices import consistent_projector, robot_acceleration
from tests.support.table_1 import table_transitions

# E4, E6 and E9: which configurations are free, and what over- and under-approximations are.

WORKSPACE = box(0.0, 0.0, 4.0, 2.0)
BAR = np.array([[-0.5, -0.05], [0.5, -0.05], [0.5, 0.05], [-0.5, 0.05]])
MIDDLE, HALF = np.radians(30.0), np.radians(30.0)
FOOTPRINTS = [rotate(Polygon(BAR), angle, origin=(0.0, 0.0)) for angle in np.linspace(0.0, 60.0, 13)]
OVER, UNDER = over_revolute(BAR, MIDDLE, HALF), under_revolute(BAR, MIDDLE, HALF)


def hits_the_wall(shape):
    """Whether a shape reaches into the complement of the workspace."""
    return not shape.difference(WORKSPACE).is_empty


def safe_positions(footprint):
    """Positions from which a footprint stays in the workspace, as cells are computed."""
    (part,) = FreeSpace.under(WORKSPACE).minus(footprint).decompose()
    return to_polygon(part)


def test_e4_the_workspace_is_where_the_robots_may_be():
    """(4) calls z free if W and R(z) do not meet: the complement of W is meant."""
    bar, free = Polygon(BAR), safe_positions(BAR)
    places = (2.0, 1.0), (9.0, 9.0), (2.0, 0.01)
    in_the_middle, in_the_wall, through_the_wall = (translate(bar, *place) for place in places)
    printed = [WORKSPACE.intersection(body).is_empty for body in (in_the_middle, in_the_wall)]
    corrected = [free.contains(Point(place)) for place in places]
    assert printed == [False, True]
    assert corrected == [True, False, False]
    assert hits_the_wall(through_the_wall)


def test_e6_the_second_line_defines_the_under_approximation():
    """(6) overlines the intersection too; an over-approximation would have to hold every footprint."""
    over, under = Polygon(OVER), Polygon(UNDER)
    assert all(over.covers(footprint) for footprint in FOOTPRINTS)
    assert all(footprint.covers(under) for footprint in FOOTPRINTS)
    assert not any(under.covers(footprint) for footprint in FOOTPRINTS)
    assert 0.0 < under.area < FOOTPRINTS[0].area < over.area


def test_e9_only_positions_free_for_the_union_are_free_for_every_angle():
    """(9) with the intersection in the place of R's over-approximation calls a colliding position safe."""
    near_the_wall = (2.0, 0.3)
    assert any(hits_the_wall(translate(footprint, *near_the_wall)) for footprint in FOOTPRINTS)
    assert safe_positions(UNDER).contains(Point(near_the_wall))
    corrected = safe_positions(OVER)
    assert not corrected.contains(Point(near_the_wall))
    for corner in corrected.exterior.coords:
        assert not any(hits_the_wall(translate(footprint, *corner).buffer(-1e-6)) for footprint in FOOTPRINTS)


# E10, E15a and E15b: how far the governor may lead, and when the next cell may take over.

TABLE_2 = (50.0, 5.0, 5.0, 0.0)
ROOM = box_clearance(np.array([0.0, -1.0]), np.array([4.0, 1.0]))


def start_at(point):
    return {"position": np.array(point), "velocity": np.zeros(2), "governor": np.array(point)}


def test_e15a_twice_the_wrong_energy_goes_through_the_wall():
    """A target 2 cm from a wall: K d allows the spring more energy than it can store before the wall."""
    run = {
        margin: run_governor(
            ROOM,
            straight_field(np.array([3.98, 0.0])),
            gains=TABLE_2,
            seconds=6.0,
            margin=margin,
            **start_at([2.0, 0.0]),
        )
        for margin in (printed.energy_margin, energy_margin)
    }
    as_printed, corrected = run[printed.energy_margin], run[energy_margin]
    assert as_printed.margin.min() > 0.9
    assert min(ROOM(p) for p in as_printed.position) < -0.02
    assert corrected.margin.min() > 0.0
    assert min(ROOM(p) for p in corrected.position) > 0.0
    assert corrected.position[-1] == pytest.approx([3.98, 0.0], abs=1e-3)


def test_e15b_a_wall_around_the_goal_keeps_the_object_out():
    """F has the goal's boundary in its own; the distance to that vanishes on the way in."""
    target, radius = np.array([3.0, 0.0]), 0.3

    def to_boundary_of_f(point):
        return min(ROOM(point), abs(float(np.hypot(*(point - target))) - radius))

    def distances(clearance):
        run = run_governor(
            clearance, straight_field(target), gains=TABLE_2, seconds=30.0, **start_at([1.0, 0.2])
        )
        return np.hypot(*(run.position - target).T)

    assert distances(to_boundary_of_f).min() > radius
    assert distances(ROOM)[-1] < 1e-3


class TestE10:
    """A narrow cell across the way of a fast object: being in it is not enough to take over."""

    narrow = staticmethod(box_clearance(np.array([2.0, -1.0]), np.array([2.3, 1.0])))
    target = np.array([2.15, 0.0])

    def approach(self):
        return run_governor(
            ROOM, straight_field(self.target), gains=TABLE_2, seconds=12.0, **start_at([0.5, 0.0])
        )

    def take_over(self, run, index):
        return run_governor(
            self.narrow,
            straight_field(self.target),
            position=run.position[index],
            velocity=run.velocity[index],
            governor=run.governor[index],
            gains=TABLE_2,
            seconds=6.0,
        )

    def margins(self, run):
        stiffness = TABLE_2[0]
        return np.array(
            [
                energy_margin(tracking_energy(*(p - g), *v, stiffness), self.narrow(g), stiffness)
                for p, v, g in zip(run.position, run.velocity, run.governor, strict=True)
            ]
        )

    def test_as_printed_the_next_cell_begins_with_too_much_energy_and_is_left(self):
        run = self.approach()
        first_inside = next(i for i, p in enumerate(run.position) if self.narrow(p) > 0.0)
        assert self.margins(run)[first_inside] < 0.0
        taken_over = self.take_over(run, first_inside)
        assert min(self.narrow(p) for p in taken_over.position) < 0.0

    def test_as_corrected_it_begins_when_it_can_be_kept(self):
        run, inradius = self.approach(), 0.15
        ready = [clearance_margin(m, TABLE_2[0], inradius) >= 0.0 for m in self.margins(run)]
        first_ready = ready.index(True)
        assert self.narrow(run.position[first_ready]) > 0.0
        taken_over = self.take_over(run, first_ready)
        assert taken_over.margin.min() >= 0.0
        assert min(self.narrow(p) for p in taken_over.position) > 0.0
        assert taken_over.position[-1] == pytest.approx(self.target, abs=1e-3)


# E17a, E17b, E18, E20, E35, E39 and E43: bounds and the back-stepping law between them.

ONE_AXIS = {
    "slice_lower": np.array([1.47]),
    "slice_upper": np.array([1.867]),
    "goal_lower": np.array([1.667]),
    "goal_upper": np.array([1.867]),
}


def bounds_at(time, *, decay_rate=2.0, shape="exponential", **intervals):
    chosen = {**ONE_AXIS, **intervals}
    rates = np.full(len(chosen["slice_lower"]), decay_rate)
    funnel = Funnel(**chosen, decay_rate=rates, shape=shape)
    return funnel_bounds(funnel, time)


def scalars(bounds):
    return [float(bound[0]) for bound in bounds]


def test_e17a_walls_that_start_together_leave_no_room():
    """(17) starts the upper bound at theta_l; Table 1's first cell, with theta = 1.57."""
    lower, upper = printed.angle_bounds(
        0.0, theta_l=1.47, theta_u=1.867, goal_l=1.667, goal_u=1.867, decay_rate=2.0
    )
    assert upper - lower == pytest.approx(0.0, abs=1e-15)
    corrected = bounds_at(0.0)
    assert corrected.lower[0] < 1.57 < corrected.upper[0]


def test_e17b_an_axis_handed_over_on_the_border_of_its_new_slice_is_thrown_off():
    """The goal's end is the next slice's end: there s = ln 0, and near it the log term has no bound."""
    begin = scalars(bounds_at(0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        _, _, on_the_border = printed.axis_law(np.float64(1.47), 0.0, begin)
    assert on_the_border == -np.inf
    just_inside, _, _ = printed.axis_law(1.47 + 1e-6, 0.0, begin)
    assert just_inside > 1e7
    # The next slice begins where the goal interval of the last cell, as wide as their overlap, ends.
    goal = 1.47, 1.67
    assert interval_margin(1.47 + 1e-6, *goal) < 0.0
    place = next(x for x in np.linspace(1.47, 1.57, 1001) if interval_margin(x, *goal) >= 0.0)
    ready, _, _ = printed.axis_law(place, 0.0, begin)
    assert ready < 200.0


def test_e18_towards_a_point_the_printed_log_term_has_no_bound():
    """Between bounds that close completely, an axis at a quarter of the width is pulled ever harder."""

    def pull(goal_half_width, log_gain, time):
        goal = {
            "goal_lower": np.array([1.7 - goal_half_width]),
            "goal_upper": np.array([1.7 + goal_half_width]),
        }
        bounds = scalars(bounds_at(time, **goal))
        x = 0.75 * bounds[0] + 0.25 * bounds[1]
        with_log, _, _ = printed.axis_law(x, 0.0, bounds, log_gain=log_gain)
        without, _, _ = printed.axis_law(x, 0.0, bounds, log_gain=0.0)
        return abs(with_log - without)

    assert [pull(0.0, 1.0, t + 1.0) / pull(0.0, 1.0, t) for t in (1.0, 2.0, 4.0)] == pytest.approx(
        [np.e**2] * 3
    )
    assert pull(0.0, 1.0, 10.0) > 1e9
    assert pull(0.02, 0.1, 1e3) < 20.0


@pytest.mark.parametrize("time", [0.0, 0.2, 1.0])
def test_e20_without_its_dot_the_wanted_rate_does_not_follow_the_walls(time):
    """At x' = v the log s shall decay as s' = -k1 s; b with rho instead of rho' gives another s'."""
    bounds = scalars(bounds_at(time))
    x = 0.3 * bounds[0] + 0.7 * bounds[1]

    def decay_of_s(first_rate):
        _, v, s = printed.axis_law(x, 0.0, bounds, first_rate=first_rate)
        return (v - bounds[2]) / (x - bounds[0]) - (bounds[3] - v) / (bounds[1] - x), -s

    got, wanted = decay_of_s(bounds[0])
    assert abs(got - wanted) > 1.0
    got, wanted = decay_of_s(None)
    assert got == pytest.approx(wanted, abs=1e-12)


class TestE35:
    """(38) damps the second joint by the rate of the first: two joints on their way, gains 1 as in (48)."""

    kappa, k1, k2 = 1.0, 1.0, 1.0

    def setup_method(self):
        self.bounds = bounds_at(
            0.3,
            shape="quintic",
            **{name: np.repeat(value, 2) for name, value in ONE_AXIS.items()},
        )
        self.x = 0.4 * self.bounds.lower + 0.6 * self.bounds.upper
        self.rate = np.array([-2.0, 0.8])

    def energy_rate(self, acceleration):
        """Return V' of the second joint, and what the gains promise."""
        axis = [bound[1] for bound in self.bounds]
        forced, v, s = printed.axis_law(
            self.x[1], self.rate[1], axis, log_gain=self.kappa, position_gain=self.k1, rate_gain=self.k2
        )
        error = self.rate[1] - v
        promised = -self.kappa * self.k1 * s**2 - self.k2 * error**2
        # V' = promised + (x' - v) times the acceleration that is not that of the law.
        return promised + error * (acceleration - forced), promised

    def test_as_printed_the_second_joint_gains_energy(self):
        axis = [bound[1] for bound in self.bounds]
        undamped, v, _ = printed.axis_law(self.x[1], self.rate[1], axis, rate_gain=0.0)
        got, promised = self.energy_rate(undamped - self.k2 * (self.rate[0] - v))
        assert got > 0.0 > promised

    def test_as_corrected_it_loses_what_the_gains_promise(self):
        acceleration = prescribed_acceleration(
            self.x,
            self.rate,
            self.bounds,
            log_gain=np.full(2, self.kappa),
            position_gain=self.k1,
            rate_gain=self.k2,
        )
        got, promised = self.energy_rate(acceleration[1])
        assert got == pytest.approx(promised, rel=1e-9)
        assert promised < 0.0


def test_e39_an_overbar_means_the_lower_end_in_the_joints_walls():
    """Read as elsewhere in the paper, overbar for upper, the lower bound of (39) is above the upper."""
    for transition in table_transitions(CORRECTED):
        read_literally = {
            "slice_lower": transition["slice_upper"][1:],
            "slice_upper": transition["slice_lower"][1:],
            "goal_lower": transition["goal_upper"][1:],
            "goal_upper": transition["goal_lower"][1:],
        }
        corrected = {name: transition[name][1:] for name in read_literally}
        for time in (0.0, 0.5, 5.0):
            crossed = funnel_bounds(Funnel(**read_literally, decay_rate=np.full(2, 2.0)), time)
            assert np.all(crossed.lower > crossed.upper)
            bounds = funnel_bounds(Funnel(**corrected, decay_rate=np.full(2, 2.0)), time)
            assert np.all(bounds.lower < bounds.upper)


def test_e43_the_wanted_rate_leaves_minus_k1_z1_and_not_its_square():
    """a v - b is odd in z1; the square would push away from one of the two bounds."""
    bounds = scalars(bounds_at(0.4))
    k1 = 1.5
    for fraction in (0.2, 0.8):
        x = (1.0 - fraction) * bounds[0] + fraction * bounds[1]
        _, v, z1 = printed.axis_law(x, 0.0, bounds, position_gain=k1)
        a = 1.0 / (x - bounds[0]) + 1.0 / (bounds[1] - x)
        b = bounds[2] / (x - bounds[0]) + bounds[3] / (bounds[1] - x)
        assert a * v - b == pytest.approx(-k1 * z1)
        assert abs(a * v - b - -k1 * z1**2) > 0.5


# E21: the sign of the cross term in (21) and (31).

FORCE, TORQUE = np.array([3.0, 4.0]), 0.7
NO_COM_OFFSET = np.zeros(2)
OPPOSITE = np.array([[0.4, 0.0], [-0.4, 0.0]])
ONE_SIDED = np.array([[0.4, 0.0], [0.0, 0.25]])
THREE = np.array([[0.4, 0.0], [-0.4, 0.0], [0.0, 0.25]])


def total_as_printed(offsets):
    shares = [printed.wrench_share(FORCE, TORQUE, -offset, robots=len(offsets)) for offset in offsets]
    return total_wrench(np.array(shares), offsets, NO_COM_OFFSET, 0.0)


def total_as_corrected(offsets):
    shares = [wrench_share(*-offset, *FORCE, TORQUE, 1.0, 1.0, 1.0 / len(offsets)) for offset in offsets]
    return total_wrench(np.array(shares), offsets, NO_COM_OFFSET, 0.0)


@pytest.mark.parametrize("offsets", [OPPOSITE, ONE_SIDED, THREE])
def test_e21_with_a_plus_the_shares_sum_to_the_command(offsets):
    assert total_as_corrected(offsets) == pytest.approx([*FORCE, TORQUE], abs=1e-14)


@pytest.mark.parametrize("offsets", [ONE_SIDED, THREE])
def test_e21_with_a_minus_asymmetric_grasps_turn_the_object(offsets):
    """At 5 N the torque is wrong by 2 r^perp . F, averaged over the grasps."""
    error = total_as_printed(offsets)[2] - TORQUE
    mean = offsets.mean(axis=0)
    assert error == pytest.approx(2.0 * (mean[0] * FORCE[1] - mean[1] * FORCE[0]))
    assert abs(error) > 0.4


def test_e21_opposite_grasps_hide_the_sign():
    assert total_as_printed(OPPOSITE) == pytest.approx([*FORCE, TORQUE], abs=1e-14)


# E23, E25 and E33: what a robot's own dynamics need; robots of shipped teams have one joint or two.

TEAMS = ["base", "elbow"]


def moving_robot(team, count=40):
    """A robot in random states: random numbers, Drake's model of the robot, z, z' and J."""
    rng, robot = np.random.default_rng(1), robot_dynamics(load_scenario(team), 0)
    for z, v in rng.uniform(-1.8, 1.8, (count, 2, 3 + len(robot.joints))):
        robot.set_state(z, v)
        yield rng, robot, z, v, robot.grasp_jacobian()


@pytest.mark.parametrize("team", TEAMS)
def test_e23_forces_through_the_printed_projector_disturb_the_grasp(team):
    """Only the projector weighted by the inertia leaves the end effector's acceleration alone."""
    disturbed, left_alone = [], []
    for rng, robot, z, _, jacobian in moving_robot(team):
        mass_matrix, force = robot.mass_matrix(), rng.normal(size=z.size) * 10.0
        through = (printed.projector(jacobian), consistent_projector(mass_matrix, jacobian))
        for projector, errors in zip(through, (disturbed, left_alone), strict=True):
            errors.append(np.linalg.norm(jacobian @ np.linalg.solve(mass_matrix, projector @ force)))
    assert np.median(disturbed) > 0.5
    assert max(left_alone) < 1e-9


@pytest.mark.parametrize("team", TEAMS)
def test_e25_the_end_effector_twist_does_not_tell_how_the_jacobian_changes(team):
    """J^+ x' is z' less its motion in the null space, on which J' acts too."""
    printed_errors, corrected_errors = [], []
    for _, robot, z, v, jacobian in moving_robot(team):
        rate_term, around, h = robot.grasp_bias(), [], 1e-5
        for time in (-h, h):
            robot.set_state(z + time * v, v)
            around.append(robot.grasp_jacobian())
        # With z'' = 0 the grasp's acceleration is what J' contributes.
        jacobian_rate = (around[1] - around[0]) / (2.0 * h)
        truth = (jacobian_rate @ v)[:2]
        as_printed = printed.rate_term(jacobian_rate, jacobian, jacobian @ v)
        printed_errors.append(np.linalg.norm(as_printed[:2] - truth))
        corrected_errors.append(np.linalg.norm(rate_term[:2] - truth))
    assert max(printed_errors) > 0.1
    assert np.median(printed_errors) > 1e4 * max(corrected_errors)


@pytest.mark.parametrize("team", TEAMS)
def test_e33_task_space_forces_reach_the_actuators_through_the_transpose(team):
    """J cannot multiply a wrench unless the robot has no joints; J^T makes the wrench appear at the grasp."""
    for rng, robot, z, v, jacobian in moving_robot(team, count=5):
        wrench, chain = rng.normal(size=3), robot_chain(robot)
        with pytest.raises(ValueError, match="mismatch"):
            jacobian @ wrench
        at_grasp, axes, torque = rng.normal(size=3), rng.normal(size=z.size - 2), np.empty(z.size)
        wanted = robot_acceleration(
            at_grasp, axes[1:], jacobian=jacobian, jacobian_rate_term=robot.grasp_bias()
        )
        command = np.concatenate([at_grasp, wrench])
        robot_effort(chain, motion_room(chain), np.concatenate([z, v]), command, axes, torque)
        # (2) solved for the acceleration, with the object pushing back.
        bias = robot.inertial_effort(np.zeros(z.size))
        got = np.linalg.solve(robot.mass_matrix(), torque - bias - jacobian.T @ wrench)
        assert got == pytest.approx(wanted, abs=1e-9)


# Errata EA1 and EA2: when the paper's exploration gives up, and which cells its heuristic follows.


def explored(problem, budget=400):
    exploration = PaperExploration(problem)
    return exploration, exploration.run(budget)


def printed_refine(path, source, goal, under):
    """Algorithm 2 with all under-cells of a slice, wherever the path passes it."""
    if len(path) == 1:
        return [path[0].slice]
    cells = goal if len(path) == 2 else under.by_slice[path[1].slice]
    connected = [cell for cell in cells if any(one.region.meets(cell.region) for one in source)]
    if connected:
        return printed_refine(path[1:], connected, goal, under)
    return [path[0].slice, path[1].slice]


def test_ea1_what_touches_is_subdivided_for_ever():
    problem = rod_problem(0.2)  # As wide as the rod: over-cells always join, under-cells never do.
    _, outcome = explored(problem)
    assert outcome.verdict is Verdict.RESOLUTION
    finer = replace(problem, settings=replace(problem.settings, angle_resolution=1e-6))
    _, longer = explored(finer)
    assert longer.slices > outcome.slices
    assert longer.verdict is not Verdict.FOUND


def test_ea2_cells_beside_the_path_lead_the_heuristic_to_the_wrong_slices(monkeypatch):
    problem = rod_problem(0.5)
    _, outcome = explored(problem)
    assert outcome.verdict is Verdict.FOUND
    monkeypatch.setattr(as_printed, "refine", printed_refine)
    stuck, outcome = explored(problem)
    assert outcome.verdict is Verdict.RESOLUTION
    widths = {
        upper - lower for ((lower, upper),) in (stuck.slices.all[c.slice].intervals for c in outcome.path)
    }
    assert max(widths) > 100.0 * min(
        widths
    )  # The goal's slices are as fine as allowed, the corridor's coarse.


@pytest.mark.parametrize("corridor", [0.23, 0.3, 1.0])
def test_the_corrected_heuristic_finds_the_way(corridor):
    assert explored(rod_problem(corridor))[1].verdict is Verdict.FOUND
