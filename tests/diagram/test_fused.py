"""The fused mode against the named blocks: the same inputs to the plant, derivatives, and runs."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.compiled_loop import simulate_fused
from coop_drake.diagram import build_closed_loop
from coop_drake.errors import ScenarioError
from coop_drake.plant import set_configuration
from coop_drake.scenario import ActuatorLimits, Control, Deployment, Measurements
from coop_drake.simulation import simulate
from coop_drake.simulation.telemetry import Telemetry
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.small_loop import joint_names, small_maps, small_problem
from tests.support.small_plan import small_plan, stiffer_and_stiffer

RING = [[REVOLUTE, PRISMATIC], [PRISMATIC], [REVOLUTE, REVOLUTE, REVOLUTE], [REVOLUTE]]
#: Telemetry that is allowed to differ by what rounding makes of it.
ROUNDED = ("acceleration_error",)


@pytest.fixture(scope="module", params=["base", "three", "ring"])
def problem(request, tmp_path_factory):
    if request.param != "ring":
        scenario, plan = small_problem(request.param)
    else:
        scenario = ring_team(tmp_path_factory.mktemp("ring"), RING)
        plan = small_plan(joint_names(scenario))
    return scenario, stiffer_and_stiffer(plan)


@pytest.fixture(scope="module")
def run(problem):
    return simulate(*problem, small_maps())


class Side:
    """One of the two loops, put into any state."""

    def __init__(self, problem, blocks):
        self.loop = build_closed_loop(*problem, small_maps(), blocks=blocks)
        self.root = self.loop.create_context()
        self.plant = self.loop.team.plant
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.root)
        self.telemetry = Telemetry(self.loop, self.root)

    def put(self, time, cell, entry, z, rates, governor):
        self.root.SetTime(time)
        planner = self.loop.cell_planner.GetMyMutableContextFromRoot(self.root)
        planner.SetDiscreteState([cell, entry])
        set_configuration(self.loop.team, self.plant_context, z, rates)
        for integrator in self.governors():
            integrator.set_integral_value(integrator.GetMyMutableContextFromRoot(self.root), governor)

    def governors(self):
        if self.loop.fused:
            return [self.loop.fused.integrator]
        return [law.GetSubsystemByName("governor_state") for law in self.loop.bare_controllers]

    def derivatives(self):
        self.loop.diagram.EvalTimeDerivatives(self.root)
        velocity = self.governors()[0].GetMyContextFromRoot(self.root)
        led = self.governors()[0].EvalTimeDerivatives(velocity).CopyToVector()
        moved = self.plant.EvalTimeDerivatives(self.plant_context).CopyToVector()
        return np.concatenate([moved, led])

    def inputs(self):
        """Torques of the joints, and the wrench on every base in W as the plant gets it."""
        torques = self.plant.get_actuation_input_port().Eval(self.plant_context)
        forces = self.plant.get_applied_spatial_force_input_port().Eval(self.plant_context)
        wrenches = {int(force.body_index): np.zeros(6) for force in forces}
        for force in forces:
            wrenches[int(force.body_index)] += force.F_Bq_W.get_coeffs()
        bases = [wrenches[int(robot.base_body.index())] for robot in self.loop.team.robots]
        return np.concatenate([torques, *bases])


def assert_alike(named, fused):
    for read in (Side.inputs, Side.derivatives):
        expected = read(named)
        np.testing.assert_allclose(read(fused), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    # Outside a funnel efforts are huge, and reactions are what is left of them.
    efforts = float(np.abs(named.inputs()).max())
    expected, found = vars(named.telemetry.read()), vars(fused.telemetry.read())
    for name, value in expected.items():
        if name not in ROUNDED:
            scale = max(
                1.0, float(np.abs(value).max(initial=0.0)), efforts if name == "measured_wrenches" else 0.0
            )
            np.testing.assert_allclose(found[name], value, rtol=0.0, atol=1e-10 * scale, err_msg=name)


def test_any_state_has_the_same_inputs_derivatives_and_telemetry(problem):
    named, fused = Side(problem, "named"), Side(problem, "fused")
    plan, generator = problem[1], np.random.default_rng(11)
    for k in range(40):
        cell = k % len(plan.cells)
        low, high = plan.cells[cell].lower, plan.cells[cell].upper
        axes = generator.uniform(low - 0.02, high + 0.02)  # some outside, as an integrator's trials are
        position = plan.transitions[cell].target + generator.normal(scale=0.2, size=2)
        z, rates = np.concatenate([position, axes]), generator.normal(scale=0.5, size=2 + len(axes))
        governor = position + generator.normal(scale=0.1, size=2)
        for side in (named, fused):
            side.put(1.0 + 0.01 * k, cell, 1.0, z, rates, governor)
        assert_alike(named, fused)


def test_along_a_run_they_stay_alike(problem, run):
    named, fused = Side(problem, "named"), Side(problem, "fused")
    z = np.hstack([run.object_pose, run.joints])
    rates = np.hstack([run.object_twist, run.joint_rates])
    for row in range(0, len(run.times), 5):
        state = run.times[row], run.cell_index[row], run.transition_start[row], z[row], rates[row]
        for side in (named, fused):
            side.put(*state, run.governor_position[row])
        assert_alike(named, fused)


def test_a_fused_run_is_the_named_one(problem, run):
    fused = simulate_fused(*problem, small_maps())
    assert fused.reached
    assert fused.violation == ""
    np.testing.assert_array_equal(fused.cell_index, run.cell_index)
    np.testing.assert_allclose(fused.times, run.times, rtol=0.0, atol=1e-9)
    for name in (
        "object_pose",
        "joints",
        "governor_position",
        "energy_margin",
        "funnel_lower",
        "ready_margins",
    ):
        np.testing.assert_allclose(
            getattr(fused, name), getattr(run, name), rtol=0.0, atol=1e-9, err_msg=name
        )
    np.testing.assert_allclose(fused.base_wrenches, run.base_wrenches, rtol=0.0, atol=1e-7)
    assert fused.wrench_error.max() <= 1e-10
    assert fused.acceleration_error.max() <= 1e-12 * max(1.0, np.abs(run.object_wrench).max())


@pytest.mark.parametrize(
    "wanted",
    [
        {"deployment": Deployment(control_rate=100.0, measurements=Measurements(position_noise=0.01))},
        {"deployment": Deployment(control_rate=100.0)},
        {"deployment": Deployment(actuators=ActuatorLimits(base_force=50.0))},
        {"control": Control(observer=True)},
    ],
)
def test_what_only_named_blocks_do_is_refused(wanted):
    scenario, plan = small_problem("base")
    with pytest.raises(
        ScenarioError, match=rf"{next(iter(wanted))}: .* in continuous time support only these"
    ):
        build_closed_loop(replace(scenario, **wanted), plan, small_maps(), blocks="fused")
