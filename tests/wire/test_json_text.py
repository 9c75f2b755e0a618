"""JSON by forms against Python's own of the same values, of every type there is."""

import json
import math
import random

import numpy as np
import pytest

from kbot.messages import navigation, sensing
from kbot.messages import types as msg
from kbot.text import KbotError
from kbot.wire import decode_cdr
from kbot.wire.json_text import json_text
from kbot.wire.plain import to_plain
from kbot.wire.types import ros2_types

from .test_any_bytes import PARTS, TYPES
from .test_layout import random_message


@pytest.mark.parametrize(("kind", "name"), TYPES + PARTS)
@pytest.mark.parametrize("ros1", [False, True])
def test_it_says_what_pythons_own_says(kind: type, name: str, ros1: bool) -> None:
    for seed in range(5):
        found = random_message(ros2_types(), name, random.Random(seed))
        data = bytes(ros2_types().serialize_cdr(found, name, little_endian=True))
        for message in (decode_cdr(data, kind, name), kind()):
            for exact in (False, True):
                text = json_text(message, ros1=ros1, exact=exact)
                assert text == json.dumps(to_plain(message, ros1=ros1, exact=exact))


@pytest.mark.parametrize(
    ("message", "null", "exact"),
    [
        (msg.Point(math.nan, -math.inf, 1.5), '"x": null, "y": null', '"x": NaN, "y": -Infinity, "z": 1.5'),
        (
            sensing.LaserScan(ranges=np.array([0.5, np.inf, np.nan], np.float32)),
            '"ranges": [0.5, null, null]',
            '"ranges": [0.5, Infinity, NaN]',
        ),
        (msg.JointState(position=(-0.0, math.inf)), "[-0.0, null]", "[-0.0, Infinity]"),
        (msg.JointState(position=(np.float64(0.1), 2)), "[0.1, 2.0]", "[0.1, 2.0]"),
        (msg.Point(np.float64(0.1), 2), '"x": 0.1, "y": 2,', '"x": 0.1, "y": 2,'),
        (msg.String('a"%s\n'), r'"a\"%s\n"', r'"a\"%s\n"'),
        (navigation.Path(), '"poses": []', '"poses": []'),
        (sensing.Bool(True), '{"data": true}', '{"data": true}'),
    ],
)
def test_by_hand(message: object, null: str, exact: str) -> None:
    assert null in json_text(message)
    assert exact in json_text(message, exact=True)
    json.loads(json_text(message))


def test_a_field_of_another_type_is_one_clear_error() -> None:
    with pytest.raises(KbotError, match="no Point: "):
        json_text(msg.Point("far"))  # type: ignore[arg-type] - what a user may do
