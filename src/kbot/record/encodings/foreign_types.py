"""Checks message definitions that come from a recording or a peer, before they are used.

rosbags makes Python code of a definition and runs it. Nothing but what `read_definition` returns, and
`ShapeCheck` accepts may reach it: names are identifiers, numbers are in range, sizes are bounded.
"""

from __future__ import annotations

import math
import re
from keyword import iskeyword
from typing import TYPE_CHECKING, Any, NamedTuple

from kbot.text import KbotError

if TYPE_CHECKING:
    from rosbags.interfaces.typing import BaseDesc, Basename, FieldDesc, NameDesc, ScalarValue, Typesdict

MOST_CHARACTERS = 1 << 18
"""Of one definition with all it depends on. Those of ROS's own packages have 5,000 and their comments."""
MOST_DEPTH = 32
"""Types within types. rosbags recurses through them, and the deepest of ROS's own packages has 7."""
MOST_PARTS = 100_000
"""Fields of a message, each entry of a fixed array counted: each takes a call to read, however short the
message is. The largest of ROS's own packages has 501."""
MOST_BYTES = 1 << 26
"""Of a message's fixed part: rosbags reserves it before it looks whether the message is that long."""
LONGEST_NAME = 255
"""Characters of a type's name, a field's name or a number: the file names that ROS makes of a type have at
most 255."""

_WIDTHS = {
    **{"bool": 1, "byte": 1, "char": 1, "float32": 4, "float64": 8},
    **{f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
_ALIASES = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
    "Header": "std_msgs/msg/Header",
}
"""What ROS 1 writes without a package."""
EMPTY = "structure_needs_at_least_one_member"
"""The field that a message without fields has in ROS 2, and not in ROS 1."""

_NAME = r"[A-Za-z][A-Za-z0-9_]*"
_NAMED = re.compile(_NAME)
_BOUND = r"[0-9]{1,10}"
_FIELD = re.compile(
    rf"(?P<type>{_NAME}(?:/{_NAME}){{0,3}})(?:<=(?P<limit>{_BOUND}))?"
    rf"(?P<array>\[(?P<upto><=)?(?P<count>{_BOUND})?\])?[ \t]+(?P<name>{_NAME})[ \t]*+(?P<rest>.*)"
)
_ANNOTATIONS = re.compile(r"(?:@[a-z]+(?:[ \t]+|$))*")
_INTEGER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]{1,16}|0[bB][01]{1,64}|[0-9]{1,20})")
_REAL = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_QUOTED = re.compile(r"""('(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*")[ \t]*(?:#.*)?""")


def full_name(name: str) -> str:
    """A type as ROS 2 writes it, `std_msgs/msg/String`, however it is written."""
    package, _, rest = name.partition("/")
    return name if rest.startswith(("msg/", "srv/", "action/")) else f"{package}/msg/{rest}"


def read_definition(text: str, name: str) -> Typesdict:
    """The types that a definition in ROS's `.msg` format has, itself and those it depends on, as rosbags
    describes them. Default values are not kept.

    Raises:
        KbotError: it does not follow the grammar of ROS 1 or ROS 2; the error names the line.
    """
    if len(text) > MOST_CHARACTERS:
        raise KbotError(f"it has {len(text):,} characters; at most {MOST_CHARACTERS:,} are read")
    found: Typesdict = {}
    part = _Definition(name)
    is_after_separator = False
    for number, line in enumerate(text.split("\n"), 1):
        code = line.strip(" \t\r")
        if not code or code.startswith("#"):
            continue
        try:
            if is_after_separator:
                if not code.startswith("MSG:"):
                    raise KbotError("a line of = is followed by 'MSG: package/Type'")
                found.setdefault(part.name, part.described())
                part, is_after_separator = _Definition(code.removeprefix("MSG:").strip()), False
            elif not code.strip("="):
                is_after_separator = True
            else:
                part.read(code)
        except KbotError as error:
            raise KbotError(f"line {number}: {error}") from None
    found.setdefault(part.name, part.described())
    # rosbags names the class of a/msg/B a__msg__B
    if len({key.replace("/", "__") for key in found}) < len(found):
        raise KbotError("two of its types have names that differ only in / and __")
    return found


