"""Parses XML with exact positions, using the standard library's expat."""

from __future__ import annotations

from xml.parsers import expat

from kbot.text.errors import DescriptionError
from kbot.text.prefixes import Prefixes, fault
from kbot.text.span import Source
from kbot.text.xml_nodes import CData, Comment, Element, Instruction, Text, XmlDocument, markup_end

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from kbot.text.diagnostic import Diagnostic

__all__ = ["CData", "Comment", "Element", "Instruction", "Text", "XmlDocument", "parse_document", "parse_xml"]

MAX_NESTING = 1000
"""Levels of elements in xacro files."""
MAX_READ_NESTING = 100
"""Levels of elements in files that are not expanded, such as launch files. Their readers recurse."""
MAX_NODES = 2_000_000
"""Elements and comments of a file."""

_SPECIAL = (b"$", b"xacro", b"&#")
_MOST_SPECIALS = 1_000_000
"""Offsets in the list of `_specials`. A longer list takes more memory than the tree. Real files have a few
hundred."""


def parse_xml(source: Source) -> Element:
    """Parse a source and return its root element.

    Raises:
        DescriptionError: P001 not well-formed, P002 empty, P003 a document type with entities,
            P004 a name prefix that is not declared, P005 nested too deeply.
    """
    document = parse_document(source, MAX_READ_NESTING)
    if document.diagnostics:
        raise DescriptionError(document.diagnostics)
    return document.root


def parse_document(
    source: Source, max_nesting: int = MAX_NESTING, max_nodes: int = MAX_NODES, *, lenient: bool = False
) -> XmlDocument:
    """Parse a source into a document with all its nodes.

    An undeclared prefix (P004) becomes a diagnostic of the document, which is still usable. If `lenient`, it
    is a warning, and so is what ROS and Gazebo read although it is not well-formed (P007).

    Raises:
        DescriptionError: P001 not well-formed, P002 empty, P003 a document type with entities,
            P005 nested too deeply, P006 too many elements and comments.
    """
    if not source.text.strip():
        raise _error(
            source,
            "P002",
            "the file is empty",
            0,
            "a robot starts with <robot name='…'>, a launch file with <launch>",
        )
    data = source.data
    warnings: list[Diagnostic] = []
    while True:
        document = XmlDocument(source)
        parser = expat.ParserCreate("UTF-8")
        parser.buffer_text = True
        parser.buffer_size = 1 << 16
        problems, opened = _handle(parser, document, max_nesting, max_nodes)
        try:
            parser.Parse(data, True)
            break
        except expat.ExpatError as error:
            # only for an error: start-up time
            from kbot.text.lenient import as_warning, repaired
            from kbot.text.malformed import malformed

            offset, reason = parser.ErrorByteIndex, expat.ErrorString(error.code)
            problem = malformed(source, offset, reason.removeprefix("not well-formed ").strip("()"), opened)
            after_root = hasattr(document, "root") and not opened
            changed = repaired(data, offset, reason, after_root) if lenient else None
            if changed is None:
                raise DescriptionError([problem]) from None
            data = changed  # each repair removes all faults of its kind, so there are few
            warnings.append(as_warning(problem))
    if lenient and problems:
        from kbot.text.lenient import as_warning

        problems = list(map(as_warning, problems))
    document.diagnostics = (*warnings, *problems)
    return document


def _error(source: Source, code: str, message: str, offset: int, hint: str = "") -> DescriptionError:
    return DescriptionError([fault(source, code, message, offset, offset + 1, hint)])


def _specials(data: bytes) -> list[int]:
    """The offsets of everything that xacro may have to expand, last first, after an offset beyond the end.

    Empty if there are too many.
    """
    if sum(map(data.count, _SPECIAL)) > _MOST_SPECIALS:
        return []
    found = [len(data) + 1]
    for special in _SPECIAL:
        at = data.find(special)
        while at >= 0:
            found.append(at)
            at = data.find(special, at + 1)
    found.sort(reverse=True)
    return found


