"""The public names of Python: modules, functions with their parameters, classes with their members."""

from __future__ import annotations

import ast
import dataclasses
import enum
import inspect
import re
import sys
import textwrap
from collections import deque
from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, get_args

import kbot

ROOT = Path(__file__).parents[2]
_IMPORT = re.compile(r"^[ >\"]*(?:from|import) (kbot[\w.]*)", re.MULTILINE)
"""An import in a program, in a block of a Markdown page, or in a cell of a notebook."""
_OPERATORS = frozenset(
    f"__{name}__"
    for name in ("call", "contains", "enter", "exit", "getitem", "iter", "len", "matmul", "next")
)
"""Special methods by which callers use an object."""
_CLASS = re.compile(r"\b[A-Z]\w+")


def modules() -> list[str]:
    """The public modules: `kbot`, those in `kbot.__all__`, and those that pages and examples import."""
    pages = [
        ROOT / "README.md",
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "docs" / "tutorial").rglob("*.py"),
        *(file for suffix in ("md", "py", "ipynb") for file in (ROOT / "examples").rglob(f"*.{suffix}")),
    ]
    imported = {name for page in pages for name in _IMPORT.findall(page.read_text("utf-8"))}
    packages = {f"kbot.{name}" for name in kbot.__all__ if isinstance(getattr(kbot, name), ModuleType)}
    return sorted({"kbot"} | imported | packages)


def lines() -> Iterator[str]:
    """One line for each name, parameter and member."""
    public = sorted((f"{module}.{name}", value) for module in modules() for name, value in _names(module))
    homes: dict[Any, str] = {}
    """The first name of each class and function. Its other names refer to it."""
    for name, value in public:
        if inspect.isclass(value) or inspect.isfunction(value):
            homes.setdefault(value, name)
    facts = {name: [*facts_of(name, value, homes)] for name, value in public}
    # a public member holds or returns objects of other classes, which have no public import path
    waiting = deque(homes)
    while waiting:
        owner = waiting.popleft()
        for found in _mentioned(owner, facts[homes[owner]]):
            if found not in homes:
                name = found.__qualname__
                name = homes[found] = f"{found.__module__}.{name}" if name in facts else name
                facts[name] = [*facts_of(name, found, homes)]
                waiting.append(found)
    for name in sorted(facts):
        yield from facts[name]


def _names(module: str) -> Iterator[tuple[str, Any]]:
    """The public names of a module: `__all__`, or else what it defines without an underscore."""
    loaded = import_module(module)
    listed: Sequence[str] = getattr(loaded, "__all__", ())
    for name in listed or vars(loaded):
        value = getattr(loaded, name)
        value = inspect.unwrap(value) if callable(value) else value  # a function with a cache
        is_own = getattr(value, "__module__", None) == module or (name.isupper() and not listed)
        if listed or (is_own and not name.startswith("_")):
            yield name, value


def facts_of(name: str, value: Any, homes: dict[Any, str]) -> Iterator[str]:
    if isinstance(value, ModuleType):
        yield f"{name}: module"
    elif get_args(value):
        yield f"{name}: type {' | '.join(each.__name__ for each in get_args(value))}"
    elif not (inspect.isclass(value) or inspect.isfunction(value)):
        yield f"{name}: {type(value).__name__}"
    elif homes[value] != name:
        yield f"{name}: the same as {homes[value]}"
    elif inspect.isclass(value):
        yield from _class(name, value, homes)
    else:
        yield from _function(name, "function", value)


def _class(name: str, value: type, homes: dict[Any, str]) -> Iterator[str]:
    bases, own = [*_bases(value, homes)], [value, *_private_bases(value, homes)]
    is_dataclass = dataclasses.is_dataclass(value) and "__init__" not in _written(value)
    yield f"{name}: {'dataclass' if is_dataclass else 'class'}" + (f" of {', '.join(bases)}" if bases else "")
    fields = set[str]()
    if is_dataclass:
        yield from _fields(name, value)
        fields = {field.name for field in dataclasses.fields(value)}
    elif issubclass(value, tuple):
        yield from _parameters(name, value)
        fields = {*getattr(value, "_fields", ())}
    elif not issubclass(value, enum.Enum) and _is_kbot(value.__init__):
        yield from _parameters(name, value.__init__)
    members: dict[str, list[str]] = {}
    for base in reversed(own):
        members |= {key: [*_member(f"{name}.{key}", base, key)] for key in _members(base)}
        members |= {key: [f"{name}.{key}: attribute {kind}".rstrip()] for key, kind in _set_by_init(base)}
    for key in sorted(members.keys() - fields):
        yield from members[key]


def _bases(value: type, homes: dict[Any, str]) -> Iterator[str]:
    """The bases that are public or of other packages, through those that are private."""
    for base in value.__bases__:
        if base in homes or not _is_kbot(base):
            yield from [] if base is object else [homes.get(base, base.__qualname__)]
        else:
            yield from _bases(base, homes)


def _private_bases(value: type, homes: dict[Any, str]) -> list[type]:
    """The bases whose members are listed with the class itself."""
    return [base for base in value.__mro__[1:] if _is_kbot(base) and base not in homes]


def _is_kbot(value: object) -> bool:
    return (getattr(value, "__module__", None) or "").partition(".")[0] == "kbot"


