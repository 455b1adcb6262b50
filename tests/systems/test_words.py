"""Robots and supervisor in Drake hear, decide and speak in the order that the laws state."""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Multiplexer

from coop_drake.diagram.deployment import radio_of
from coop_drake.laws import words as w
from coop_drake.laws.measurements import uniform_pair
from coop_drake.scenario import Deafness, Deployment, Messages, RobotDepartures, Silence
from coop_drake.systems import RobotWords, WordPlanner
from tests.support.word_world import even_schedule

SAMPLES = 900
DEPLOYMENT = Deployment(
    control_rate=200.0,
    messages=Messages(loss=0.3, delay=0.01, repeat=0.5),
    robots={
        "first": RobotDepartures(clock_error=0.001, silence=Silence(1.0, 0.4)),
        "second": RobotDepartures(switch_delay=0.005, deaf=Deafness(2.0, 0.2)),
    },
)


def test_words_in_drake_are_those_of_a_loop_over_samples():
    """Losses, delays, a mute and a deaf robot and a wrong clock: all that anybody knows is the same."""
    schedule = even_schedule(8)
    radios = [radio_of(DEPLOYMENT, ["first", "second"], row) for row in range(3)]
    builder = DiagramBuilder()
    network = builder.AddSystem(Multiplexer([9 * radio.kept for radio in radios]))
    nodes = [builder.AddSystem(RobotWords(schedule, radio)) for radio in radios[:2]]
    nodes.append(builder.AddSystem(WordPlanner(schedule, radios[2])))
    there = builder.AddSystem(ConstantVectorSource([7.0, 0.0]))
    for i, node in enumerate(nodes):
        builder.Connect(node.GetOutputPort("said"), network.get_input_port(i))
        builder.Connect(network.get_output_port(), node.GetInputPort("words"))
        if i < 2:
            builder.Connect(there.get_output_port(), node.GetInputPort("ready"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(schedule.period * (SAMPLES - 0.5))

    known = np.array([w.first_words(schedule, 2)] * 3)
    motions, said = [w.first_motion(), w.first_motion()], []
    holds = np.inf
    for sample in range(SAMPLES):
        time = sample * schedule.period
        for row in range(3):
            age = 1 + [2, 3, 2][row]
            for sender in range(3):
                lost = uniform_pair(radios[row].seeds[sender], sample)[0] < 0.3
                deaf = row == 1 and 400 <= sample < 440
                if sender != row and sample >= age and not lost and not deaf:
                    w.hear(known[row], sender, said[sample - age][sender])
            if row == 2:
                w.supervisor_step(schedule, time, True, known[row])
            else:
                alarm, clock = (w.THERE if sample else w.QUIET), time + (0.001 if row == 0 else 0.0)
                w.robot_step(schedule, clock, alarm, row, motions[row], known[row])
        rows = known[[0, 1, 2], [0, 1, 2]].copy()
        if 200 <= sample < 280:
            rows[0] = said[-1][0]
        said.append(rows)
        holds = min(holds, rows[1, w.HOLD])
    assert holds < np.inf  # It was held by what broke.
    assert known[2, 2, w.EPOCH] >= 2.0
    for row, node in enumerate(nodes):
        state = node.GetMyContextFromRoot(simulator.get_context()).get_discrete_state_vector().value()
        np.testing.assert_array_equal(state[:27].reshape(3, 9), known[row])
        if row < 2:
            more = 27 + 9 * radios[row].kept
            np.testing.assert_array_equal(state[more : more + w.MOTION_SIZE], motions[row])
