"""The one reader of YAML: plain data of bounded size, and where each value was written.

YAML is what PyYAML reads: version 1.1, one document a text. A text is read in C where PyYAML can; one that
LibYAML refuses is read again in Python, which accepts more (`{a:{b: 1}}`) and has better error messages.
PyYAML takes 20 ms to import, so it is imported when the first text is read. No dataclasses here: what they
import would make `kbot expand` of a description with parameter files slower.
"""

from __future__ import annotations

from functools import cached_property

from kbot.text.span import Source, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Mapping
    from typing import Any

    import yaml

Keys = tuple[str, ...]
"""The way to a value: keys of mappings as texts, and numbers of items of lists, from the root on."""
NOT_MADE = ValueError, LookupError, TypeError, AttributeError, ArithmeticError
"""What PyYAML lets through where a text is not of its tag's type, as in `!!int ''` and `2020-13-45`."""
TOO_LARGE = "a number is too large"
LARGEST_BITS = 1023
"""Of a whole number: those that a float can hold."""
LONGEST = 2 * LARGEST_BITS
"""Characters of a whole number: it may be written in bits."""
MOST_VALUES = 200_000
"""Of a document, with each alias counted as what it stands for: ten lines can stand for a billion values.
To construct one takes about 5 microseconds. Robots' files have a few thousand."""
MOST_LEVELS = 100
"""Of nested lists and mappings. PyYAML's loaders in C recurse for each level, and 10,000 levels overflow the
stack, which ends the process; their parser takes the square of the levels. Robots' files have at most 10."""
_TOO_DEEP = f"it is nested more than {MOST_LEVELS} levels deep"
_TOO_DEEP_IN_C = "exceeded maximum nesting depth"
"""What LibYAML reports since 0.2.6 at 1,000 levels, before it gives the first event of them."""
OWN_HASH = (1 << 61) - 1
"""The hash of a smaller whole number is the number. Larger ones can be chosen to have the same hash; as keys,
each is then compared with all before it."""
MOST_LARGE_KEYS = 100
"""Of a mapping, from OWN_HASH on: to compare all of them takes 0.1 ms."""


class YamlError(ValueError):
    """A text that is not YAML, or that exceeds a bound.

    `problem` is what is wrong, without the place. `span` is where; it is the whole text where the place is
    not known. As a text it is both.
    """

    def __init__(self, problem: str, span: Span) -> None:
        self.problem, self.span = problem, span
        place = f" (line {span.line}, column {span.column})" if span != span.source.whole() else ""
        super().__init__(f"{problem}{place}")


class Dialect:
    """How scalars are read.

    `units` are functions of a scalar's text, by tag (`!degrees`). They raise ValueError for a text that they
    do not accept. `patterns` are the plain scalars that have such a tag without it, by tag. With `as_text`
    all scalars are texts, and there are no units.
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
        """PyYAML's classes for this dialect in C and in Python, with bounds."""
        import yaml  # lazy in this module: start-up time

        kind = "BaseLoader" if self.as_text else "SafeLoader"
        in_python = getattr(yaml, kind)
        return _loader(self, getattr(yaml, f"C{kind}", in_python)), _loader(self, in_python)


PLAIN = Dialect()
TEXT = Dialect(as_text=True)
"""For files whose reader decides what a scalar is. Merge keys (`<<`) are texts, too."""


class YamlPlace:
    """Where a value was written, and its key; None for items of lists and for the root. Not to be changed."""

    __slots__ = ("key", "value")

    def __init__(self, key: Span | None, value: Span) -> None:
        self.key = key
        self.value = value


