import numpy as np
import pytest

from coop_drake.systems import DisturbanceObserver
from tests.support.system_checks import evaluate, port_sizes

INPUTS = {
    "object_state": [9.0, 9.0, 9.0, 0.1, 0.2, 0.3],
    "robot_state": [9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 0.4],
    "governor_command": [7.0, 8.0, 1.0, 2.0],
    "axis_acceleration": [3.0, 4.0],
    "observed_rates": [0.0, 0.1, 0.4, 0.2],
}
AHEAD = np.array([0.1, 0.1, -0.1, 0.2])


def test_commands_are_those_wanted_less_the_disturbance():
    block = DisturbanceObserver(1, 5.0, 1.0)
    found = {name: evaluate(block, INPUTS, name) for name in port_sizes(block)[1]}
    np.testing.assert_allclose(found["disturbance"], 5.0 * AHEAD)
    np.testing.assert_allclose(found["observer_rate"], AHEAD + np.arange(1.0, 5.0))
    np.testing.assert_allclose(
        found["compensated_command"], [7.0, 8.0, 1.0 - 5.0 * AHEAD[0], 2.0 - 5.0 * AHEAD[1]]
    )
    np.testing.assert_allclose(found["compensated_axes"], [3.0, 4.0] - 5.0 * AHEAD[2:])


@pytest.mark.parametrize("gains", [(0.0, 1.0), (5.0, -1.0)])
def test_gains_that_would_not_observe_are_refused(gains):
    with pytest.raises(ValueError, match="a positive gain and no negative leak"):
        DisturbanceObserver(1, *gains)