class _Definition:
    """One type of a text, read line by line."""

    def __init__(self, name: str) -> None:
        self.name = full_name(name)
        parts = self.name.split("/")
        if not 3 <= len(parts) <= 4 or not all(map(_NAMED.fullmatch, parts)) or len(name) > LONGEST_NAME:
            raise KbotError(f"{_shown(name)} is not the name of a type")
        self._constants: list[tuple[str, Basename, ScalarValue]] = []
        self._fields: list[tuple[str, FieldDesc]] = []
        self._names: set[str] = set()

    def described(self) -> tuple[list[tuple[str, Basename, ScalarValue]], list[tuple[str, FieldDesc]]]:
        names = [name for name, _ in self._fields]
        # rosbags gives this field, and no other, a default value
        if EMPTY in names and len(names) > 1:
            raise KbotError(f"{self.name} has {EMPTY} beside other fields")
        return self._constants, self._fields

    def read(self, code: str) -> None:
        annotations = _ANNOTATIONS.match(code)
        code = code[annotations.end() :] if annotations else code
        if not code:
            return
        found = _FIELD.fullmatch(code)
        if found is None:
            raise KbotError(f"{_shown(code)} is neither a field nor a constant")
        name, rest = found["name"], found["rest"]
        key = f"{name}_" if iskeyword(name) else name  # as rosbags calls it in Python
        if key in self._names or len(name) > LONGEST_NAME:
            raise KbotError(f"the name {_shown(name)} is used twice, or too long")
        self._names.add(key)
        if rest.startswith("="):
            self._constants.append((name, *_constant(found, rest[1:].strip())))
        elif rest and not rest.startswith("#") and code[found.start("rest") - 1] not in " \t":
            raise KbotError(f"{_shown(rest)} follows the name {name}")
        else:
            self._fields.append((name, self._kind(found)))

    def _kind(self, found: re.Match[str]) -> FieldDesc:
        from rosbags.interfaces import Nodetype  # lazy in this module: rosbags takes start-up time

        written, limit = found["type"], found["limit"]
        if limit is not None and written != "string":
            raise KbotError(f"{written} has a bound: only a string has one before its brackets")
        item: BaseDesc | NameDesc
        if written == "string" or written in _WIDTHS:
            item = Nodetype.BASE, (written, int(limit or 0))  # type: ignore[assignment]  # one of the names in rosbags' Literal
        else:
            item = Nodetype.NAME, self._reference(written)
        if not found["array"]:
            return item
        count = found["count"]
        if count is None:
            if found["upto"]:
                raise KbotError("the brackets have <= and no number")
            return Nodetype.SEQUENCE, (item, 0)
        if int(count) == 0:
            raise KbotError("an array of 0 entries is not a field")
        return (Nodetype.SEQUENCE if found["upto"] else Nodetype.ARRAY), (item, int(count))

    def _reference(self, written: str) -> str:
        """The full name of a type that a field is of; one without a package is of the same."""
        if written in _ALIASES:
            return _ALIASES[written]
        return full_name(written if "/" in written else f"{self.name.partition('/')[0]}/{written}")


def _constant(found: re.Match[str], text: str) -> tuple[Basename, ScalarValue]:
    """A constant's type and value. Raises KbotError: the value is not of that type."""
    kind = found["type"]
    if found["array"] or found["limit"] or not (kind == "string" or kind in _WIDTHS):
        raise KbotError(f"a constant is of a plain type, not of {_shown(found['type'])}")
    base: Basename = kind  # type: ignore[assignment]  # one of the names in rosbags' Literal
    if kind == "string":
        quoted = _QUOTED.fullmatch(text)
        return base, quoted[1][1:-1] if quoted else text
    text = text.partition("#")[0].strip()
    if kind == "bool" and text.lower() in ("true", "false"):
        return base, text.lower() == "true"
    if kind.startswith("float"):
        if _NOT_FINITE.fullmatch(text):
            return base, text
        if len(text) <= LONGEST_NAME and _REAL.fullmatch(text) and math.isfinite(value := float(text)):
            return base, int(text) if text.lstrip("+-").isdigit() else value
    elif _INTEGER.fullmatch(text):
        number = _integer(text)
        bits = 8 * _WIDTHS[kind]
        # ROS 1 has a signed byte and ROS 2 an unsigned one: either range is taken
        if -(1 << bits - 1) <= number < 1 << bits:
            return base, number
    raise KbotError(f"{_shown(text)} is not a value of {kind}")


def _integer(text: str) -> int:
    digits = text.lstrip("+-")
    if digits[:2].lower() in ("0x", "0b"):
        return int(text, 0)
    is_octal = len(digits) > 1 and digits[0] == "0" and not set(digits) & set("89")
    return int(text, 8 if is_octal else 10)


