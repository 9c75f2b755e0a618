"""DDS samples of ROS messages: their type is described to peers, and their content is bytes in CDR."""

from __future__ import annotations

import dataclasses
import types
from functools import cache
from typing import Any

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from rosbags.interfaces import Nodetype

from kbot.record.encodings.types import ros2_types

Dds = Any
"""An object of the DDS library, which has no type annotations."""

array: Dds = idl.array
sequence: Dds = idl.sequence
PRIMITIVES: dict[str, Dds] = {
    "bool": bool,
    "string": str,
    "byte": idl.uint8,
    "char": idl.uint8,
    **{name: getattr(idl, name) for name in ("int8", "int16", "int32", "int64")},
    **{name: getattr(idl, name) for name in ("uint8", "uint16", "uint32", "uint64", "float32", "float64")},
}


@cache
def sample_type(name: str) -> Dds:
    """The sample class of a ROS type such as `nav_msgs/msg/Odometry`.

    DDS describes the type to peers by the fields. A sample does not have them: it is bytes, see `sample_of`.
    """
    package, _, last = name.partition("/msg/")
    fields = {field: _field(kind) for field, kind in ros2_types().fielddefs[name][1]}
    made = types.new_class(
        f"{last}_",
        (IdlStruct,),
        {"typename": f"{package}::msg::dds_::{last}_"},
        lambda space: space.update({"__annotations__": fields, "__module__": __name__}),
    )
    sample: Dds = dataclasses.dataclass(made)
    sample.serialize = _serialize
    sample.deserialize = classmethod(_deserialize)
    return sample


def sample_of(kind: Dds, data: bytes) -> Dds:
    """A sample of a message in CDR, including the CDR header."""
    sample = object.__new__(kind)
    sample.encoded = data
    return sample


def _serialize(sample: Dds, **_: object) -> bytes:
    data: bytes = sample.encoded
    return data


def _deserialize(kind: Dds, /, data: bytes, **_: object) -> Dds:
    return sample_of(kind, bytes(data))


def _field(kind: Dds) -> Dds:
    match kind:
        case (Nodetype.BASE, (base, _)):
            return PRIMITIVES[base]
        case (Nodetype.NAME, name):
            return sample_type(name)
        case (Nodetype.ARRAY, (item, length)):
            return array[_field(item), length]
        case (Nodetype.SEQUENCE, (item, limit)):
            return sequence[_field(item), limit] if limit else sequence[_field(item)]
    raise TypeError(f"unknown kind of field: {kind!r}")
