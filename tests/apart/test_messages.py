"""Every message goes to bytes and back bit for bit; whatever departs from its type is refused."""

import math
import struct
from itertools import product

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.inspect import BoolType, FloatType, IntType, Metadata, StrType

from coop_drake.apart import messages as msg

PAIRS = [(a, b) for a, b in product((0, msg.SUPERVISOR, msg.WORLD), repeat=2) if a != b]
raw = msgspec.msgpack.encode

SAMPLE = {
    "type": "Sample", "number": 1, "time": 0.5, "step": True, "stopped": False, "team_messages": [0, 0, 2],
    "pose_stamp": 0.5, "state_stamp": 0.5, "object_pose": [1.0, 2.0, 0.5], "robot_state": [0.0] * 8,
}  # fmt: skip


def values(kind):
    if isinstance(kind, Metadata):
        return values(kind.type)
    if isinstance(kind, BoolType):
        return st.booleans()
    if isinstance(kind, IntType):
        return st.integers(kind.ge, kind.le)
    if isinstance(kind, FloatType):
        return st.floats(allow_nan=kind.le is None, allow_infinity=kind.le is None)
    if isinstance(kind, StrType):
        return st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=kind.max_length)
    return st.lists(values(kind.item_type), max_size=12).map(tuple)


def messages(sender, receiver):
    return st.sampled_from(msg.kinds_of(sender, receiver)).flatmap(
        lambda cls: st.builds(cls, *(values(field.type) for field in msgspec.inspect.type_info(cls).fields))
    )


sent_between = st.sampled_from(PAIRS).flatmap(lambda pair: st.tuples(st.just(pair), messages(*pair)))


def refused(data, sender=msg.WORLD, receiver=0):
    with pytest.raises(msg.RefusedError) as caught:
        msg.decode(data, msg.decoder_of(sender, receiver))
    assert caught.value.reason is msg.Reason.MALFORMED
    return caught.value.detail


@given(sent_between, st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_every_message_comes_back_as_it_was_and_every_real_number_bit_for_bit(sent, session, number):
    pair, message = sent
    data = msg.encode(session, number, message)
    assert len(data) <= msg.LONGEST
    *head, back = msg.decode(data, msg.decoder_of(*pair))
    assert (head, type(back)) == ([session, number], type(message))
    assert msg.encode(session, number, back) == data  # So that a nan comes back as the same nan, too.


@given(sent_between, st.data())
def test_bytes_that_are_cut_changed_or_random_raise_nothing_but_a_refusal(sent, data):
    pair, message = sent
    whole = bytearray(msg.encode(1, 1, message))
    cut = bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    refused(cut, *pair)
    whole[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    for other in (bytes(whole), data.draw(st.binary(max_size=80))):
        try:
            _, _, read = msg.decode(other, msg.decoder_of(*pair))
        except msg.RefusedError:
            continue
        assert isinstance(read, msg.kinds_of(*pair))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time": math.nan}, "Expected `float` >= "),
        ({"robot_state": [1.0, math.inf]}, r"at `$[2].robot_state[1]`"),
        ({"time": True}, "Expected `float`, got `bool`"),
        ({"number": 2**32}, "Expected `int` <= 4294967295"),
        ({"robot_state": [0.0] * (msg.MOST_ITEMS + 1)}, "length <= 4096"),
        ({"more": 1}, "unknown field `more`"),
        ({"type": "Tick"}, "Invalid value 'Tick'"),  # That of a supervisor.
    ],
)
def test_a_field_of_another_type_or_beyond_its_limits_is_refused_and_named(change, words):
    assert msg.decode(raw([1, 1, SAMPLE]), msg.decoder_of(msg.WORLD, 0))[2].object_pose == (1.0, 2.0, 0.5)
    assert words in refused(raw([1, 1, SAMPLE | change]))


HEAD, NESTED = b"\x93\x01\x01", b"\x91" * 50_000 + b"\x00"
TYPE = raw("type") + raw("Sample")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        raw([1, 1, SAMPLE, 1]),
        raw([1, 1, SAMPLE]) + b"\0",
        b"\x93" + NESTED,
        HEAD + b"\x82" + TYPE + raw("more") + NESTED,
        HEAD + b"\x82" + raw("more") + b"\x81\0" * 50_000 + b"\0" + TYPE,
        HEAD + b"\x82" + TYPE + raw("robot_state") + b"\xdd\xff\xff\xff\xff",  # A list of 2^32 - 1 items.
        HEAD + b"\xdf\xff\xff\xff\xff" + TYPE,
        HEAD + b"\x82" + TYPE + b"\xa2\xff\xfe\0",  # A key that is no text.
    ],
)
def test_another_form_a_bomb_or_a_length_that_is_not_there_is_refused(data):
    refused(data)


def test_whole_numbers_count_as_real_ones_and_short_reals_are_read():
    whole = SAMPLE | {"time": 3, "object_pose": [1, 2, 2**64 - 1]}
    assert msg.decode(raw([1, 1, whole]), msg.decoder_of(msg.WORLD, 0))[2].object_pose == (
        1.0,
        2.0,
        float(2**64 - 1),
    )
    short = raw([1, 1, SAMPLE]).replace(b"\xcb" + struct.pack(">d", 2.0), b"\xca" + struct.pack(">f", 2.0))
    assert msg.decode(short, msg.decoder_of(msg.WORLD, 0))[2].object_pose == (1.0, 2.0, 0.5)


def test_what_only_the_log_shows_may_be_no_number_and_an_effort_may_not():
    shown = msg.Telemetry(1, 0.0, (), 0, 0, (math.nan, math.inf))
    assert math.isnan(msg.decode(msg.encode(1, 1, shown), msg.decoder_of(0, msg.WORLD))[2].values[0])
    refused(msg.encode(1, 1, msg.Effort(1, 0.0, (), 0, (math.nan,), ())), 0, msg.WORLD)


def test_who_may_send_what():
    ready = msg.encode(1, 1, msg.Ready(1, True))
    assert msg.decode(ready, msg.decoder_of(0, msg.SUPERVISOR))[2] == msg.Ready(1, True)
    for pair in PAIRS:
        if pair != (0, msg.SUPERVISOR):
            refused(ready, *pair)


def test_a_hello_says_its_protocol_in_all_versions():
    assert msg.protocol_of(msg.encode(7, 0, msg.Hello(msg.PROTOCOL, 0, "", ""))) == (7, msg.PROTOCOL)
    assert msg.protocol_of(raw([7, 0, {"type": "Hello", "protocol": 9, "name": "left arm"}])) == (7, 9)
    sample = msg.Sample(1, 0.0, True, False, (), 0.0, 0.0, (), ())
    for other in (msg.encode(7, 1, sample), b"\1\x0d\xcd\4\0", NESTED, raw([7, 0, {"type": "Hello"}])):
        assert msg.protocol_of(other) is None
