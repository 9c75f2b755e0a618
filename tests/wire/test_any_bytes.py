"""Any bytes, in both encodings and for every type, and any JSON are decoded or refused with an error."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.messages.services import SERVICES
from kbot.record.encodings.plain import from_plain
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.types import _known
from kbot.ros.service_types import service_type
from kbot.text import KbotError

TYPES = [(kind, name) for name, kind in sorted(_known().items())]
PARTS = [
    part
    for name in SERVICES
    for kind in (service_type(name),)
    for part in ((kind.request, kind.request_name), (kind.response, kind.response_name))
]
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=12,
)


@given(st.sampled_from(TYPES + PARTS), st.binary(max_size=300), st.booleans())
def test_random_bytes_are_decoded_or_refused(part: tuple[type, str], data: bytes, has_head: bool) -> None:
    kind, name = part
    with contextlib.suppress(KbotError):
        assert isinstance(decode_cdr((b"\0\1\0\0" if has_head else b"") + data, kind, name), kind)
    with contextlib.suppress(KbotError):
        assert isinstance(decode_ros1(data, kind, name), kind)


@pytest.mark.parametrize(("kind", "name"), TYPES + PARTS)
def test_truncated_or_changed_message_is_decoded_or_refused(kind: type, name: str) -> None:
    """The message truncated at every length, and with every byte inverted."""
    for encode, decode in ((encode_cdr, decode_cdr), (encode_ros1, decode_ros1)):
        try:
            whole = encode(kind(), name)
        except KbotError:
            assert encode is encode_ros1  # ROS 1 has fewer types
            continue
        assert isinstance(decode(whole, kind, name), kind)
        for length in range(min(len(whole), 200)):
            with contextlib.suppress(KbotError):
                decode(whole[:length], kind, name)
        for place in range(min(len(whole), 200)):
            bent = bytearray(whole)
            bent[place] ^= 0xFF
            with contextlib.suppress(KbotError):
                decode(bytes(bent), kind, name)


@given(st.sampled_from([kind for kind, _ in TYPES + PARTS]), JSON)
def test_any_json_is_accepted_or_refused(kind: type, value: object) -> None:
    with contextlib.suppress(KbotError):
        assert isinstance(from_plain(value, kind), kind)
