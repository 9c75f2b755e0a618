"""Fuzzes the payloads of messages: CDR of ROS 2, Zenoh and DDS, the encoding of ROS 1, and JSON.

A payload is decoded or refused with a KbotError. Decoded messages can be encoded again.
"""

from contextlib import suppress
from types import SimpleNamespace

import orjson
from choices import Choices
from edits import edited
from simulated import LINK

from kbot.messages.services import SERVICES
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.types import _known
from kbot.ros.bridges.zenoh.parameters import _type_names, _types, parameter_services
from kbot.ros.bridges.zenoh.queryables import _attachment
from kbot.ros.service_types import service_type
from kbot.text import KbotError
from kbot.text.json_text import parse_json

TYPES = [(kind, name) for name, kind in sorted(_known().items())]
for kind in map(service_type, SERVICES):
    TYPES += [(kind.request, kind.request_name), (kind.response, kind.response_name)]
PARAMETER_SERVICES = parameter_services(LINK, "/kbot")
STORE = _types()
NAMES = ["", "use_sim_time", "a.b"]


def one_of_cdr(choices: Choices) -> None:
    kind, name = choices.pick(TYPES)
    data = edited(choices, [encode_cdr(kind(), name)])
    with suppress(KbotError):
        encode_cdr(decode_cdr(data, kind, name), name)


def one_of_ros1(choices: Choices) -> None:
    kind, name = choices.pick(TYPES)
    with suppress(KbotError):
        data = edited(choices, [encode_ros1(kind(), name)])
        encode_ros1(decode_ros1(data, kind, name), name)


def one_of_json(choices: Choices) -> None:
    kind, _ = choices.pick(TYPES)
    data = edited(
        choices, [orjson.dumps(to_plain(kind()), default=str)], [b"null", b"[]", b"{}", b'"a"', b"NaN"]
    )
    with suppress(ValueError, KbotError):
        to_plain(from_plain(parse_json(data), kind))


def request(service: str) -> bytes:
    """A call of a parameter service, with values in its lists."""
    name = _type_names(service)[1]
    empty = {"prefixes": NAMES, "depth": 0, "names": NAMES, "parameters": []}
    fields = {field: empty[field] for field, _ in STORE.fielddefs[name][1]}
    return bytes(STORE.serialize_cdr(SimpleNamespace(**fields), name))


def one_of_zenoh(choices: Choices) -> None:
    """A call of a parameter service, and its attachment."""
    served = choices.pick(PARAMETER_SERVICES)
    data = edited(choices, [request(served.name.rpartition("/")[2])])
    with suppress(KbotError):
        served.encode(served.call(data).result())
    attached = edited(choices, [bytes(33)])
    _attachment(SimpleNamespace(attachment=SimpleNamespace(to_bytes=lambda: attached)))


TARGETS = {
    "cdr": one_of_cdr,
    "ros1-messages": one_of_ros1,
    "json-messages": one_of_json,
    "zenoh-services": one_of_zenoh,
}
