"""The protocol: the page's types match the server's, and only valid messages are accepted."""

import json
import typing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.workbench.protocol import Drive, FromPage, Refused, Reset, SaveSource, SetJoint, SetSpeed, State
from kbot.workbench.protocol.codec import BadMessage, decode, encode
from kbot.workbench.typescript import generate, generate_kinds, generate_messages

SOURCES = Path(__file__).parents[2] / "web" / "src"


def test_the_pages_types_are_generated_from_the_server() -> None:
    for name, text in (
        ("protocol.ts", generate()),
        ("messages.ts", generate_messages()),
        ("displays/kinds.ts", generate_kinds()),
    ):
        assert (SOURCES / name).read_text(encoding="utf-8") == text, name


def test_every_message_has_its_own_type() -> None:
    types = [typing.get_type_hints(cls)["type"] for cls in typing.get_args(FromPage)]
    assert len(set(types)) == len(types)


def test_valid_messages_are_decoded() -> None:
    assert decode('{"type": "drive", "linear": 1, "angular": -0.5}') == Drive(1.0, -0.5)
    assert decode('{"type": "set_joint", "name": "j", "position": 0.25}') == SetJoint("j", 0.25)
    assert decode('{"type": "reset"}') == Reset()
    saved = '{"type": "save_source", "file": "f", "was": %s, "text": "t"}'
    assert decode(saved % '"w"') == SaveSource("f", "w", "t")
    assert decode(saved % "null") == SaveSource("f", None, "t")
    assert decode('{"type": "set_speed", "factor": 10}') == SetSpeed(10.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[1]", "not a JSON object"),
        ("{}", "unknown message type null"),
        ('{"type": "drove"}', "did you mean 'drive'?"),
        ('{"type": "drive", "linear": 0}', "'angular' is missing"),
        ('{"type": "drive", "linear": 0, "angular": 0, "x": 1}', 'unknown field "x"'),
        ('{"type": "drive", "linear": "1", "angular": 0}', "not a number"),
        ('{"type": "drive", "linear": true, "angular": 0}', "not a number"),
        ('{"type": "drive", "linear": 11, "angular": 0}', "not between -10 and 10"),
        ('{"type": "drive", "linear": NaN, "angular": 0}', "not between"),
        ('{"type": "drive", "linear": 1e999, "angular": 0}', "not between"),
        ('{"type": "drive", "linear": ' + "9" * 400 + ', "angular": 0}', "not between"),
        ('{"type": "pause", "paused": 1}', "not true or false"),
        ('{"type": "set_joints", "preset": "up"}', "one of zero, centre, random"),
        ('{"type": "set_joint", "name": "' + "j" * 300 + '", "position": 0}', "300 characters"),
        ('{"type": "open_source", "file": 3}', "not a string"),
        ('{"type": "save_displays", "kind": "file", "setup": []}', "not a JSON object"),
        (
            '{"type": "save_displays", "kind": "file", "setup": {"a": ' + "[" * 30 + "]" * 30 + "}}",
            "20 levels",
        ),
        ("[" * 60_000, "not JSON"),
        ('{"type": "open_source", "file": "' + "a" * 70_000 + '"}', "the limit is 65536"),
        ('"' + "a" * 7_400_000 + '"', "the limit is 7340032"),
        (
            '{"type": "save_source", "file": "a", "was": "", "text": "' + "a" * 500_001 + '"}',
            "500001 bytes: the limit is 500000",
        ),
        (  # three bytes each
            '{"type": "save_source", "file": "a", "was": "", "text": "' + "字" * 166_667 + '"}',
            "500001 bytes: the limit is 500000",
        ),
    ],
)
def test_bad_messages_are_refused_with_the_reason(text: str, message: str) -> None:
    with pytest.raises(BadMessage) as caught:
        decode(text)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_binary_message_is_refused() -> None:
    with pytest.raises(BadMessage):
        decode(b"\x00")


VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
TYPES = [typing.get_args(typing.get_type_hints(cls)["type"])[0] for cls in typing.get_args(FromPage)]
FIELDS = ["linear", "angular", "name", "position", "preset", "paused", "seconds", "factor", "file", "x"]


@given(st.text(max_size=80) | VALUES.map(json.dumps))
def test_everything_else_is_refused(text: str) -> None:
    with pytest.raises(BadMessage):
        decode(text)


@given(st.sampled_from(TYPES), st.dictionaries(st.sampled_from(FIELDS), VALUES, max_size=3))
def test_any_values_are_decoded_or_refused(kind: str, fields: dict[str, object]) -> None:
    try:
        message = decode(json.dumps({**fields, "type": kind}))
    except BadMessage:
        return
    assert message.type == kind


def test_messages_to_the_page_are_json_without_nan() -> None:
    assert json.loads(encode(Refused("no"))) == {"reason": "no", "type": "refused"}
    state = State(
        1, 0.5, False, 1.0, 1.0, (0.0,), (0.0,) * 7, (), (), (), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0, 0.0), 0, 0
    )
    assert json.loads(encode(state))["time"] == 0.5
    with pytest.raises(ValueError, match="JSON"):
        encode(State(1, float("nan"), False, 1.0, 1.0, (), (), (), (), (), (), (), (), 0, 0))
