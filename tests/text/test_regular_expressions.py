"""No regular expression of KBot takes more than linear time, whatever text it is given.

Every expression that is written in `src/kbot` is attacked by texts made from its own parts. A
text that repeats a part four times as often must not cost more than four times the CPU time.
"""

import ast
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from re import _constants as kinds  # type: ignore[attr-defined]  # the parser that `re` itself uses
from re import _parser  # type: ignore[attr-defined]  # not in the stubs of `re`
from typing import Any

import pytest

import kbot

SOURCES = Path(kbot.__file__).parent
PAGE = Path(__file__).parents[2] / "web" / "src"
METHODS = ("search", "match", "fullmatch", "findall", "finditer", "sub", "subn", "split")
ANCHORED = {"match": "match", "fullmatch": "fullmatch"}
"""The other methods look for a match from every character on, as `search` does."""

EXPONENTIAL_SIZES = (8, 12, 16, 20, 24)
"""How often a part is repeated first: 2 to the 24th steps take a second, and more would not end."""
SIZES = (80, 320, 1280, 5120)
"""Then, four times as often each time, for as long as the time grows too fast."""
GROWTH = 8
"""Between the 4 of linear time and the 16 of quadratic time."""
CERTAIN_S = 0.02
"""CPU time that no linear expression needs for these texts of at most 20,000 characters, by far."""

POOL = [*map(chr, range(0x20, 0x7F)), "\n", "\t", "\u00e9", "\u00b2", "\u0663"]
"""The characters of which texts are made: ASCII, a letter, a numeral and a digit beyond it."""


@dataclass(frozen=True)
class Expression:
    """A pattern in the source, and the methods that use it."""

    place: str
    pattern: str | bytes
    flags: int
    methods: frozenset[str]


def written(node: ast.expr) -> Any:
    """The constant value of an expression, with `name` for parts that are known only at run time."""
    match node:
        case ast.Constant():
            return node.value
        case ast.BinOp(op=ast.Add()):
            left, right = written(node.left), written(node.right)
            if isinstance(left, bytes) or isinstance(right, bytes):
                return b"".join(p.encode() if isinstance(p, str) else p for p in (left, right))
            return left + right
        case ast.JoinedStr():
            return "".join(str(written(value)) for value in node.values)
    return "name"


TEXTS = {
    path.relative_to(SOURCES).as_posix(): path.read_text("utf-8") for path in sorted(SOURCES.rglob("*.py"))
}


