import numpy as np
import pytest

from coop_drake.systems import ShiftedMeasurement
from tests.support.system_checks import evaluate

PERIOD = 0.1


@pytest.mark.parametrize(("share", "measured"), [(0.25, [2.5, -1.5]), (1.0, [1.0, 0.0]), (-0.5, [4.0, -3.0])])
def test_it_shows_what_was_or_will_be_by_the_motion_of_the_last_period(share, measured):
    block = ShiftedMeasurement(2, share, PERIOD)
    context = block.CreateDefaultContext()
    block.GetInputPort("exact").FixValue(context, [1.0, 0.0])
    context.SetDiscreteState(block.EvalUniquePeriodicDiscreteUpdate(context))
    block.GetInputPort("exact").FixValue(context, [3.0, -2.0])
    np.testing.assert_allclose(block.GetOutputPort("measured").Eval(context), measured, atol=1e-15)


def test_what_rests_is_measured_as_it_is():
    assert evaluate(ShiftedMeasurement(1, 0.7, PERIOD), {"exact": [0.0]}, "measured", 0.3) == [0.0]
