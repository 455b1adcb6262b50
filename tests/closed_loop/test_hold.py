"""A team that is held comes to rest inside its cell, wherever it is, and goes on when the cause is gone."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake import scenario as sc
from coop_drake.diagram import build_closed_loop
from coop_drake.errors import ScenarioError
from coop_drake.planning.planner import plan as plan_problem
from coop_drake.plant import planning_problem, read_component_tree
from coop_drake.scenario.checks import validate
from coop_drake.simulation import Invariants, TeamClearance, build_maps, configure_simulator, simulate
from coop_drake.simulation.telemetry import Telemetry
from tests.support.run_checks import verified_run
from tests.support.scenarios import resting
from tests.support.small_loop import small_maps, small_problem

MOMENTS = 50
REST_TIME = 1.6
"""Within this time after it was told so a team of base rests [s]."""

REST_DISTANCE = 0.65
"""And the object moves no further than this meanwhile [m]."""

SPEED, RATE = 0.01, 0.02
"""What counts as rest [m/s, rad/s]."""


@pytest.fixture(scope="module")
def base():
    """The loop of base that can be told to hold, and its contexts at random moments of a run."""
    scenario = replace(resting(sc.load_scenario("base")), control=sc.Control(hold=sc.Hold()))
    problem = planning_problem(scenario)
    plan = plan_problem(problem, scenario.gain_sets["scheduled"], gain_set_name="scheduled").plan
    loop = build_closed_loop(scenario, plan, build_maps(plan))
    clearance = TeamClearance(scenario.workspace.polygon, read_component_tree(loop.team.as_tree))
    simulator = Simulator(loop.diagram, loop.create_context())
    configure_simulator(simulator, scenario)
    simulator.Initialize()
    duration = sum(transition.estimated_time for transition in plan.transitions)
    contexts = []
    for time in np.sort(np.random.default_rng(5).uniform(0.0, 0.95 * duration, MOMENTS)):
        simulator.AdvanceTo(time)
        contexts.append(simulator.get_context().Clone())
    return scenario, loop, Invariants(clearance, plan), contexts


def carried_on(scenario, loop, invariants, context, order, until):
    """Samples of a run that goes on with an order, each checked, until a time or the arrival."""
    source = loop.diagram.GetSubsystemByName("hold_order")
    source.get_mutable_source_value(source.GetMyMutableContextFromRoot(context)).SetFromVector([order])
    telemetry, samples = Telemetry(loop, context), []

    def watch(_):
        samples.append(telemetry.read())
        violation = invariants.check(samples[-1]).violation
        assert violation == "", violation

    simulator, begin = Simulator(loop.diagram, context), context.get_time()
    configure_simulator(simulator, scenario)
    context.SetTime(begin)  # the configuration begins at zero
    simulator.set_monitor(watch)
    simulator.Initialize()
    while simulator.get_context().get_time() < until and not samples[-1].arrived:
        simulator.AdvanceTo(min(simulator.get_context().get_time() + 0.5, until))
    return samples


@pytest.mark.slow
@pytest.mark.no_cover
def test_at_random_moments_the_team_rests_without_contact_in_time(base):
    scenario, loop, invariants, contexts = base
    cells = set()
    for context in contexts:
        until = context.get_time() + REST_TIME
        samples = carried_on(scenario, loop, invariants, context.Clone(), 1.0, until)
        rates = np.abs(samples[-1].rates)
        assert np.hypot(*rates[:2]) < SPEED
        assert rates[2:].max() < RATE
        assert np.hypot(*(samples[-1].z - samples[0].z)[:2]) <= REST_DISTANCE
        assert samples[-1].cell == samples[1].cell
        cells.add(samples[-1].cell)
    assert len(cells) > 15


@pytest.mark.slow
@pytest.mark.parametrize("number", [4, 22, 41])
def test_it_arrives_when_it_is_released(base, number):
    scenario, loop, invariants, contexts = base
    context = contexts[number].Clone()
    carried_on(scenario, loop, invariants, context, 1.0, context.get_time() + REST_TIME)
    assert carried_on(scenario, loop, invariants, context, 0.0, 60.0)[-1].arrived


def held_run(hold, robots=None, *, arrives=True, max_time=30.0, **departures):
    """The log of a held run at 200 Hz with departures, and the times at which it was held."""
    scenario, plan = small_problem("base")
    deployment = sc.Deployment(control_rate=200.0, robots=robots or {}, **departures)
    simulator = replace(scenario.simulator, max_time=max_time)
    scenario = replace(scenario, control=sc.Control(hold=hold), deployment=deployment, simulator=simulator)
    log = simulate(scenario, plan, small_maps())
    if arrives:
        assert (log.reached, log.violation) == (True, "")
        assert verified_run(scenario, plan, log).answer == "arrived"
    return log, log.times[log.held > 0.0]


def assert_rests(log, begin, end):
    """Between two times [s] nothing moves."""
    assert np.abs(log.object_twist[(log.times > begin) & (log.times < end)]).max() < RATE


@pytest.mark.slow
def test_a_scheduled_hold_costs_its_time_and_no_more():
    scenario, plan = small_problem("base")
    free = simulate(scenario, plan, small_maps())
    scenario = replace(scenario, control=sc.Control(hold=sc.Hold(at=(0.2, 0.9), duration=1.5)))
    log = simulate(scenario, plan, small_maps())
    assert (log.reached, log.violation) == (True, "")
    told = 2.2  # from 0.2 s to 2.4 s: the second begins in the first
    assert told <= log.times[-1] - free.times[-1] <= told + 2.0
    assert log.held.max() == 1.0
    assert log.acceleration_error.max() < 1e-12
    assert verified_run(scenario, plan, log).answer == "arrived"


@pytest.mark.slow
def test_a_silent_robot_holds_the_team_until_it_is_heard_again():
    silent = {"robot_1": sc.RobotDepartures(silence=sc.Silence(begin=0.5, duration=2.0))}
    log, held = held_run(sc.Hold(silence=0.1), silent)
    assert 0.6 <= held[0] <= 0.65
    assert 2.45 <= held[-1] <= 2.55
    assert_rests(log, 0.6 + REST_TIME, 2.5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_misses_the_order_holds_by_itself_and_the_team_arrives(seed):
    """At a random moment one robot hears nothing any more; shortly afterwards the team is told to hold."""
    generator = np.random.default_rng(seed)
    begin, told = generator.uniform(0.1, 0.9), seed % 2 == 0
    deaf = {f"robot_{seed // 2}": sc.RobotDepartures(deaf=sc.Deafness(begin=begin, duration=2.2))}
    order = sc.Hold(at=(begin + 0.02,) if told else (), duration=1.0, silence=0.1)
    log, held = held_run(order, deaf, messages=sc.Messages(loss=0.2), seed=seed)
    assert held[0] == pytest.approx(begin + (0.02 if told else 0.1), abs=0.05)
    assert held[-1] == pytest.approx(begin + 2.2, abs=0.05)  # it is released when that robot hears again
    assert_rests(log, begin + 0.1 + REST_TIME, begin + 2.2)


@pytest.mark.slow
def test_without_a_time_out_a_deaf_robot_goes_on_alone():
    deaf = {"robot_0": sc.RobotDepartures(deaf=sc.Deafness(begin=0.2, duration=1.5))}
    for silence, lag in ((0.1, 1.4), (None, 0.0)):  # of its clock, from 0.3 s, when it holds, to 1.7 s
        log, _ = held_run(sc.Hold(at=(0.25,), duration=1.0, silence=silence), deaf, arrives=False)
        assert log.clock_lag.max() == pytest.approx(lag, abs=0.1 if lag else 0.0)


def test_a_robot_that_is_pushed_asks_for_a_hold_until_it_has_recovered():
    push = sc.Push("robot_0", (220.0, 0.0), time=0.5, duration=0.5)
    _, held = held_run(sc.Hold(energy=3.0), pushes=(push,))
    assert 0.5 < held[0] < 0.6
    assert held[-1] < 2.0


def test_a_team_that_is_never_released_says_why_it_waits():
    silent = {"robot_0": sc.RobotDepartures(silence=sc.Silence(begin=0.3))}
    log, _ = held_run(sc.Hold(silence=0.1), silent, arrives=False, max_time=2.0)
    assert not log.reached
    assert "it waits until the hold ends: robot 0 is not heard" in log.violation


def test_a_hold_after_silence_needs_a_control_rate():
    scenario = replace(small_problem("base")[0], control=sc.Control(hold=sc.Hold(silence=0.1)))
    with pytest.raises(ScenarioError, match=r"control\.hold\.silence: 0\.1 is not allowed"):
        validate(scenario)
