"""Decoding and encoding messages of every type gives the library's bytes, with strings and lists of all
lengths that change the alignment."""

import random
from typing import Any

import pytest
from rosbags.interfaces import Nodetype

from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.types import ros1_types, ros2_types
from kbot.text import KbotError

from .test_any_bytes import PARTS, TYPES

WHOLE = {"bool": 1, "byte": 255, "char": 127, "int8": 127, "uint8": 255, "int16": 1 << 14, "uint16": 1 << 15}

WIRE = ("seq", "structure_needs_at_least_one_member")
"""Fields that a message has only in its bytes. KBot writes zero."""


def random_message(store: Any, name: str, chance: random.Random) -> Any:
    fields = store.fielddefs[name][1]
    parts = {field: _random_field(store, desc, chance) for field, desc in fields}
    return store.types[name](**{field: 0 if field in WIRE else part for field, part in parts.items()})


def _random_field(store: Any, desc: Any, chance: random.Random) -> Any:
    match desc:
        case (Nodetype.NAME, name):
            return random_message(store, name, chance)
        case (Nodetype.BASE, ("string", _)):
            return "äbc"[: chance.randrange(4)] * chance.randrange(80)
        case (Nodetype.BASE, (base, _)):
            return _random_number(base, chance)
        case (kind, (item, count)):
            length = count if kind == Nodetype.ARRAY else chance.randrange(6)
            values = [_random_field(store, item, chance) for _ in range(length)]
            if item[0] != Nodetype.BASE or item[1][0] == "string":
                return values
            import numpy as np

            dtype = {"byte": "uint8", "char": "uint8"}.get(item[1][0], item[1][0])
            return np.array(values, dtype)
    raise AssertionError(desc)


def _random_number(base: str, chance: random.Random) -> Any:
    if base.startswith("float"):
        return float(chance.randrange(-100, 100)) / 4
    if base == "bool":
        return chance.random() < 0.5
    return chance.randrange(WHOLE.get(base, 1 << 30))


@pytest.mark.parametrize(("kind", "name"), TYPES + PARTS)
def test_decoding_and_encoding_gives_the_same_bytes(kind: type, name: str) -> None:
    for seed in range(20):
        message = random_message(ros2_types(), name, random.Random(seed))
        data = bytes(ros2_types().serialize_cdr(message, name, little_endian=True))
        assert encode_cdr(decode_cdr(data, kind, name), name) == data
        if name not in ros1_types().fielddefs:
            continue
        message = random_message(ros1_types(), name, random.Random(seed))
        data = bytes(ros1_types().serialize_ros1(message, name))
        assert encode_ros1(decode_ros1(data, kind, name), name) == data


@pytest.mark.parametrize(
    "message",
    [
        msg.Twist(msg.Vector3("fast")),  # type: ignore[arg-type] - what a user may do
        msg.Twist(None),  # type: ignore[arg-type] - the same
        msg.PoseWithCovariance(covariance=(1.0,)),
        msg.JointState(name="ab", position=(1.0, "b")),  # type: ignore[arg-type] - the same
        msg.String(5),  # type: ignore[arg-type] - the same
        msg.Time(1 << 40),
    ],
)
def test_field_of_a_wrong_type_is_one_error(message: object) -> None:
    for encode in (encode_cdr, encode_ros1):
        with pytest.raises(KbotError, match=r"not a \w+/msg/\w+: "):
            encode(message)
