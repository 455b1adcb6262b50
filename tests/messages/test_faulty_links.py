"""Messages that are lost, late or repeated: what leaves, what is taken and counted, and by which seed."""

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.messages import MessageClient, Present, Ready
from coop_drake.messages.codec import header_of
from coop_drake.messages.faults import ChannelFaults, ClockFault, Faults, Gap, load_faults
from coop_drake.messages.outgoing import Links, Outgoing
from coop_drake.messages.schema import SUPERVISOR, WORLD, Effort, Sample, Telemetry
from tests.support.message_pairs import QUESTION, Pairs

PERIOD = 0.01


def sending(channel, faults, messages, sender=0, receiver=SUPERVISOR):
    """Numbers of the messages that leave at each sample, one message being sent at each."""
    outgoing = Outgoing(Links(faults, PERIOD).between(channel, sender, receiver))
    left, now = [], []

    def put(data):
        now.append(header_of(data).sequence)
        return True

    for sample, message in enumerate(messages):
        outgoing.sample = sample
        outgoing.send(message, sender, 1, put)
        outgoing.release(put)
        left.append(tuple(now))
        now.clear()
    return left, outgoing.sent


def reports(count):
    return [Ready(cell, True) for cell in range(count)]


def test_every_message_has_its_own_fate_by_the_seed():
    faults = [Faults(seed=seed, team=ChannelFaults(loss=0.3, repeat=0.3)) for seed in (1, 1, 2)]
    first, again, other = (sending("team", fault, reports(200)) for fault in faults)
    assert first == again
    assert first != other
    counts = [len(numbers) for numbers in first[0]]
    assert 40 < counts.count(0) < 80
    assert 25 < counts.count(2) < 65
    assert first[1] == 200 - counts.count(0)
    assert sending("team", faults[0], reports(200), sender=1) != first


def test_late_messages_leave_after_what_is_sent_then_and_count_where_nothing_has_overtaken_them():
    faults = Faults(team=ChannelFaults(late=1.0, late_by=0.015))
    assert sending("team", faults, reports(6)) == ([(1,), (), (), (2,), (3,), (4,)], 4)
    mixed, sent = sending("team", Faults(seed=3, team=ChannelFaults(late=0.5, late_by=0.03)), reports(40))
    order = [number for numbers in mixed for number in numbers]
    assert order != sorted(order)
    assert sent == sum(number > max(order[:k], default=0) for k, number in enumerate(order))


def test_nothing_passes_a_gap_but_what_the_log_needs():
    gap = Gap(0.02, 0.03, robots=(0,))
    samples = [Sample(k, k * PERIOD, True, False, 0, 0.0, 0.0, (), ()) for k in range(8)]
    faults = Faults(sensors=ChannelFaults(gaps=(gap,)), efforts=ChannelFaults(gaps=(gap,)))
    assert sending("sensors", faults, samples, WORLD, 0)[0] == [(1,), (2,), (), (), (), (6,), (7,), (8,)]
    assert sending("sensors", faults, samples, WORLD, 1)[1] == 8
    looks = [sample._replace(step=False) for sample in samples]
    assert sending("sensors", faults, looks, WORLD, 0)[1] == 8
    assert sending("efforts", faults, [Effort(k, 0.0, 0, 0, ()) for k in range(8)], 0, WORLD)[1] == 5
    assert sending("efforts", faults, [Telemetry(k, 0.0, 0, 0, 0, ()) for k in range(8)], 0, WORLD)[1] == 8
    assert sending("efforts", faults, [Present()] * 8, 0, WORLD)[1] == 8


def test_both_ends_count_what_is_lost_and_refused():
    faults = Faults(seed=1, team=ChannelFaults(loss=0.3, repeat=0.5, late=0.2, late_by=0.02))
    pairs, left = Pairs(), []
    links = Links(faults, PERIOD)
    client = MessageClient(
        pairs.server.address,
        SUPERVISOR,
        channel="team",
        sender=0,
        question=QUESTION,
        links=links,
        tap=lambda way, _, data: left.append(header_of(data).sequence) if way == "sent" else None,
    )
    try:
        peer = pairs.server.peers[0]
        pairs.settle(lambda: client.session and peer.session == client.session, client)
        left.clear()
        for sample in range(40):
            client.begin(sample)
            client.send(Ready(sample, True))
            client.release()
        heard = pairs.settle(lambda: peer.incoming.received + pairs.server.refusals.total == 1 + len(left))
        newer = [number for k, number in enumerate(left) if number > max(left[:k], default=1)]
        assert [message.cell + 2 for _, message in heard] == newer
        assert client.sent == peer.incoming.received == 1 + len(newer)
        assert {reason.name for reason in pairs.server.refusals.counts} == {"SEQUENCE"}
        assert peer.incoming.lost == peer.incoming.last - peer.incoming.received
    finally:
        client.close()
        pairs.close()


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
