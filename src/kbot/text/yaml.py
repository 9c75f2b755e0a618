"""Reads YAML: plain data of limited size, with the position of each value.

YAML means what PyYAML reads: version 1.1, one document per text. KBot uses PyYAML's loader in C if there is
one. A text that LibYAML rejects is read again in Python, which accepts more (`{a:{b: 1}}`) and has better
error messages. PyYAML takes 20 ms to import, so it is imported at the first use. This module has no
dataclasses: importing them would make `kbot expand` of a description with parameter files slower.
"""

from __future__ import annotations

from functools import cached_property

from kbot.text.span import Source, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Iterator, Mapping
    from typing import Any

    import yaml

Keys = tuple[str, ...]
"""The path to a value from the root: keys of mappings as texts, and indexes of list items."""
CONSTRUCTION_ERRORS = ValueError, LookupError, TypeError, AttributeError, ArithmeticError
"""Errors that PyYAML raises for a text that does not fit its tag, as in `!!int ''` and `2020-13-45`."""
TOO_LARGE = "a number is too large"
LARGEST_BITS = 1023
"""Bits of the largest integer: the largest that a float can hold."""
LONGEST = 2 * LARGEST_BITS
"""Characters of the longest integer. It may be written in binary."""
MOST_VALUES = 200_000
"""Values of a document, with each alias counted as the values it stands for: ten lines can stand for a
billion. Constructing a value takes about 5 microseconds. Robots' files have a few thousand values."""
MOST_LEVELS = 100
"""Levels of nested lists and mappings. PyYAML's loaders in C recurse for each level. 10,000 levels overflow
the stack, which kills the process. Their parser's time grows with the square of the levels. Robots' files
have at most 10."""
_TOO_DEEP = f"it is nested more than {MOST_LEVELS} levels deep"
_TOO_DEEP_IN_C = "exceeded maximum nesting depth"
"""LibYAML's message since 0.2.6 for more than 1,000 levels. It comes before the first event."""
OWN_HASH = (1 << 61) - 1
"""A smaller integer is its own hash. Larger ones can be chosen so that they share one hash. As keys, each is
then compared with all previous ones."""
MOST_LARGE_KEYS = 100
"""Keys of a mapping that are integers from OWN_HASH on. Comparing all of them takes 0.1 ms."""


class YamlError(ValueError):
    """The text is not YAML, or exceeds a limit.

    `problem` is the error without its place. `span` is the place, or the whole text if the place is unknown.
    `str` gives both.
    """

    def __init__(self, problem: str, span: Span) -> None:
        self.problem, self.span = problem, span
        place = f" (line {span.line}, column {span.column})" if span != span.source.whole() else ""
        super().__init__(f"{problem}{place}")


class Dialect:
    """How scalars are read.

    `units` are functions of a scalar's text, by tag (`!degrees`). They raise ValueError for a text that they
    do not accept. `patterns` are regular expressions by tag: plain scalars that match have this tag
    implicitly. With `as_text`, all scalars are texts, and there are no units.
    """

    def __init__(
        self,
        units: Mapping[str, Callable[[str], float]] | None = None,
        patterns: Mapping[str, re.Pattern[str]] | None = None,
        *,
        as_text: bool = False,
    ) -> None:
        self.units = units or {}
        self.patterns = patterns or {}
        self.as_text = as_text

    @cached_property
    def loaders(self) -> tuple[Any, Any]:
        """PyYAML's loaders for this dialect, in C and in Python, with limits."""
        import yaml  # imported lazily, for a fast start-up

        kind = "BaseLoader" if self.as_text else "SafeLoader"
        in_python = getattr(yaml, kind)
        return _loader(self, getattr(yaml, f"C{kind}", in_python)), _loader(self, in_python)


PLAIN = Dialect()
TEXT = Dialect(as_text=True)
"""For files whose reader decides the type of each scalar. Merge keys (`<<`) are texts too."""