class YamlDocument:
    """A text of YAML that was read. Not to be changed."""

    def __init__(self, source: Source, data: Any, root: Any, made: Mapping[Any, Any]) -> None:  # noqa: ANN401
        self.source = source
        self.data = data
        """Mappings, lists and scalars; None for an empty text."""
        self._root = root
        self._made = made
        """What each node of PyYAML's tree became."""
        self._parts: dict[int, dict[str, tuple[Any, Any]]] = {}

    def place(self, *keys: str) -> YamlPlace | None:
        """Where the value that `keys` lead to was written; None if there is no such value. What an alias
        repeats was written at its anchor."""
        nodes = self._nodes(keys)
        if len(nodes) <= len(keys):
            return None
        key, value = nodes[-1]
        return YamlPlace(None if key is None else self._span(key), self._span(value))

    def span(self, *keys: str) -> Span:
        """The span of the last key; of the item if it is one of a list; of the nearest value above if there
        is no such value."""
        nodes = self._nodes(keys)
        if not nodes:
            return self.source.whole()
        key, value = nodes[-1]
        return self._span(value if key is None else key)

    def _nodes(self, keys: Keys) -> list[tuple[Any, Any]]:
        """Nodes of keys and values from the root to the last of `keys` that is there."""
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
                str(self._made[part[0]] if isinstance(part, tuple) else number): (
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
    """What a text holds, with places.

    With `charge`, the caller bounds what aliases stand for: it is called with the number of keys of each
    mapping once its merge keys are replaced, and may raise.

    Raises:
        YamlError: it is not YAML, a value cannot be made of it, or it exceeds a bound.
    """
    import yaml

    in_c, in_python = dialect.loaders
    try:
        try:
            return _document(source, in_c, most_values, charge)
        except (yaml.scanner.ScannerError, yaml.parser.ParserError):
            if charge is not None:  # it has not counted the time that this takes
                raise
            return _document(source, in_python, most_values, charge)
    except yaml.MarkedYAMLError as error:
        problem = ", ".join(part for part in (error.context, error.problem) if part)
        raise YamlError(problem, _at(source, error.problem_mark or error.context_mark)) from None
    except yaml.YAMLError as error:  # a character that is not allowed
        raise YamlError(" ".join(str(error).split()), source.whole()) from None
    except UnicodeEncodeError as error:  # half of a pair of surrogates, which the loader in C refuses
        raise YamlError(f"a character cannot be written as UTF-8: {error.reason}", source.whole()) from None
    except RecursionError:
        raise YamlError("it is nested too deeply", source.whole()) from None


def load_yaml(text: str, dialect: Dialect = PLAIN) -> Any:  # noqa: ANN401 - what YAML holds
    """What a text holds, without places. Raises YamlError as `read_yaml` does."""
    return read_yaml(Source("", text), dialect).data


def check_nesting(text: str, most_values: int = MOST_VALUES, *, in_c: bool = True) -> None:
    """Make sure that a loader can read a text.

    Raises:
        yaml.YAMLError: it is not YAML, or has more than MOST_LEVELS levels or about `most_values` values.
    """
    import yaml

    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader) if in_c else yaml.BaseLoader
    level = 0
    event: Any
    try:
        for count, event in enumerate(yaml.parse(text, loader)):
            if count > 2 * most_values:  # a list has two events, and a document as well
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
    loader_class: Any,  # noqa: ANN401 - of `Dialect.loaders`
    most_values: int,
    charge: Callable[[int], object] | None,
) -> YamlDocument:
    """Raises yaml.YAMLError, UnicodeEncodeError, RecursionError."""
    import yaml

    check_nesting(source.text, most_values, in_c=not issubclass(loader_class, yaml.reader.Reader))
    loader = loader_class(source.text)
    loader.charge = charge
    try:
        root = loader.get_single_node()
        if root is not None and charge is None:
            _check_size(root, most_values)
        made = loader.constructed_objects  # the loader takes a new one when it is done
        data = None if root is None else loader.construct_document(root)
    finally:
        loader.dispose()
    return YamlDocument(source, data, root, made)


