"""Every message of the schema goes to bytes and back; whatever departs from it is refused."""

import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.messages import Effort, Ready, Reason, Sample, Status
from coop_drake.messages.codec import (
    LONGEST,
    MAGIC,
    OPENING,
    OPENING_HEADER,
    VERSION,
    decode,
    encode,
    header_of,
    layout_of,
)
from coop_drake.messages.refusals import RefusedError
from coop_drake.messages.wire import KINDS, MESSAGES, MOST_ITEMS, allowed_kinds, message

BYTES_OF = {"B": 1, "H": 2, "I": 4, "Q": 8}


def one_value(wire):
    if wire.code == "?":
        return st.booleans()
    if wire.code == "d":
        return st.floats(allow_nan=False, allow_infinity=not wire.finite)
    return st.integers(0, 256 ** BYTES_OF[wire.code] - 1)


def values(wire):
    return st.lists(one_value(wire), max_size=12).map(tuple) if wire.listed else one_value(wire)


def messages():
    return st.sampled_from(list(KINDS)).flatmap(
        lambda cls: st.tuples(*map(values, layout_of(cls).wires.values())).map(cls._make)
    )


def read(data):
    return decode(data, header_of(data), MESSAGES)


@given(messages(), st.integers(0, 255), st.integers(0, 255), st.integers(0, 2**32 - 1))
def test_every_message_comes_back_as_it_was(sent, sender, session, sequence):
    data = encode(sent, sender, session, sequence)
    kind = KINDS[type(sent)].code
    assert header_of(data)[:4] == ((kind, sender, 0, 0) if kind in OPENING else (kind, -1, session, sequence))
    assert read(data) == sent
    assert type(read(data)) is type(sent)


@given(messages(), st.data())
def test_any_other_length_is_refused(sent, data):
    whole = encode(sent, 0, 1, 1)
    other = data.draw(st.sampled_from([whole[: data.draw(st.integers(0, len(whole) - 1))], whole + b"\0"]))
    with pytest.raises(RefusedError) as refused:
        read(other)
    assert refused.value.reason is Reason.LENGTH


@given(
    st.one_of(
        st.binary(max_size=80),
        st.binary(max_size=80).map(lambda rest: b"\x10" + rest),
        st.binary(max_size=80).map(lambda rest: OPENING_HEADER.pack(1, MAGIC, VERSION, 0) + rest),
    )
)
def test_random_bytes_are_refused_or_read_and_raise_nothing_else(data):
    try:
        found = read(data)
    except RefusedError:
        return
    _, sender, session, sequence, _ = header_of(data)
    assert encode(found, sender, session, sequence) == data


@given(messages(), st.data())
def test_a_changed_byte_is_refused_or_gives_another_message_of_the_schema(sent, data):
    changed = bytearray(encode(sent, 3, 1, 1))
    changed[data.draw(st.integers(0, len(changed) - 1))] ^= data.draw(st.integers(1, 255))
    with suppress(RefusedError):
        assert type(read(bytes(changed))) in KINDS


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", Reason.LENGTH),
        (OPENING_HEADER.pack(1, MAGIC + 1, VERSION, 0), Reason.MAGIC),
        (OPENING_HEADER.pack(1, MAGIC, VERSION + 1, 0), Reason.VERSION),
        (b"\xc8" * 20, Reason.KIND),
        (b"\4" + b"\0" * LONGEST, Reason.LENGTH),
        (b"\4\1\x81\0", Reason.LENGTH),
        (b"\4\1\xff\xff\xff\xff\x7f", Reason.LENGTH),
        (encode(Ready(1, True), 0, 1, 1)[:-1] + b"\2", Reason.VALUE),
        (encode(Effort(1, 0.0, 0, 0, (float("nan"),)), 0, 1, 1), Reason.VALUE),
        (encode(Effort(1, 0.0, 0, 0, (1.0, float("inf"))), 0, 1, 1), Reason.VALUE),
        (encode(Sample(1, float("nan"), True, False, 0, 0.0, 0.0, (), ()), 0, 1, 1), Reason.VALUE),
        (encode(Status(1, 0.0, True, (), 0, 0.0, False, (0,) * (MOST_ITEMS + 1), 0), 0, 1, 1), Reason.LENGTH),
    ],
)
def test_each_departure_has_its_reason(data, reason):
    with pytest.raises(RefusedError) as refused:
        read(data)
    assert refused.value.reason is reason


def test_a_length_that_counts_more_than_there_is_is_refused_before_it_is_read():
    data = bytearray(encode(Effort(1, 0.0, 0, 0, (1.0, 2.0)), 0, 1, 1))
    struct.pack_into("<H", data, header_of(data).size + 17, 65535)
    with pytest.raises(RefusedError) as refused:
        read(bytes(data))
    assert refused.value.reason is Reason.LENGTH


def test_a_kind_is_allowed_on_its_channel_and_from_its_sender_alone():
    data = encode(Ready(1, True), 0, 1, 1)
    header = header_of(data)
    assert decode(data, header, allowed_kinds("team", ("robot",))) == Ready(1, True)
    for channel, sender in (("sensors", "robot"), ("team", "supervisor")):
        with pytest.raises(RefusedError) as refused:
            decode(data, header, allowed_kinds(channel, (sender,)))
        assert refused.value.reason is Reason.KIND


def test_what_a_field_cannot_hold_is_not_sent():
    with pytest.raises(ValueError, match="Ready"):
        encode(Ready(-1, True), 0, 1, 1)


def test_no_code_is_given_twice():
    with pytest.raises(ValueError, match="code 16 is taken by Sample"):
        message(16, "team", "robot")(type("Other", (), {}))
