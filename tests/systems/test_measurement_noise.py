import numpy as np
import pytest

from coop_drake.laws.measurements import write_errors
from coop_drake.systems import MeasurementNoise
from tests.support.system_checks import evaluate

PERIOD, DEVIATIONS = 0.1, np.array([0.0, 0.5, 2.0])
WAVES = np.array([[0.3, 4.0, 0.0], [0.0, 1.0, 0.0], [0.1, 3.0, 0.5]])


@pytest.mark.parametrize(("time", "number"), [(0.0, 0), (0.05, 0), (0.3, 3), (0.7 - 1e-12, 7)])
def test_errors_are_those_of_the_number_of_the_period(time, number):
    errors = np.empty(3)
    write_errors(4, DEVIATIONS, WAVES, number, errors)
    block = MeasurementNoise(DEVIATIONS, WAVES, PERIOD, 4)
    measured = evaluate(block, {"exact": [1.0, 2.0, 3.0]}, "measured", time)
    np.testing.assert_allclose(measured, np.array([1.0, 2.0, 3.0]) + errors, atol=1e-15)


@pytest.mark.parametrize(
    ("deviations", "waves", "period"),
    [(DEVIATIONS, WAVES, 0.0), (-DEVIATIONS, WAVES, PERIOD), (DEVIATIONS, 0.0 * WAVES, PERIOD)],
)
def test_wrong_arguments_are_refused(deviations, waves, period):
    with pytest.raises(ValueError, match=r"no negative deviation and waves of positive length"):
        MeasurementNoise(deviations, waves, period, 1)
