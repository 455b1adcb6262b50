"""The block of an axis's nominal motion: its ports, its law, and that no measurement reaches the motion."""

import numpy as np
import pytest

from coop_drake.answers.budget import AxisTracking
from coop_drake.laws.nominal import carry_axes, pulled_axis
from coop_drake.systems import AxisMotion, NominalAxes
from tests.support.system_checks import context_with, evaluate

START = np.array([0.4, -0.2, 0.7])
"""The object's angle and two joints."""

MOUNTING = np.array([0.3, -1.0, 0.0])
"""The base's yaw at zero; the first joint turns it backwards, the second one slides."""


def block(periods=2, axes=3):
    return NominalAxes(
        AxisMotion(AxisTracking(500.0, 38.0), START[:axes], 0.005, 0.005, periods, MOUNTING[:axes])
    )


def measured(angle=0.41, joints=(-0.21, 0.69), law=(1.0, -2.0, 3.0)):
    return {
        "object_state": [3.0, 4.0, angle, 0.1, 0.2, 0.3],
        "robot_state": [1.0, 2.0, 0.5, *joints, 0.1, 0.2, 0.3, 0.04, -0.05],
        "axis_acceleration": list(law),
    }


def stepped(system, context, steps):
    for _ in range(steps):
        context.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(context))
    return context


def test_the_motion_follows_the_law_alone():
    system, states = block(), []
    for angle in (0.41, -3.0):
        context = stepped(system, context_with(system, measured(angle)), 50)
        states.append(context.get_discrete_state_vector().CopyToVector())
    np.testing.assert_array_equal(*states)
    state = np.array([START, np.zeros(3), np.zeros(3)])
    for _ in range(50):
        following = np.empty((3, 3))
        carry_axes(state, np.array([1.0, -2.0, 3.0]), 0.005, 0.005, following)
        state = following
    np.testing.assert_array_equal(states[0][:9].reshape(3, 3), state)


@pytest.mark.parametrize(
    ("names", "ahead"),
    [(("nominal_object", "nominal_robot"), 0.0), (("object_ahead", "robot_ahead"), 0.0075)],
)
def test_angles_and_rates_are_nominal_and_the_rest_as_measured(names, ahead):
    system, state = block(), np.empty((3, 3))
    context = stepped(system, context_with(system, measured()), 3)
    now = context.get_discrete_state_vector().CopyToVector()[:9].reshape(3, 3)
    carry_axes(now, np.array([1.0, -2.0, 3.0]), ahead, 0.005, state)
    shown, robot = (system.GetOutputPort(name).Eval(context) for name in names)
    np.testing.assert_allclose(shown, [3.0, 4.0, state[0, 0], 0.1, 0.2, state[1, 0]], rtol=1e-14)
    yaw, rate = state[0, 0] + 0.3 - state[0, 1], state[1, 0] - state[1, 1]
    expected = [1.0, 2.0, yaw, *state[0, 1:], 0.1, 0.2, rate, *state[1, 1:]]
    np.testing.assert_allclose(robot, expected, rtol=1e-14)


@pytest.mark.parametrize("periods", [0, 2])
def test_measurements_are_compared_with_the_motion_of_their_time(periods):
    system = block(periods)
    context = context_with(system, measured())
    past = [context.get_discrete_state_vector().CopyToVector()[:6].reshape(2, 3)]
    for _ in range(7):
        stepped(system, context, 1)
        past.append(context.get_discrete_state_vector().CopyToVector()[:6].reshape(2, 3))
    expected, seen = past[-1 - periods], ((0.41, 0.3), (-0.21, 0.04), (0.69, -0.05))
    pulled = [
        pulled_axis(law, x, v, tuple(expected[:, i]), (500.0, 38.0))
        for i, (law, (x, v)) in enumerate(zip((1.0, -2.0, 3.0), seen, strict=True))
    ]
    np.testing.assert_allclose(system.GetOutputPort("pulled_axes").Eval(context), pulled, rtol=1e-14)


def test_a_robot_without_joints_needs_no_state_of_its_own():
    system = block(axes=1)
    inputs = measured(law=(1.0,))
    del inputs["robot_state"]
    assert evaluate(system, inputs, "pulled_axes").shape == (1,)