def _written(value: type) -> set[str]:
    """The methods that the source has, without those that `dataclass` makes."""
    functions = ((name, member) for name, member in vars(value).items() if inspect.isfunction(member))
    return {name for name, member in functions if not member.__code__.co_filename.startswith("<")}


def _members(value: type) -> set[str]:
    names = {*vars(value), *inspect.get_annotations(value)}
    return (_OPERATORS & _written(value)) | {name for name in names if not name.startswith("_")}


def _member(name: str, owner: type, key: str) -> Iterator[str]:
    value = vars(owner).get(key)
    function = getattr(value, "__func__", value)
    if isinstance(value, property):
        yield f"{name}: {'attribute' if value.fset else 'property'} {_annotation(value.fget, 'return')}"
    elif isinstance(value, cached_property):
        yield f"{name}: property {_annotation(value.func, 'return')}"
    elif inspect.isfunction(function):
        kinds = {classmethod: "class method", staticmethod: "static method"}
        yield from _function(name, kinds.get(type(value), "method"), function)
    elif isinstance(value, enum.Enum):
        yield f"{name}: {value.value!r}"
    else:
        annotation = inspect.get_annotations(owner).get(key, type(value).__name__)
        yield f"{name}: attribute {annotation}"


def _fields(name: str, value: Any) -> Iterator[str]:
    position = 0
    for field in dataclasses.fields(value):
        position += field.init and not field.kw_only
        place = "" if not field.init else " keyword" if field.kw_only else f" {position}"
        default = ""
        if field.default is not dataclasses.MISSING:
            default = f" = {_shown(field.default)}"
        elif field.default_factory is not dataclasses.MISSING:
            default = f" = {field.default_factory.__name__}()"
        yield f"{name}.{field.name}: field{place} {field.type}{default}"


def _function(name: str, kind: str, value: FunctionType) -> Iterator[str]:
    yield f"{name}: {kind} -> {_annotation(value, 'return')}"
    yield from _parameters(name, value)


def _parameters(name: str, function: Any) -> Iterator[str]:
    found = inspect.signature(function).parameters.values()
    for position, parameter in enumerate((each for each in found if each.name not in ("self", "cls")), 1):
        places = {
            parameter.KEYWORD_ONLY: "keyword",
            parameter.VAR_POSITIONAL: "*",
            parameter.VAR_KEYWORD: "**",
        }
        place = places.get(parameter.kind, str(position))
        annotation = getattr(
            parameter.annotation, "__forward_arg__", parameter.annotation
        )  # of a named tuple
        kind = "" if annotation is parameter.empty else f" {annotation}"
        default = "" if parameter.default is parameter.empty else f" = {_shown(parameter.default)}"
        yield f"{name}({parameter.name}): {place}{kind}{default}"


def _annotation(function: Any, name: str) -> str:
    return str(inspect.get_annotations(function).get(name, ""))


def _shown(value: object) -> str:
    """A default value, without an address."""
    return getattr(value, "__qualname__", None) or re.sub(r" at 0x[0-9a-f]+", "", repr(value))


def _set_by_init(value: type) -> Iterator[tuple[str, str]]:
    """The attributes that `__init__` sets, with their types as far as the source states them."""
    if "__init__" not in _written(value):
        return
    init: Any = vars(value)["__init__"]
    for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(init)))):
        if isinstance(node, ast.AnnAssign):
            found = [(node.target, ast.unparse(node.annotation))]
        elif isinstance(node, ast.Assign):
            pairs = (pair for target in node.targets for pair in _pairs(target, node.value))
            found = [(target, _inferred(given, init)) for target, given in pairs]
        else:
            continue
        for target, kind in found:
            if re.fullmatch(r"self\.[a-z]\w*", ast.unparse(target)):
                yield ast.unparse(target).removeprefix("self."), kind


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
    """The targets of an assignment with their values, also if both are tuples."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        yield from zip(target.elts, value.elts, strict=True)
    else:
        yield from ((each, value) for each in (target.elts if isinstance(target, ast.Tuple) else [target]))


def _inferred(value: ast.expr, init: Any) -> str:
    """The type of a value, if it is a parameter or if a class is called. Empty for other values."""
    if isinstance(value, ast.Name):
        return _annotation(init, value.id)
    called = ast.unparse(value.func) if isinstance(value, ast.Call) else ""
    return called if _CLASS.fullmatch(called) else ""


def _mentioned(owner: Any, facts: Sequence[str]) -> Iterator[type]:
    """The classes of KBot that the members of a class hold, or that a function or a member returns."""
    sources = [base.__module__ for base in getattr(owner, "__mro__", [owner]) if _is_kbot(base)]
    for fact in facts:
        name, _, text = fact.partition(": ")
        for word in () if name.endswith(")") else _CLASS.findall(text):
            for module in dict.fromkeys(sources):
                value = _named(module, word)
                if inspect.isclass(value) and _is_kbot(value):
                    yield value


def _named(module: str, word: str) -> object:
    """What a word in an annotation means, also if the module imports it only for the type checker."""
    if hasattr(sys.modules[module], word):
        return getattr(sys.modules[module], word)
    home = _imported(module).get(word, "")
    return getattr(import_module(home), word, None) if home.startswith("kbot") else None


@cache
def _imported(module: str) -> dict[str, str]:
    """The names that a module imports, with the modules that they come from."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return {alias.name: node.module or "" for node in nodes for alias in node.names}