def _shown(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}...")


class FieldParts(NamedTuple):
    """A field's description, taken apart."""

    outer: int
    """ARRAY, SEQUENCE, or what `kind` is where it is no list."""
    kind: int
    """BASE or NAME."""
    of_type: str
    length: int
    """Of an array its length, of a sequence its bound; else 1."""


def field_parts(described: FieldDesc) -> FieldParts:
    """What rosbags keeps in nested tuples."""
    from rosbags.interfaces import Nodetype

    item: Any = described  # Any: nested tuples of rosbags
    length = 1
    if described[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        item, length = item[1]
    kind, inner = item
    return FieldParts(described[0], kind, inner if kind == Nodetype.NAME else inner[0], length)


class FieldShape(NamedTuple):
    """What a type costs: types within types, parts of a fixed message, and its fewest bytes in ROS 1."""

    depth: int
    parts: int
    size: int


class ShapeCheck:
    """Whether rosbags may make code of a type. What was found is kept: a type does not change."""

    def __init__(self, known: Typesdict) -> None:
        """`known` are those that need no check by themselves."""
        self._fields = dict(known)
        self._whole: dict[str, FieldShape] = {}
        self._partial: dict[str, FieldShape] = {}
        """Of types that may name others which are not there yet."""

    def add(self, types: Typesdict) -> None:
        """Add types; one whose name is taken is not added. They may name types that are added later.

        Raises:
            KbotError: one of them contains itself, or is too large. None is added then.
        """
        new = {name: described for name, described in types.items() if name not in self._fields}
        self._fields |= new
        try:
            for name in new:
                self._shape(name, (), self._partial, may_lack=True)
        except KbotError:
            for name in new:
                del self._fields[name]
            raise

    def accept(self, name: str) -> None:
        """Raises KbotError: the type contains itself, is too large, or names a type that is not there."""
        self._shape(name, (), self._whole, may_lack=False)

    def _shape(
        self, name: str, above: tuple[str, ...], known: dict[str, FieldShape], *, may_lack: bool
    ) -> FieldShape:
        from rosbags.interfaces import Nodetype

        if name in known:
            return known[name]
        if name in above:
            raise KbotError(f"{name} contains itself")
        if len(above) >= MOST_DEPTH:
            raise KbotError(f"{above[0]} has types within types more than {MOST_DEPTH} deep")
        if name not in self._fields:
            if not may_lack:
                raise KbotError(f"the type {name} is not defined")
            return FieldShape(1, 1, 1)
        depth, parts, size = 1, 1, 0
        for field, described in self._fields[name][1]:
            if field == EMPTY:
                continue
            outer, kind, of_type, length = field_parts(described)
            if kind == Nodetype.NAME:
                of = self._shape(of_type, (*above, name), known, may_lack=may_lack)
                if outer != Nodetype.NAME and of.size == 0:
                    raise KbotError(f"{name} has a list of {of_type}, which has no fields")
            else:
                of = FieldShape(0, 1, _WIDTHS.get(of_type, 4))  # a string's length takes 4 bytes
            depth = max(depth, 1 + of.depth)
            if outer == Nodetype.SEQUENCE:
                parts, size = parts + of.parts, size + 4
            else:
                # an array of numbers is read as one
                parts += of.parts * (1 if of_type in _WIDTHS else length)
                size += of.size * length
        if depth > MOST_DEPTH or parts > MOST_PARTS or size > MOST_BYTES:
            raise KbotError(
                f"{name} is too large: {depth} types deep, {parts:,} parts and {size:,} bytes; the limits "
                f"are {MOST_DEPTH}, {MOST_PARTS:,} and {MOST_BYTES:,}"
            )
        known[name] = FieldShape(depth, parts, size)
        return known[name]


def code_cost(types: Typesdict) -> int:
    """What it costs to make code of types, in units of 0.2 ms: rosbags writes statements for each field, more
    of them for texts and types than for numbers, and the same again for each entry of a fixed array."""
    from rosbags.interfaces import Nodetype

    cost = 0
    for constants, fields in types.values():
        cost += 5 + 2 * len(constants)
        for _, described in fields:
            outer, _, of_type, length = field_parts(described)
            if of_type in _WIDTHS:
                cost += 2
            else:
                cost += 3 * (length if outer == Nodetype.ARRAY else 1)
    return cost
