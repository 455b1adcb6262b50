"""Messages that are lost, late or repeated: what leaves, what is taken and counted, and by which seed."""

import msgspec
import pytest

from coop_drake.apart.faults import ChannelFaults, ClockFault, Faults, Gap, load_faults
from coop_drake.apart.messages import SUPERVISOR, WORLD, Effort, Ready, Sample, Telemetry, Welcome
from coop_drake.apart.team_files import local_book
from coop_drake.apart.transport import Network, Session
from coop_drake.errors import ScenarioError

PERIOD = 0.01


def sending(faults, messages, sender=0, receiver=SUPERVISOR):
    """Numbers of the messages that leave at each sample, one message being sent at each."""
    left, now = [], []

    def put(data):
        now.append(msgspec.msgpack.decode(data)[1])
        return True

    session = Session(put, Network(local_book(2), faults=faults, period=PERIOD).link(sender, receiver))
    session.begin(1, is_open=True)
    for sample, message in enumerate(messages):
        session.send(message, sample)
        session.release(sample)
        left.append(tuple(now))
        now.clear()
    return left, session.sent


def reports(count):
    return [Ready(cell, True) for cell in range(count)]


def test_every_message_has_its_own_fate_by_the_seed():
    faults = [Faults(seed=seed, team=ChannelFaults(loss=0.3, repeat=0.3)) for seed in (1, 1, 2)]
    first, again, other = (sending(fault, reports(200)) for fault in faults)
    assert first == again
    assert first != other
    counts = [len(numbers) for numbers in first[0]]
    assert 40 < counts.count(0) < 80
    assert 25 < counts.count(2) < 65
    assert first[1] == 200 - counts.count(0)
    assert sending(faults[0], reports(200), sender=1) != first


def test_late_messages_leave_after_what_is_sent_then_and_count_where_nothing_has_overtaken_them():
    faults = Faults(team=ChannelFaults(late=1.0, late_by=0.015))
    assert sending(faults, reports(6)) == ([(1,), (), (), (2,), (3,), (4,)], 4)
    mixed, sent = sending(Faults(seed=3, team=ChannelFaults(late=0.5, late_by=0.03)), reports(40))
    order = [number for numbers in mixed for number in numbers]
    assert order != sorted(order)
    assert sent == sum(number > max(order[:k], default=0) for k, number in enumerate(order))


def test_nothing_passes_a_gap_but_what_the_log_needs():
    gap = Gap(0.02, 0.03, robots=(0,))
    samples = [Sample(k, k * PERIOD, True, False, 0, 0.0, 0.0, (), ()) for k in range(8)]
    faults = Faults(sensors=ChannelFaults(gaps=(gap,)), efforts=ChannelFaults(gaps=(gap,)))
    assert sending(faults, samples, WORLD, 0)[0] == [(1,), (2,), (), (), (), (6,), (7,), (8,)]
    assert sending(faults, samples, WORLD, 1)[1] == 8
    looks = [msgspec.structs.replace(sample, step=False) for sample in samples]
    assert sending(faults, looks, WORLD, 0)[1] == 8
    assert sending(faults, [Effort(k, 0.0, 0, 0, (), ()) for k in range(8)], 0, WORLD)[1] == 5
    assert sending(faults, [Telemetry(k, 0.0, 0, 0, 0, ()) for k in range(8)], 0, WORLD)[1] == 8
    assert sending(faults, [Welcome()] * 8, WORLD, 0)[0] == [(0,)] * 8


def test_a_clock_shows_its_own_time():
    faults = Faults(clocks=(ClockFault(1, offset=0.5, drift=0.01),))
    assert (faults.clock(0, 3.0), faults.clock(1, 3.0)) == (3.0, pytest.approx(3.53))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("team: {loss: 1.5}", "team.loss"),
        ("radio: {loss: 0.5}", "radio"),
        ("sensors: {gaps: [{begin: 1, duration: 1, robots: [2]}]}", r"sensors.gaps\[0\].robots"),
        ("clocks: [{robot: 7, offset: 0.1}]", r"clocks\[0\].robot"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_key(tmp_path, text, key):
    path = tmp_path / "faults.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match=f"faults.yaml.*{key}"):
        load_faults(path, 2)


def test_a_file_is_read(tmp_path):
    path = tmp_path / "faults.yaml"
    path.write_text("seed: 3\nteam: {loss: 0.2, gaps: [{begin: 1, duration: 0.5}]}\n", encoding="utf-8")
    expected = Faults(seed=3, team=ChannelFaults(loss=0.2, gaps=(Gap(1.0, 0.5),)))
    assert load_faults(path, 2) == expected