class YamlPlace:
    """The spans of a value and its key. List items and the root have no key. Do not change an instance."""

    __slots__ = ("key", "value")

    def __init__(self, key: Span | None, value: Span) -> None:
        self.key = key
        self.value = value


class YamlDocument:
    """A YAML document. Do not change an instance."""

    def __init__(self, source: Source, data: Any, root: Any, constructed: Mapping[Any, Any]) -> None:  # noqa: ANN401
        self.source = source
        self.data = data
        """Mappings, lists and scalars. None for an empty text."""
        self._root = root
        self._constructed = constructed
        """The value of each node of PyYAML's tree."""
        self._parts: dict[int, dict[str, tuple[Any, Any]]] = {}

    def place(self, *keys: str) -> YamlPlace | None:
        """The place of the value at `keys`, or None if there is no such value.

        The place of an alias's value is its anchor.
        """
        nodes = self._nodes(keys)
        if len(nodes) <= len(keys):
            return None
        key, value = nodes[-1]
        return YamlPlace(None if key is None else self._span(key), self._span(value))

    def span(self, *keys: str) -> Span:
        """The span of the last key or list item. If there is no such value, of the nearest value above."""
        nodes = self._nodes(keys)
        if not nodes:
            return self.source.whole()
        key, value = nodes[-1]
        return self._span(value if key is None else key)

    def repeated_keys(self) -> Iterator[Span]:
        """The keys that their mapping already has. PyYAML keeps the last value of each."""
        waiting, seen = [self._root] if self._root is not None else [], set[int]()
        while waiting:
            node = waiting.pop()
            if id(node) in seen or not isinstance(node.value, list):
                continue
            seen.add(id(node))
            keys = set[str]()
            for part in node.value:
                key, value = part if isinstance(part, tuple) else (None, part)
                waiting.append(value)
                # merge keys (<<) put keys of other mappings first, and those may be replaced
                if key is None or _position(key.start_mark) < _position(node.start_mark):
                    continue
                name = str(self._constructed[key])
                if name in keys:
                    yield self._span(key)
                keys.add(name)

    def _nodes(self, keys: Keys) -> list[tuple[Any, Any]]:
        """The nodes of keys and values from the root to the last existing one of `keys`."""
        if self._root is None:
            return []
        found = [(None, self._root)]
        for key in keys:
            below = self._below(found[-1][1]).get(key)
            if below is None:
                break
            found.append(below)
        return found

    def _below(self, node: Any) -> dict[str, tuple[Any, Any]]:  # noqa: ANN401 - nodes have no common type
        if id(node) not in self._parts:
            parts = node.value if isinstance(node.value, list) else []
            self._parts[id(node)] = {
                str(self._constructed[part[0]] if isinstance(part, tuple) else number): (
                    part if isinstance(part, tuple) else (None, part)
                )
                for number, part in enumerate(parts)
            }
        return self._parts[id(node)]

    def _span(self, node: Any) -> Span:  # noqa: ANN401 - nodes have no common type
        marks = node.start_mark, node.end_mark
        start, end = (self.source.offset(mark.line + 1, mark.column + 1) for mark in marks)
        return Span(self.source, start, end)


def read_yaml(
    source: Source,
    dialect: Dialect = PLAIN,
    most_values: int = MOST_VALUES,
    charge: Callable[[int], object] | None = None,
) -> YamlDocument:
    """Read a YAML text with the positions of its values.

    With `charge`, the caller limits what aliases expand to: it is called with the number of keys of each
    mapping after merge keys are replaced, and may raise.

    Raises:
        YamlError: the text is not YAML, a value does not fit its tag, or a limit is exceeded.
    """
    import yaml

    in_c, in_python = dialect.loaders
    try:
        try:
            return _document(source, in_c, most_values, charge)
        except (yaml.scanner.ScannerError, yaml.parser.ParserError):
            if charge is not None:  # the caller has not accounted for the time that this takes
                raise
            return _document(source, in_python, most_values, charge)
    except yaml.MarkedYAMLError as error:
        problem = ", ".join(part for part in (error.context, error.problem) if part)
        raise YamlError(problem, _at(source, error.problem_mark or error.context_mark)) from None
    except yaml.YAMLError as error:  # a character that is not allowed
        raise YamlError(" ".join(str(error).split()), source.whole()) from None
    except UnicodeEncodeError as error:  # a lone surrogate, which the loader in C rejects
        raise YamlError(f"a character cannot be written as UTF-8: {error.reason}", source.whole()) from None
    except RecursionError:
        raise YamlError("it is nested too deeply", source.whole()) from None


