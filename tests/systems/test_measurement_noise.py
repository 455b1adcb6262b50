import numpy as np
import pytest

from coop_drake.laws.random_draws import write_normals
from coop_drake.systems import MeasurementNoise
from tests.support.system_checks import assert_every_input_is_required, evaluate, port_sizes

PERIOD, DEVIATIONS = 0.1, np.array([0.0, 0.5, 2.0])


def test_ports():
    assert port_sizes(MeasurementNoise(DEVIATIONS, PERIOD, 1)) == ({"exact": 3}, {"measured": 3})
    block = MeasurementNoise(DEVIATIONS, PERIOD, 1)
    assert_every_input_is_required(block, {"exact": [0.0] * 3}, {"measured": {"exact"}})


@pytest.mark.parametrize(("time", "number"), [(0.0, 0), (0.05, 0), (0.3, 3), (0.7 - 1e-12, 7)])
def test_noise_is_drawn_by_the_number_of_the_period(time, number):
    drawn = np.empty(3)
    write_normals(4, number, drawn)
    measured = evaluate(MeasurementNoise(DEVIATIONS, PERIOD, 4), {"exact": [1.0, 2.0, 3.0]}, "measured", time)
    np.testing.assert_allclose(measured, [1.0, 2.0, 3.0] + DEVIATIONS * drawn, atol=1e-15)


@pytest.mark.parametrize(("deviations", "period"), [(DEVIATIONS, 0.0), (-DEVIATIONS, PERIOD)])
def test_wrong_arguments_are_refused(deviations, period):
    with pytest.raises(
        ValueError, match=r"MeasurementNoise needs a positive period and no negative deviation"
    ):
        MeasurementNoise(deviations, period, 1)