def _handle(
    parser: expat.XMLParserType, document: XmlDocument, max_nesting: int, max_nodes: int
) -> tuple[list[Diagnostic], list[Element]]:
    """Set the parser's handlers, which build the document. They are closures for speed.

    Returns the list of problems and the list of open elements. The handlers update both while parsing.
    """
    source = document.source
    stack: list[Element] = []
    children: list[Element | Text] = []
    outer: list[list[Element | Text]] = []
    previous = 0
    in_cdata = fresh = False
    specials = _specials(source.data)
    # if there are too many, every element is treated as special
    passed, special = (-1, specials.pop()) if specials else (len(source.data), len(source.data) + 1)
    subset_at = -1
    nodes = depth = 0
    blanks: dict[str, Text] = {}
    prefixes = Prefixes(source)
    known_tags, known_names = prefixes.tags, prefixes.names

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal children, previous, fresh, nodes, depth
        previous = at = parser.CurrentByteIndex
        fresh = True
        nodes += 1
        if nodes > max_nodes:
            raise _error(source, "P006", f"there are more than {max_nodes:,} elements and comments", at)
        if tag not in known_tags or not known_names.issuperset(attributes):
            prefixes.check(tag, attributes, at, stack)
        element = Element(tag, attributes, source, at)
        if stack:
            children.append(element)
        else:
            document.root = element
        stack.append(element)
        outer.append(children)
        children = element.children
        if len(stack) > depth:
            depth = len(stack)
            if depth > max_nesting:
                raise _error(source, "P005", f"elements are nested more than {max_nesting} deep", at)

    def end(tag: str) -> None:
        nonlocal children, previous, fresh, passed, special
        fresh = True
        previous = at = parser.CurrentByteIndex
        while special < at:
            passed, special = special, specials.pop()
        element = stack.pop()
        element._close = at
        element.is_plain = passed < element.start
        children = outer.pop()
        if not stack:
            document.nodes, document.depth = nodes, depth

    def text(value: str) -> None:
        nonlocal fresh
        if not stack:
            return
        if fresh:
            fresh = False
            if not in_cdata:
                # the position of a blank is never needed, so equal blanks share a node
                blank = blanks.get(value)
                if blank is None and len(value) < 40 and value.isspace():
                    blank = blanks[value] = Text(value, source, previous, parser.CurrentByteIndex)
                if blank is not None:
                    children.append(blank)
                    return
            kind = CData if in_cdata else Text
            children.append(kind(value, source, previous, parser.CurrentByteIndex))
        else:  # the parser's buffer was full
            at = parser.CurrentByteIndex
            last = children[-1]
            children[-1] = (CData if in_cdata else Text)(
                last.value + value if isinstance(last, Text) else value, source, previous, at
            )

    def cdata(entering: bool) -> Callable[[], None]:
        def toggle() -> None:
            nonlocal in_cdata, previous, fresh
            in_cdata, fresh = entering, True
            previous = parser.CurrentByteIndex
            if not entering and children and type(children[-1]) is CData:
                children[-1].end = previous + 3

        return toggle

    def aside(node: Text) -> None:
        nonlocal previous, fresh, nodes
        previous, fresh = parser.CurrentByteIndex, True
        nodes += 1
        if nodes > max_nodes:
            raise _error(source, "P006", f"there are more than {max_nodes:,} elements and comments", previous)
        place = children if stack else (document.after if hasattr(document, "root") else document.before)
        place.append(node)

    def comment(value: str) -> None:
        at = parser.CurrentByteIndex
        aside(Comment(value, source, at, markup_end(source.data, at)))

    def instruction(target: str, value: str) -> None:
        at = parser.CurrentByteIndex
        aside(Instruction(f"?{target} {value}?", source, at, markup_end(source.data, at)))

    def doctype(name: str, system: str | None, public: str | None, subset: bool) -> None:
        nonlocal subset_at
        at = max(source.data.rfind(b"<!DOCTYPE", 0, parser.CurrentByteIndex + 1), 0)
        if subset:
            subset_at = at
            return
        value = f"!DOCTYPE {name}"
        if public:
            value += f"\n  PUBLIC '{public}'\n  '{system}'"
        elif system:
            value += f"\n  SYSTEM '{system}'"
        aside(Instruction(value, source, at, markup_end(source.data, at)))

    def doctype_end() -> None:
        if subset_at >= 0:
            message = "a document type with internal declarations is not allowed"
            raise _error(source, "P003", message, subset_at, "write the text itself, or use a xacro property")

    def entity(name: str, *_: object) -> None:
        message = f"the entity '{name}' is declared, but entity declarations are not allowed"
        hint = "write the text itself, or use a xacro property"
        at = source.data.rfind(b"<!ENTITY", 0, parser.CurrentByteIndex + 1)
        raise _error(source, "P003", message, max(at, 0), hint)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.CommentHandler = comment
    parser.ProcessingInstructionHandler = instruction
    parser.StartCdataSectionHandler = cdata(True)
    parser.EndCdataSectionHandler = cdata(False)
    parser.StartDoctypeDeclHandler = doctype
    parser.EndDoctypeDeclHandler = doctype_end
    parser.EntityDeclHandler = entity
    return prefixes.problems, stack