def load_yaml(text: str, dialect: Dialect = PLAIN) -> Any:  # noqa: ANN401 - any YAML value
    """The data of a YAML text. Raises YamlError as `read_yaml` does."""
    return read_yaml(Source("", text), dialect).data


def check_nesting(text: str, most_values: int = MOST_VALUES, *, in_c: bool = True) -> None:
    """Check that a loader can read a text.

    Raises:
        yaml.YAMLError: the text is not YAML, or has over MOST_LEVELS levels or about `most_values` values.
    """
    import yaml

    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader) if in_c else yaml.BaseLoader
    level = 0
    event: Any
    try:
        for count, event in enumerate(yaml.parse(text, loader)):
            if count > 2 * most_values:  # a list has two events, and so has a document
                raise yaml.composer.ComposerError(None, None, _too_many(most_values), event.start_mark)
            level += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if level > MOST_LEVELS:
                raise yaml.composer.ComposerError(None, None, _TOO_DEEP, event.start_mark)
    except yaml.MarkedYAMLError as error:
        if error.problem == _TOO_DEEP_IN_C:
            raise yaml.composer.ComposerError(None, None, _TOO_DEEP, error.problem_mark) from None
        raise


def _document(
    source: Source,
    loader_class: Any,  # noqa: ANN401 - from `Dialect.loaders`
    most_values: int,
    charge: Callable[[int], object] | None,
) -> YamlDocument:
    """Read a text with one loader. Raises yaml.YAMLError, UnicodeEncodeError, RecursionError."""
    import yaml

    check_nesting(source.text, most_values, in_c=not issubclass(loader_class, yaml.reader.Reader))
    loader = loader_class(source.text)
    loader.charge = charge
    try:
        root = loader.get_single_node()
        if root is not None and charge is None:
            _check_size(root, most_values)
        constructed = loader.constructed_objects  # the loader replaces this attribute at the end
        data = None if root is None else loader.construct_document(root)
    finally:
        loader.dispose()
    return YamlDocument(source, data, root, constructed)


def _position(mark: Any) -> tuple[int, int]:  # noqa: ANN401 - marks of C and of Python
    return mark.line, mark.column


def _at(source: Source, mark: Any) -> Span:  # noqa: ANN401 - marks of C and of Python
    if mark is None:
        return source.whole()
    # the loader in C reports the end of a text on an extra line
    is_inside = mark.line < source.line_count
    start = source.offset(mark.line + 1, mark.column + 1) if is_inside else len(source.data)
    return Span(source, start, start)


def _too_many(most_values: int) -> str:
    return f"it contains more than {most_values:,} values"


def _check_size(root: yaml.Node, most_values: int) -> None:
    """Raise yaml.YAMLError if a document expands to too many values or levels."""
    import yaml

    known: dict[int, tuple[int, int]] = {}

    def measure(node: yaml.Node) -> tuple[int, int]:
        """The number of values and levels a node expands to. A node that contains itself has too many."""
        key = id(node)
        if key not in known:
            known[key] = most_values, 1  # until it is computed; a node that contains itself uses this
            parts = node.value if isinstance(node.value, list) else ()
            nodes = (part for item in parts for part in (item if isinstance(item, tuple) else (item,)))
            sizes = [measure(part) for part in nodes]
            known[key] = 1 + sum(size for size, _ in sizes), 1 + max((level for _, level in sizes), default=0)
        return known[key]

    size, levels = measure(root)
    if len(known) > most_values:
        raise yaml.composer.ComposerError(None, None, _too_many(most_values), root.start_mark)
    if size > most_values or levels > MOST_LEVELS + 1:  # the values in the deepest list are one level more
        message = "its aliases expand to too many values"
        raise yaml.composer.ComposerError(None, None, message, root.start_mark)


