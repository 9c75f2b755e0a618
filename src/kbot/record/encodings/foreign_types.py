"""Checks message definitions that come from a recording or a peer, before they are used.

The rosbags library generates Python code from a definition and runs it. It must therefore get only what
`read_definition` returns and `ShapeCheck` accepts: names are identifiers, numbers are in range, sizes are
bounded.
"""

from __future__ import annotations

import math
import re
from keyword import iskeyword
from typing import TYPE_CHECKING, Any, NamedTuple

from kbot.record.limits import LONGEST_NAME
from kbot.text import KbotError

if TYPE_CHECKING:
    from rosbags.interfaces.typing import BaseDesc, Basename, FieldDesc, NameDesc, ScalarValue, Typesdict

MOST_CHARACTERS = 1 << 18
"""Characters of a definition with all its dependencies. Those of ROS's own packages have up to 5,000 without
comments."""
MOST_DEPTH = 32
"""Levels of nested types. rosbags recurses through them. ROS's own packages have up to 7 levels."""
MOST_PARTS = 100_000
"""Fields of a message, including each entry of a fixed array. Reading each takes a call, even in a short
message. The largest message of ROS's own packages has 501."""
MOST_BYTES = 1 << 26
"""Bytes of the fixed part of a message. rosbags allocates them before it checks the length of the message."""