def _at(source: Source, mark: Any) -> Span:  # noqa: ANN401 - marks of C and of Python
    if mark is None:
        return source.whole()
    is_inside = (
        mark.line < source.line_count
    )  # the loader in C reports the end of a text on a line of its own
    start = source.offset(mark.line + 1, mark.column + 1) if is_inside else len(source.data)
    return Span(source, start, start)


def _too_many(most_values: int) -> str:
    return f"it holds more than {most_values:,} values"


def _check_size(root: yaml.Node, most_values: int) -> None:
    """Raises yaml.YAMLError: it stands for too many values or levels."""
    import yaml

    known: dict[int, tuple[int, int]] = {}

    def measure(node: yaml.Node) -> tuple[int, int]:
        """How many values and levels a node stands for; one that holds itself stands for very many."""
        key = id(node)
        if key not in known:
            known[key] = most_values, 1  # until computed: a node that reaches itself gets this
            parts = node.value if isinstance(node.value, list) else ()
            nodes = (part for item in parts for part in (item if isinstance(item, tuple) else (item,)))
            sizes = [measure(part) for part in nodes]
            known[key] = 1 + sum(size for size, _ in sizes), 1 + max((level for _, level in sizes), default=0)
        return known[key]

    size, levels = measure(root)
    if len(known) > most_values:
        raise yaml.composer.ComposerError(None, None, _too_many(most_values), root.start_mark)
    if size > most_values or levels > MOST_LEVELS + 1:  # the values of the last list are one more
        message = "its aliases stand for too many values"
        raise yaml.composer.ComposerError(None, None, message, root.start_mark)


def _loader(dialect: Dialect, base: Any) -> Any:  # noqa: ANN401 - classes of PyYAML in C or Python
    from yaml.constructor import ConstructorError

    class Loader(base):  # type: ignore[misc]  # of C or Python
        """Data of bounded keys and numbers; what cannot be made is an error with a place."""

        charge: Callable[[int], object] | None = None

        def construct_object(self, node: Any, deep: bool = False) -> Any:  # noqa: ANN401 - what YAML holds
            try:
                return super().construct_object(node, deep)
            except NOT_MADE as error:
                import json

                text = json.dumps(node.value, ensure_ascii=False)[:60] if node.id == "scalar" else "it"
                reason = (
                    f": {error}" if isinstance(error, ValueError) else ""
                )  # the others are PyYAML's slips
                message = f"{text} is not a valid {node.tag.rpartition(':')[2]}{reason}"[:200]
                raise ConstructorError(None, None, message, node.start_mark) from None

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:  # noqa: ANN401 - what YAML holds
            if isinstance(node.value, list) and len(node.value) > MOST_LARGE_KEYS and not dialect.as_text:
                self._check_keys(node, deep)
            return super().construct_mapping(node, deep)

        def _check_keys(self, mapping: Any, deep: bool) -> None:  # noqa: ANN401 - a node
            """Refuse keys that can be chosen so that to insert them takes the square of their number."""
            self.flatten_mapping(mapping)  # what it merges has keys, too
            keys = (self.construct_object(key, deep) for key, _ in mapping.value)  # the loader keeps them
            if sum(isinstance(key, int) and abs(key) >= OWN_HASH for key in keys) > MOST_LARGE_KEYS:
                message = f"it has more than {MOST_LARGE_KEYS} whole numbers of over 18 digits as keys"
                raise ConstructorError(None, None, message, mapping.start_mark)

        def flatten_mapping(self, node: Any) -> None:  # noqa: ANN401 - a node
            super().flatten_mapping(node)
            if self.charge is not None:
                self.charge(len(node.value))  # before PyYAML 6.0.4, merged keys can double with each mapping

        def construct_yaml_int(self, node: Any) -> int:  # noqa: ANN401 - a node
            # whole numbers may be written to the base of 60 (1:30), which takes the square of their length
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
        except NOT_MADE as error:
            raise ConstructorError(None, None, str(error), node.start_mark) from None

    return construct
