import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import FirstOrderLowPassFilter, ZeroOrderHold

from coop_drake.systems import LaggingEffort

LAG, PERIOD = 0.03, 0.02


class Wanted(LeafSystem):
    """Asks for efforts that change all the time."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("wanted", 2, self._write)

    def _write(self, context, output):
        output.SetFromVector([3.0 + context.get_time(), np.sin(40.0 * context.get_time())])


def simulated(offset):
    """Efforts of the block and of Drake's filter, integrated in short steps, at some times."""
    builder = DiagramBuilder()
    hold = builder.AddSystem(ZeroOrderHold(PERIOD, 2, offset))
    builder.Connect(builder.AddSystem(Wanted()).get_output_port(), hold.get_input_port())
    blocks = [
        builder.AddSystem(block)
        for block in (LaggingEffort(2, LAG, PERIOD, offset), FirstOrderLowPassFilter(LAG, 2))
    ]
    for block in blocks:
        builder.Connect(hold.get_output_port(), block.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    given = []
    for time in (0.0, 0.005, 0.02, 0.033, 0.1, 0.1101, 0.2):
        simulator.AdvanceTo(time)
        root = simulator.get_context()
        given.append([block.get_output_port().Eval(block.GetMyContextFromRoot(root)) for block in blocks])
    return np.array(given).transpose(1, 0, 2)


@pytest.mark.parametrize("offset", [0.0, 0.007])
def test_efforts_are_those_of_a_low_pass_behind_a_hold(offset):
    own, drakes = simulated(offset)
    np.testing.assert_array_equal(own[0], 0.0)
    np.testing.assert_allclose(own, drakes, rtol=1e-6, atol=1e-9)
    assert own[-1, 0] > 2.9


@pytest.mark.parametrize(("lag", "period"), [(0.0, PERIOD), (-LAG, PERIOD), (LAG, 0.0)])
def test_wrong_arguments_are_refused(lag, period):
    with pytest.raises(ValueError, match="needs a positive lag and period"):
        LaggingEffort(2, lag, period)
