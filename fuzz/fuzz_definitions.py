"""Coverage-guided fuzzing of message definitions.

    pip install atheris
    python fuzz/fuzz_definitions.py CORPUS_FOLDER [-runs=1000000]

A definition with any text is either refused with a KbotError, or rosbags generates code from it that reads
and converts any bytes without running code from the text. tests/wire/test_foreign_types.py has the inputs
that failed.
"""

import builtins
import sys
from contextlib import suppress
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["kbot.record.encodings", "rosbags.typesys"]):
    from rosbags.serde import SerdeError

    from kbot.record.encodings.foreign_types import ShapeCheck, code_cost, read_definition
    from kbot.record.encodings.safe_store import safe_copy
    from kbot.record.encodings.types import ros1_types, ros2_types
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
        shapes.accept(NAME)
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


def one_input(data: bytes) -> None:
    """The input is a message, a vertical bar and a definition."""
    message, _, text = data.partition(b"|")
    check(text.decode(errors="replace"), message)


def main() -> None:
    setattr(builtins, TRAP, trap)
    corpus = Path(sys.argv[1])
    corpus.mkdir(exist_ok=True)
    if not any(corpus.iterdir()):
        for number, text in enumerate(SEEDS):
            (corpus / f"seed{number}").write_bytes(bytes(16) + b"|" + text.encode())
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
