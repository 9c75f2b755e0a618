"""Definitions from a recording or a peer: valid ones are read as rosbags reads them, others are refused."""

import time
from contextlib import suppress

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from kbot.record.encodings.foreign_types import EMPTY, ShapeCheck, code_cost, full_name, read_definition
from kbot.text import KbotError

NAME = "p/msg/A"
SEPARATOR = "=" * 80


@pytest.mark.parametrize("kind", [store for store in Stores if store != Stores.EMPTY])
def test_every_type_of_rosbags_is_read_from_its_definition(kind: Stores) -> None:
    store = get_typestore(kind)
    check = ShapeCheck({})
    for name in store.fielddefs:
        text, _ = store.generate_msgdef(name, ros_version=1 if kind == Stores.ROS1_NOETIC else 2)
        found = read_definition(text, name)
        for key, (constants, fields) in found.items():
            shipped, of_ros = store.fielddefs[key][:2]
            assert constants == shipped
            assert fields == [field for field in of_ros if field[0] != EMPTY]
        check.add(found)
    for name in store.fielddefs:
        check.accept(name, is_ros1=True)


def test_definition_is_read_as_rosbags_reads_it() -> None:
    store = get_typestore(Stores.LATEST)
    for name in list(store.fielddefs)[::8]:
        text, _ = store.generate_msgdef(name, ros_version=2)
        assert read_definition(text, name) == get_types_from_msg(text, name)


def test_definitions_written_by_ros_are_read() -> None:
    """Each line follows wiki.ros.org/msg and the interface definitions of ROS 2."""
    text = "\r\n".join(
        [
            "# a comment",
            "uint8 RED=0x10      # in hexadecimal",
            "int8 LOW = -128",
            "byte HIGH=255",
            "float64 PI=3.25e0",
            "float32 NOTHING=nan",
            "bool ON=true",
            'string HELLO="it is # quoted"  # a comment',
            "string PLAIN=everything # up to the end",
            "string DIGITS=1.10",
            "int32 lower_case=7",
            "",
            "Header header",
            "time stamp",
            "Other[2] two",
            "other_msgs/Other[<=3] three",
            "other_msgs/msg/Other one",
            "string<=5[] words",
            "int32[] numbers [1, 2, 3]",
            'string word "a default"',
            "float64 class 1.5",
            "@optional float32 maybe",
        ]
    )
    constants, fields = read_definition(text, "p/A")[NAME]
    assert {name: value for name, _, value in constants} == {
        "RED": 16,
        "LOW": -128,
        "HIGH": 255,
        "PI": 3.25,
        "NOTHING": "nan",
        "ON": True,
        "HELLO": "it is # quoted",
        "PLAIN": "everything # up to the end",
        "DIGITS": "1.10",
        "lower_case": 7,
    }
    base, name, array, sequence = 1, 2, 3, 4
    assert dict(fields) == {
        "header": (name, "std_msgs/msg/Header"),
        "stamp": (name, "builtin_interfaces/msg/Time"),
        "two": (array, ((name, "p/msg/Other"), 2)),
        "three": (sequence, ((name, "other_msgs/msg/Other"), 3)),
        "one": (name, "other_msgs/msg/Other"),
        "words": (sequence, ((base, ("string", 5)), 0)),
        "numbers": (sequence, ((base, ("int32", 0)), 0)),
        "word": (base, ("string", 0)),
        "class": (base, ("float64", 0)),
        "maybe": (base, ("float32", 0)),
    }


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("float64 X=1e999", "line 1: '1e999' is not a value of float64"),
        (f"int32 X={'9' * 5000}", "line 1: '9999"),
        (f"float64 X={'9' * 5000}", "line 1: '9999"),
        (f"int32 X=0x{'f' * 5000}", "is not a value of int32"),
        ("uint8 X=256", "'256' is not a value of uint8"),
        ("int32 X=1.5", "'1.5' is not a value of int32"),
        ("int32 X=", "'' is not a value of int32"),
        ("int32 X=__import__('os')", "is not a value of int32"),
        ("A X=1", "a constant cannot have the type"),
        ("int32[2] X=1", "a constant cannot have the type"),
        ("int32 a\nint32 a", "line 2: the name 'a' is used twice"),
        ("int32 class\nint32 class_", "line 2: the name 'class_' is used twice"),
        ("int32 a\nint32 a=1", "line 2: the name 'a' is used twice"),
        ("int32 __class__", "is neither a field nor a constant"),
        ("int32 _a", "is neither a field nor a constant"),
        ("int32 1a", "is neither a field nor a constant"),
        ("int32 a-b", "unexpected '-b' after the name a"),
        ("int32 a;b", "unexpected ';b' after the name a"),
        ("int32 ä", "is neither a field nor a constant"),
        ("int32", "is neither a field nor a constant"),
        ("int32[a] b", "is neither a field nor a constant"),
        ("int32[-1] b", "is neither a field nor a constant"),
        ("int32[0] b", "an array must have at least one entry"),
        ("int32[<=] b", "<= in the brackets needs a number"),
        ("int32<=5 b", "int32 has a bound"),
        ("int32[99999999999] b", "is neither a field nor a constant"),
        ('p/A") or x("[2] b', "is neither a field nor a constant"),
        (f"{SEPARATOR}\nint32 a", "line 2: expected 'MSG: package/Type'"),
        (f"{SEPARATOR}\nMSG: 1a/B\nint32 a", "line 2: '1a/B' is not a valid type name"),
        (f"{SEPARATOR}\nMSG: a/'''\nint32 a", "is not a valid type name"),
        (f"{SEPARATOR}\nMSG: a/msg/b__c\n{SEPARATOR}\nMSG: a/msg/b/c\n", "differ only in / and __"),
        ("uint8 structure_needs_at_least_one_member\nuint8 a", "has other fields besides"),
        ("#" * (1 << 18) + "#", "it has 262,145 characters"),
        (f"int32 {'a' * 256}", "too long"),
    ],
)
def test_syntax_error_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(KbotError, match=r"^[^\n]*$") as caught:
        read_definition(text, NAME)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    "name",
    [
        "1a/msg/T",
        "a",
        "",
        "/a/T",
        "a//T",
        "a/msg/T/b/c",
        "a/T\n",
        "a b/T",
        "a/msg/T'''",
        "a/" + "T" * 255,
        "ä/T",
    ],
)
def test_invalid_type_name_is_refused(name: str) -> None:
    with pytest.raises(KbotError, match="is not a valid type name"):
        read_definition("int32 a", name)