def _loader(dialect: Dialect, base: Any) -> Any:  # noqa: ANN401 - PyYAML's classes in C or Python
    from yaml.constructor import ConstructorError

    class Loader(base):  # type: ignore[misc]  # in C or Python
        """A loader with limits on keys and numbers. All its errors have a place."""

        charge: Callable[[int], object] | None = None

        def construct_object(self, node: Any, deep: bool = False) -> Any:  # noqa: ANN401 - any YAML value
            try:
                return super().construct_object(node, deep)
            except CONSTRUCTION_ERRORS as error:
                import json

                text = json.dumps(node.value, ensure_ascii=False)[:60] if node.id == "scalar" else "it"
                # other errors are bugs of PyYAML, and their text does not help
                reason = f": {error}" if isinstance(error, ValueError) else ""
                message = f"{text} is not a valid {node.tag.rpartition(':')[2]}{reason}"[:200]
                raise ConstructorError(None, None, message, node.start_mark) from None

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:  # noqa: ANN401 - any YAML value
            if isinstance(node.value, list) and len(node.value) > MOST_LARGE_KEYS and not dialect.as_text:
                self._check_keys(node, deep)
            return super().construct_mapping(node, deep)

        def _check_keys(self, mapping: Any, deep: bool) -> None:  # noqa: ANN401 - a node
            """Raise ConstructorError for too many keys that may have been chosen to share one hash."""
            self.flatten_mapping(mapping)  # merged mappings have keys too
            keys = (self.construct_object(key, deep) for key, _ in mapping.value)  # the loader caches them
            if sum(isinstance(key, int) and abs(key) >= OWN_HASH for key in keys) > MOST_LARGE_KEYS:
                message = f"it has more than {MOST_LARGE_KEYS} integers of over 18 digits as keys"
                raise ConstructorError(None, None, message, mapping.start_mark)

        def flatten_mapping(self, node: Any) -> None:  # noqa: ANN401 - a node
            super().flatten_mapping(node)
            if self.charge is not None:
                self.charge(
                    len(node.value)
                )  # before PyYAML 6.0.4, merging can double the keys with each mapping

        def construct_yaml_int(self, node: Any) -> int:  # noqa: ANN401 - a node
            # integers may be in base 60 (1:30), and reading those takes time with the square of their length
            value = super().construct_yaml_int(node) if len(node.value) <= LONGEST else 1 << LARGEST_BITS
            if value.bit_length() > LARGEST_BITS:
                raise ConstructorError(None, None, TOO_LARGE, node.start_mark)
            return int(value)

    if dialect.as_text:
        return Loader
    Loader.add_constructor("tag:yaml.org,2002:int", Loader.construct_yaml_int)
    for tag, unit in dialect.units.items():
        Loader.add_constructor(tag, _constructor(unit))
    for tag, pattern in dialect.patterns.items():
        Loader.add_implicit_resolver(tag, pattern, None)
    return Loader


def _constructor(unit: Callable[[str], float]) -> Callable[[Any, Any], float]:
    from yaml.constructor import ConstructorError

    def construct(loader: Any, node: Any) -> float:  # noqa: ANN401 - a loader and a node
        text = loader.construct_scalar(node)
        try:
            return unit(text)
        except CONSTRUCTION_ERRORS as error:
            raise ConstructorError(None, None, str(error), node.start_mark) from None

    return construct