_WIDTHS = {
    **{"bool": 1, "byte": 1, "char": 1, "float32": 4, "float64": 8},
    **{f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
_ALIASES = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
    "Header": "std_msgs/msg/Header",
}
"""Types that ROS 1 writes without a package."""
EMPTY = "structure_needs_at_least_one_member"
"""The dummy field that ROS 2, but not ROS 1, adds to a message without fields."""

EVENT = "_Event"
"""The end of the type of what ROS 2 publishes about a service: `std_srvs/srv/Empty_Event`."""

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
    """A type name as ROS 2 writes it: `std_msgs/msg/String`."""
    package, _, rest = name.partition("/")
    return name if rest.startswith(("msg/", "srv/", "action/")) else f"{package}/msg/{rest}"


def read_definition(text: str, name: str) -> Typesdict:
    """Parse a definition in ROS's `.msg` format: the type and its dependencies, as rosbags describes them.

    The definition of a service, in the `.srv` format, gives the types of its request, response and event.
    Default values are dropped.

    Raises:
        KbotError: it does not follow the grammar of ROS 1 or ROS 2. The error names the line.
    """
    if len(text) > MOST_CHARACTERS:
        raise KbotError(f"it has {len(text):,} characters (limit: {MOST_CHARACTERS:,})")
    found: Typesdict = {}
    service = ""
    part = _Definition(name)
    is_after_separator = False
    for number, line in enumerate(text.split("\n"), 1):
        code = line.strip(" \t\r")
        if not code or code.startswith("#"):
            continue
        try:
            if is_after_separator:
                if not code.startswith("MSG:"):
                    raise KbotError("expected 'MSG: package/Type' after a line of =")
                found.setdefault(part.name, part.described())
                part, is_after_separator = _Definition(code.removeprefix("MSG:").strip()), False
            elif not code.strip("="):
                is_after_separator = True
            elif code == "---" and "/srv/" in name and not service:
                service = name.removesuffix(EVENT)
                found[f"{service}_Request"] = part.described()
                part = _Definition(f"{service}_Response")
            else:
                part.read(code)
        except KbotError as error:
            raise KbotError(f"line {number}: {error}") from None
    found.setdefault(part.name, part.described())
    if service:
        found[f"{service}{EVENT}"] = _event(service)
    # rosbags generates the class name a__msg__B from a/msg/B
    if len({key.replace("/", "__") for key in found}) < len(found):
        raise KbotError("the names of two types differ only in / and __")
    return found


def _event(service: str) -> tuple[list[tuple[str, Basename, ScalarValue]], list[tuple[str, FieldDesc]]]:
    """What ROS 2 publishes about each call of a service: at most one request and one response."""
    from rosbags.interfaces import Nodetype

    def at_most_one(part: str) -> FieldDesc:
        return Nodetype.SEQUENCE, ((Nodetype.NAME, f"{service}_{part}"), 1)

    return [], [
        ("info", (Nodetype.NAME, "service_msgs/msg/ServiceEventInfo")),
        ("request", at_most_one("Request")),
        ("response", at_most_one("Response")),
    ]


class _Definition:
    """One type of a definition, parsed line by line."""

    def __init__(self, name: str) -> None:
        self.name = full_name(name)
        parts = self.name.split("/")
        if not 3 <= len(parts) <= 4 or not all(map(_NAMED.fullmatch, parts)) or len(name) > LONGEST_NAME:
            raise KbotError(f"{_shown(name)} is not a valid type name")
        self._constants: list[tuple[str, Basename, ScalarValue]] = []
        self._fields: list[tuple[str, FieldDesc]] = []
        self._names: set[str] = set()

    def described(self) -> tuple[list[tuple[str, Basename, ScalarValue]], list[tuple[str, FieldDesc]]]:
        names = [name for name, _ in self._fields]
        # rosbags gives only this field a default value
        if EMPTY in names and len(names) > 1:
            raise KbotError(f"{self.name} has other fields besides {EMPTY}")
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
        key = f"{name}_" if iskeyword(name) else name  # the name that rosbags uses in Python
        if key in self._names or len(name) > LONGEST_NAME:
            raise KbotError(f"the name {_shown(name)} is used twice or is too long")
        self._names.add(key)
        if rest.startswith("="):
            self._constants.append((name, *_constant(found, rest[1:].strip())))
        elif rest and not rest.startswith("#") and code[found.start("rest") - 1] not in " \t":
            raise KbotError(f"unexpected {_shown(rest)} after the name {name}")
        else:
            self._fields.append((name, self._kind(found)))

    def _kind(self, found: re.Match[str]) -> FieldDesc:
        from rosbags.interfaces import Nodetype  # imported lazily: rosbags is slow to import

        written, limit = found["type"], found["limit"]
        if limit is not None and written != "string":
            raise KbotError(f"{written} has a bound, but only a string can have one")
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
                raise KbotError("<= in the brackets needs a number")
            return Nodetype.SEQUENCE, (item, 0)
        if int(count) == 0:
            raise KbotError("an array must have at least one entry")
        return (Nodetype.SEQUENCE if found["upto"] else Nodetype.ARRAY), (item, int(count))

    def _reference(self, written: str) -> str:
        """The full name of a field's type. Without a package, it is a type of the same package."""
        if written in _ALIASES:
            return _ALIASES[written]
        return full_name(written if "/" in written else f"{self.name.partition('/')[0]}/{written}")


def _constant(found: re.Match[str], text: str) -> tuple[Basename, ScalarValue]:
    """The type and value of a constant. Raises KbotError: the value is not of that type."""
    kind = found["type"]
    if found["array"] or found["limit"] or not (kind == "string" or kind in _WIDTHS):
        raise KbotError(f"a constant cannot have the type {_shown(found['type'])}")
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
        # byte is signed in ROS 1 and unsigned in ROS 2: both ranges are accepted
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
    """The parts of a field's description."""

    outer: int
    """ARRAY or SEQUENCE. The same as `kind` if the field is not a list."""
    kind: int
    """BASE or NAME."""
    of_type: str
    length: int
    """The length of an array or the bound of a sequence, else 1."""


def field_parts(described: FieldDesc) -> FieldParts:
    """Take apart the nested tuples that describe a field in rosbags."""
    from rosbags.interfaces import Nodetype

    item: Any = described  # Any: nested tuples of rosbags
    length = 1
    if described[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        item, length = item[1]
    kind, inner = item
    return FieldParts(described[0], kind, inner if kind == Nodetype.NAME else inner[0], length)


class FieldShape(NamedTuple):
    """The cost of a type: levels of nested types, number of fixed parts, and minimum size in ROS 1 in
    bytes.

    `endless` names a part of the type with a list of messages without fields. In ROS 1 such a list takes no
    bytes, so the length of a message does not bound it.
    """

    depth: int
    parts: int
    size: int
    endless: str = ""


class ShapeCheck:
    """Checks whether rosbags may generate code for a type. Results are cached: a type does not change."""

    def __init__(self, known: Typesdict) -> None:
        """`known` are trusted types."""
        self._fields = dict(known)
        self._whole: dict[str, FieldShape] = {}
        self._partial: dict[str, FieldShape] = {}
        """Shapes of types that may refer to types that are not added yet."""

    def add(self, types: Typesdict) -> None:
        """Add types. A known name is not changed. Types may refer to types that are added later.

        Raises:
            KbotError: a type contains itself, or is too large. Then no type is added.
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

    def accept(self, name: str, *, is_ros1: bool) -> None:
        """Check a type.

        Raises:
            KbotError: it contains itself, is too large, refers to an unknown type, or ROS 1 cannot bound it.
        """
        endless = self._shape(name, (), self._whole, may_lack=False).endless
        if endless and is_ros1:
            raise KbotError(f"{endless} has a list of messages without fields, which ROS 1 cannot bound")

    def _shape(
        self, name: str, above: tuple[str, ...], known: dict[str, FieldShape], *, may_lack: bool
    ) -> FieldShape:
        from rosbags.interfaces import Nodetype

        if name in known:
            return known[name]
        if name in above:
            raise KbotError(f"{name} contains itself")
        if len(above) >= MOST_DEPTH:
            raise KbotError(f"{above[0]} has more than {MOST_DEPTH} levels of nested types")
        if name not in self._fields:
            if not may_lack:
                raise KbotError(f"the type {name} is not defined")
            return FieldShape(1, 1, 1)
        depth, parts, size, endless = 1, 1, 0, ""
        for field, described in self._fields[name][1]:
            if field == EMPTY:
                continue
            outer, kind, of_type, length = field_parts(described)
            if kind == Nodetype.NAME:
                of = self._shape(of_type, (*above, name), known, may_lack=may_lack)
                endless = endless or (name if outer == Nodetype.SEQUENCE and of.size == 0 else of.endless)
            else:
                of = FieldShape(0, 1, _WIDTHS.get(of_type, 4))  # a string's length takes 4 bytes
            depth = max(depth, 1 + of.depth)
            if outer == Nodetype.SEQUENCE:
                parts, size = parts + of.parts, size + 4
            else:
                # an array of numbers is read in one call
                parts += of.parts * (1 if of_type in _WIDTHS else length)
                size += of.size * length
        if depth > MOST_DEPTH or parts > MOST_PARTS or size > MOST_BYTES:
            raise KbotError(
                f"{name} is too large: {depth} levels, {parts:,} parts and {size:,} bytes (limits: "
                f"{MOST_DEPTH}, {MOST_PARTS:,} and {MOST_BYTES:,})"
            )
        known[name] = FieldShape(depth, parts, size, endless)
        return known[name]


def code_cost(types: Typesdict) -> int:
    """The cost of generating code for types, in units of 0.2 ms.

    rosbags writes statements for each field, more for strings and nested types than for numbers, and again
    for each entry of a fixed array.
    """
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
