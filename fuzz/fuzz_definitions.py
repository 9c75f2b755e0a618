"""Fuzzes message definitions.

A definition with any text is either refused with a KbotError, or rosbags generates code from it that reads
and converts any bytes without running code from the text. tests/wire/test_foreign_types.py has the inputs
that failed.
"""

import builtins
from contextlib import suppress

from choices import Choices
from edits import edited
from rosbags.serde import SerdeError

from kbot.record.encodings.foreign_types import ShapeCheck, code_cost, read_definition
from kbot.record.encodings.safe_store import safe_copy
from kbot.record.encodings.type_names import NAMESAKES
from kbot.record.encodings.types import ros1_types, ros2_definition, ros2_types
from kbot.text import KbotError

NAME = "own_msgs/msg/T"
TRAP = "trap"
MOST_CODE = 500
SEEDS = [
    "int32 A=1\nstring B='x' # y\nfloat64 C=1.5e3\nbool D=true\nbyte E=0x1f\n",
    "string<=5[<=3] a\nfloat32[4] b [1, 2, 3, 4]\nU u\ntime t\nHeader h\n"
    + "=" * 80
    + "\nMSG: own_msgs/U\nint8 a",
    "std_msgs/String[] s\ngeometry_msgs/msg/Point[2] p\nuint8[] q\nstring class 'a'\nint64 trap=trap()",
]


USED = [f"{package}/msg/{name}" for package, names in NAMESAKES.items() for name in names.split()]
"""The messages that KBot uses."""
DEFINITIONS = [text.encode() for text in (*SEEDS, *(ros2_definition(name)[0] for name in USED))]
WORDS = [
    b"string", b"wstring", b"time", b"duration", b"Header", b"byte", b"char", b"<=5", b"[<=3]", b"[]", b"[2]",
    b"=", b"# c", b"\n", b"'", b'"', b"MSG: own_msgs/U\n", b"=" * 80 + b"\n", b"trap()", b"---\n", b"__",
    b"\\",
]  # fmt: skip


def trap(*_: object, **__: object) -> None:
    raise AssertionError("code from a definition was run")


def check(text: str, data: bytes) -> None:
    """Use a definition in the same way as one from a recording."""
    try:
        found = read_definition(text, NAME)
        shapes = ShapeCheck(ros2_types().fielddefs)
        shapes.add(found)
        if code_cost(found) > MOST_CODE:
            return
        shapes.accept(NAME, is_ros1=True)
    except KbotError as refusal:
        if "\n" in str(refusal):
            raise AssertionError("the error has two lines") from refusal
        return
    for known in (ros1_types(), ros2_types()):
        store = safe_copy(known)
        store.register({key: value for key, value in found.items() if key not in store.fielddefs})
        text, _ = store.generate_msgdef(NAME)
        assert read_definition(text, NAME)[NAME][1] == [
            field for field in store.fielddefs[NAME][1] if field[0] != "structure_needs_at_least_one_member"
        ]
        for use in (store.deserialize_cdr, store.deserialize_ros1, store.ros1_to_cdr, store.cdr_to_ros1):
            for message in (data, b"\0\1\0\0" + data):
                with suppress(SerdeError, LookupError, ValueError):
                    use(message, NAME)


def one_input(choices: Choices) -> None:
    text = edited(choices, DEFINITIONS, WORDS).decode(errors="replace")
    check(text, choices.raw(200))


setattr(builtins, TRAP, trap)
TARGETS = {"definitions": one_input}