@pytest.mark.parametrize(
    ("definitions", "words"),
    [
        ({"p/msg/A": "A a"}, "p/msg/A contains itself"),
        ({"p/msg/A": f"B a\n{SEPARATOR}\nMSG: p/B\nA[] b"}, "contains itself"),
        ({"p/msg/A": "B[] a", "p/msg/B": "A a"}, "contains itself"),
        ({"p/msg/A": "string[100000000] a"}, "p/msg/A is too large"),
        ({"p/msg/A": "uint8[100000000] a"}, "p/msg/A is too large"),
        ({"p/msg/C": "C1[1000] a", "p/msg/C1": "C2[1000] a", "p/msg/C2": "float64[1000] a"}, "is too large"),
        ({f"p/msg/D{n}": f"D{n + 1} a\nD{n + 1} b" for n in range(40)}, "is too large|more than 32 levels"),
        ({f"p/msg/E{n}": f"E{n + 1} a" for n in range(40)} | {"p/msg/E40": "int8 a"}, "more than 32 levels"),
        ({"p/msg/F": "std_msgs/Empty[] a"}, "p/msg/F has a list of messages without fields"),
        (
            {"p/msg/F": "G[] a", "p/msg/G": "H a", "p/msg/H": "int8 X=1"},
            "p/msg/F has a list of messages without",
        ),
        ({"p/msg/I": "Unknown a"}, "the type p/msg/Unknown is not defined"),
    ],
)
def test_type_that_is_too_large_is_refused(definitions: dict[str, str], words: str) -> None:
    check = ShapeCheck(get_typestore(Stores.ROS2_JAZZY).fielddefs)

    def use_first() -> None:
        for name, text in definitions.items():
            check.add(read_definition(text, name))
        check.accept(next(iter(definitions)), is_ros1=True)

    with pytest.raises(KbotError, match=words):
        use_first()


@pytest.mark.parametrize("text", ["\n", "a", "string X='\n", "@a ", " ", "string a\n", "=" * 80 + "\n"])
def test_longest_definition_is_read_quickly(text: str) -> None:
    begun = time.process_time()
    with suppress(KbotError):
        read_definition(text * ((1 << 18) // len(text)), NAME)
    assert time.process_time() - begun < 5.0  # an algorithm of quadratic time would take minutes


def test_every_entry_of_a_string_array_costs_code() -> None:
    assert code_cost(read_definition("float64[1000] a\nfloat64[] b", NAME)) == 5 + 2 * 2
    assert code_cost(read_definition("string[1000] a\nA[] b", NAME)) == 5 + 3 * 1001


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("std_msgs/String", "std_msgs/msg/String"),
        ("std_msgs/msg/String", "std_msgs/msg/String"),
        ("nav2_msgs/action/Spin_FeedbackMessage", "nav2_msgs/action/Spin_FeedbackMessage"),
        ("a/srv/B_Event", "a/srv/B_Event"),
    ],
)
def test_full_names(name: str, full: str) -> None:
    assert full_name(name) == full