def expressions(module: str) -> Iterator[Expression]:
    """The expressions in a module of `src/kbot`."""
    text = TEXTS[module]
    tree = parsed(text)
    names = {
        node.value: node.targets[0].id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    }
    at_once = {node.value: node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        function = node.func
        if not (isinstance(function.value, ast.Name) and function.value.id == "re"):
            continue
        if function.attr not in ("compile", *METHODS):
            continue
        last = node.args[-1]
        given = [k.value for k in node.keywords if k.arg == "flags"]
        if function.attr == "compile":
            given += node.args[1:]
            name = names.get(node, "")
            is_private = name.startswith("_")
            users = [text] if is_private else [t for t in TEXTS.values() if name and f"{name}." in t]
            methods = frozenset(m for user in users for m in used(parsed(user), name))
            if node in at_once:
                methods = frozenset({at_once[node]})
            elif not methods:  # it is passed on, so the module may use any method
                methods = frozenset(m for of, m in calls(tree) if of != "re" and m in METHODS[:5])
        else:
            methods = frozenset({function.attr})
            given += [last] if "re." in ast.unparse(last) else []
        flags = eval(ast.unparse(given[0]), {"re": re}) if given else 0
        yield Expression(f"{module}:{node.lineno}", written(node.args[0]), flags, methods)


def expressions_of_the_page() -> Iterator[Expression]:
    """The named patterns in web/src. Their syntax is also valid in Python."""
    for path in sorted(PAGE.rglob("*.ts")):
        text = path.read_text("utf-8")
        for match in re.finditer(r"^const \w+ =\s*/(.+)/([gimsuy]*);$", text, re.MULTILINE):
            flags = re.ASCII | (re.IGNORECASE if "i" in match[2] else 0)
            line = text.count("\n", 0, match.start()) + 1
            yield Expression(f"web/{path.name}:{line}", match[1], flags, frozenset({"search"}))


@cache
def parsed(text: str) -> ast.Module:
    return ast.parse(text)


@cache
def calls(tree: ast.Module) -> frozenset[tuple[str, str]]:
    """Every `name.attribute` of a module."""
    return frozenset(
        (getattr(node.value, "id", getattr(node.value, "attr", "")), node.attr)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
    )


def used(tree: ast.Module, name: str) -> set[str]:
    return {method for of, method in calls(tree) if name and of == name and method in METHODS}


class Attack:
    """The texts that attack an expression."""

    def __init__(self, pattern: str | bytes, flags: int) -> None:
        text = pattern.decode("latin-1") if isinstance(pattern, bytes) else pattern
        self.tree = _parser.parse(text, flags)
        characters = [node for node in self._nodes(self.tree) if self._is_character(node)]
        tests = [self._test(node) for node in characters]
        kinds_of: dict[tuple[bool, ...], str] = {}
        for character in POOL:
            kinds_of.setdefault(tuple(test(character) for test in tests), character)
        self.letters = list(kinds_of.values())
        """One character of each kind that the expression distinguishes."""

    def texts(self) -> Iterator[Callable[[int], str]]:
        """Functions from a number of repetitions to a text."""
        seen = set()
        for before, body in self._loops(self.tree, ""):
            pumps = list(dict.fromkeys((*self.letters, body, before + body, before)))
            for first, second, end in product(pumps, ("", *self.letters), ("", "\0", "\n\0")):
                for begin in dict.fromkeys((before, "")):
                    if first and (begin, first, second, end) not in seen:
                        seen.add((begin, first, second, end))
                        yield lambda n, b=begin, f=first, s=second, e=end: b + f * n + s * n + e

    def _loops(self, tree: Any, before: str) -> Iterator[tuple[str, str]]:
        """For each unbounded repetition: a text that leads to it, and a text that it repeats."""
        for node in tree:
            for inner in self._inner(node):
                if node[0] in REPEATS and node[1][1] is kinds.MAXREPEAT:
                    yield from ((before, body) for body in self._bodies(inner))
                yield from self._loops(inner, before)
            before += self._sample([node])

    def _bodies(self, tree: Any) -> Iterator[str]:
        """The alternatives that a repetition repeats."""
        branches = [node for node in self._nodes(tree) if node[0] is kinds.BRANCH]
        yield self._sample(tree)
        for branch in branches:
            yield from (self._sample(alternative) for alternative in branch[1][1])

    def _sample(self, tree: Any) -> str:
        """A short text that matches."""
        parts = []
        for node in tree:
            kind, value = node
            if self._is_character(node):
                test = self._test(node)
                parts.append(next((c for c in POOL if test(c)), chr(value) if kind is kinds.LITERAL else "x"))
            elif kind in REPEATS:
                parts.append(self._sample(value[2]) * value[0])
            elif kind is kinds.BRANCH:
                parts.append(self._sample(value[1][0]))
            elif kind in (kinds.SUBPATTERN, kinds.ATOMIC_GROUP):
                parts.append(self._sample(self._inner(node)[0]))
        return "".join(parts)

    def _nodes(self, tree: Any) -> Iterator[Any]:
        for node in tree:
            yield node
            for inner in self._inner(node):
                yield from self._nodes(inner)

    @staticmethod
    def _inner(node: Any) -> list[Any]:
        kind, value = node
        if kind in REPEATS:
            return [value[2]]
        if kind is kinds.BRANCH:
            return list(value[1])
        if kind is kinds.SUBPATTERN:
            return [value[3]]
        if kind is kinds.ATOMIC_GROUP:
            return [value]
        if kind in (kinds.ASSERT, kinds.ASSERT_NOT):
            return [value[1]]
        return []

    @staticmethod
    def _is_character(node: Any) -> bool:
        return node[0] in (kinds.LITERAL, kinds.NOT_LITERAL, kinds.ANY, kinds.IN)

    def _test(self, node: Any) -> Callable[[str], bool]:
        """Whether a character matches a node."""
        from re import _compiler  # type: ignore[attr-defined]  # not in the stubs of `re`

        tree = _parser.SubPattern(self.tree.state, [node])
        compiled = _compiler.compile(tree, self.tree.state.flags)
        return lambda character: compiled.fullmatch(character) is not None


REPEATS = (kinds.MAX_REPEAT, kinds.MIN_REPEAT, kinds.POSSESSIVE_REPEAT)


def cpu_s(run: Callable[[Any], object], text: Any) -> float:
    begun = time.process_time()
    run(text)
    return time.process_time() - begun


def worst(expression: Expression) -> str:
    """A description of the first text whose time grows faster than its length, or an empty text."""
    compiled = re.compile(expression.pattern, expression.flags)
    methods = {ANCHORED.get(m, "findall") for m in expression.methods or ("match", "fullmatch", "search")}
    for make in Attack(expression.pattern, expression.flags).texts():
        for method in methods:
            run, before = getattr(compiled, method), 0.0
            for size in (*EXPONENTIAL_SIZES, *SIZES):
                text = make(size)
                given = text.encode() if isinstance(expression.pattern, bytes) else text
                now = cpu_s(run, given)
                if (
                    now > CERTAIN_S and cpu_s(run, given) > CERTAIN_S
                ):  # measured twice, because one measurement may be disturbed
                    return f"{method} of {make(3)!r}, with {size} repetitions for 3: {now:.2f} s of CPU time"
                if size in SIZES:
                    if before and now < GROWTH * before:
                        break
                    before = now
    return ""


@pytest.mark.parametrize("module", [m for m, text in TEXTS.items() if "\nimport re\n" in text])
def test_the_time_is_linear_in_the_length(module: str) -> None:
    assert {e.place: slow for e in expressions(module) if (slow := worst(e))} == {}


@pytest.mark.parametrize("expression", list(expressions_of_the_page()), ids=lambda e: e.place)
def test_the_time_of_the_page_is_linear_in_the_length(expression: Expression) -> None:
    assert worst(expression) == ""


@pytest.mark.parametrize(
    ("pattern", "method"),
    [
        (r"(a+)+b", "match"),  # exponential
        (r"(?:\s|<!--.*?-->)*<robot", "match"),  # exponential: a comment may extend to the end of a later one
        (r"""([^\s<>/="']+)\s*(=?)\s*\Z""", "search"),  # cubic
        (r"[0-9]+\.?[0-9]*", "fullmatch"),  # quadratic: a row of digits can be split anywhere
        (r"\s*(.*?)\s*", "fullmatch"),
        (r"<!--.*?-->", "search"),  # quadratic: each of many starts searches for an end
        (r"\w+=", "search"),  # quadratic: from each letter on
    ],
)
def test_a_slow_expression_is_detected(pattern: str, method: str) -> None:
    assert worst(Expression("", pattern, 0, frozenset({method})))


def test_the_expressions_of_the_page_are_found():
    assert len(list(expressions_of_the_page())) >= 1
