import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from coop_drake.laws.measurements import whole_periods
from coop_drake.systems import MessageChannel, clear_channel
from tests.support.system_checks import evaluate

PERIOD = 0.1
NEVER = [-1.0, -1.0]


class Clock(LeafSystem):
    """Reports (number of the period, 1)."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("report", 2, self._write)

    def _write(self, context, output):
        output.SetFromVector([round(context.get_time() / PERIOD), 1.0])


def heard(channel, periods=12):
    """Which report stands after every period."""
    builder = DiagramBuilder()
    builder.AddSystem(channel)
    builder.Connect(builder.AddSystem(Clock()).get_output_port(), channel.get_input_port())
    simulator = Simulator(builder.Build())
    numbers = []
    for period in range(periods):
        simulator.AdvanceTo((period + 0.5) * PERIOD)
        context = channel.GetMyContextFromRoot(simulator.get_context())
        numbers.append(channel.get_output_port().Eval(context)[0])
    return numbers


def test_before_the_first_report_none_counts():
    np.testing.assert_array_equal(evaluate(MessageChannel(PERIOD), {"sent": [4.0, 1.0]}, "heard"), NEVER)


def test_a_good_channel_passes_every_report_on():
    assert heard(MessageChannel(PERIOD)) == list(range(12))


def test_a_clear_channel_is_one_that_neither_loses_nor_delays():
    clear = clear_channel(PERIOD)
    assert not clear.HasAnyDirectFeedthrough()
    np.testing.assert_array_equal(clear.get_output_port().Eval(clear.CreateDefaultContext()), NEVER)
    assert heard(clear) == heard(MessageChannel(PERIOD)) == list(range(12))


@pytest.mark.parametrize(("delay", "periods"), [(0.1, 1), (0.3, 3), (0.25, 3), (0.30000000000000004, 3)])
def test_a_delay_is_rounded_up_to_whole_periods(delay, periods):
    assert whole_periods(delay, PERIOD) == periods
    assert heard(MessageChannel(PERIOD, delay=delay)) == [-1.0] * periods + list(range(12 - periods))


def test_a_deaf_channel_is_silent():
    assert heard(MessageChannel(PERIOD, loss=1.0)) == [-1.0] * 12


def test_a_lost_report_leaves_the_last_one_standing():
    numbers = heard(MessageChannel(PERIOD, loss=0.5, seed=1), periods=200)
    arrived = [n for period, n in enumerate(numbers) if n == period]
    assert 70 < len(arrived) < 130
    assert numbers == [max((n for n in arrived if n <= period), default=-1.0) for period in range(200)]


def test_a_repeated_report_arrives_one_delay_later_but_the_newest_counts():
    assert heard(MessageChannel(PERIOD, delay=0.2, repeat=1.0)) == [-1.0, -1.0, *range(10)]


def test_where_newer_reports_are_lost_a_repeated_one_is_heard_again():
    """Even after a newer one: a report sent in period n arrives in n + 2, and once more in n + 4."""
    arguments = {"delay": 0.2, "loss": 0.6, "seed": 5}
    plain = heard(MessageChannel(PERIOD, **arguments), periods=100)
    arrived = {n for n in range(98) if plain[n + 2] == n}
    expected, last = [], -1.0
    for period in range(100):
        last = next((n for n in (period - 2, period - 4) if n in arrived), last)
        expected.append(last)
    assert heard(MessageChannel(PERIOD, repeat=1.0, **arguments), periods=100) == expected
    assert expected != sorted(expected)


def test_a_seed_decides_and_every_run_is_the_same():
    channel = MessageChannel(PERIOD, loss=0.5, seed=7)
    first = heard(channel, 60)
    assert heard(MessageChannel(PERIOD, loss=0.5, seed=7), 60) == first
    assert heard(MessageChannel(PERIOD, loss=0.5, seed=8), 60) != first


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"period": 0.0}, "positive period"),
        ({"period": 0.1, "delay": -1.0}, "no negative delay"),
        ({"period": 0.1, "loss": 1.5}, "probabilities must lie in"),
        ({"period": 0.1, "repeat": float("nan")}, "probabilities must lie in"),
    ],
)
def test_bad_parameters_are_refused(arguments, complaint):
    with pytest.raises(ValueError, match=complaint):
        MessageChannel(**arguments)
