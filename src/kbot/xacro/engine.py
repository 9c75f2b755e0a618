"""Entry points of expansion: `expand` for files, `expand_text` for text."""

from __future__ import annotations

import gc
import os

from kbot.text.errors import DescriptionError, reading
from kbot.text.recursion import recursion_limit
from kbot.text.span import Origin, Source, Span
from kbot.text.suggest import did_you_mean, nearest
from kbot.text.xml import Element, XmlDocument
from kbot.xacro import files, templates
from kbot.xacro.expander import Expander
from kbot.xacro.expressions import compiler
from kbot.xacro.limits import DEFAULT, Limits
from kbot.xacro.result import Expansion
from kbot.xacro.run import Log, Run
from kbot.xacro.scope import Scope
from kbot.xacro.tags import TAGS, call_macro
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import LimitFault, Problem

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from kbot.text.diagnostic import Diagnostic
    from kbot.xacro.packages import Packages

_FRAMES_PER_LEVEL = 8
"""Python calls for each level of elements, macro calls and includes, for the recursion limit."""
_NODE_STEPS = 8
"""Steps charged for each element or comment of the result: 200,000 of them take 1.5 s."""


def expand(
    path: str | os.PathLike[str],
    arguments: Mapping[str, str] | None = None,
    *,
    properties: Mapping[str, Value] | None = None,
    packages: Packages | None = None,
    limits: Limits = DEFAULT,
    root_dir: str = os.curdir,
    log: Log | None = None,
    lenient: bool = False,
) -> Expansion:
    """Expand a xacro (or plain URDF) file.

    arguments   values of `xacro:arg`s, by name
    properties  values that replace those of top-level properties, by name
    packages    where `$(find …)` searches; by default around the file and in ROS's usual places
    root_dir    the folder that relative paths start from, and the value of `$(cwd)`
    lenient     whether to warn about what the official xacro rejects, if the robot can be loaded: includes of
                absent packages, and in plain URDF what only xacro rejects

    Errors in the file are not raised: see `Expansion.diagnostics`.
    """
    name = os.fspath(path)
    run = Run(name, arguments or {}, packages, limits, root_dir, lenient)
    run.log = log
    try:
        source = run.read(name)
    except DescriptionError as error:
        return Expansion(name, None, None, error.diagnostics, ())
    with reading(name):
        return _expand(source, name, run, properties or {})


def expand_text(
    text: str,
    base_path: str | os.PathLike[str] = "",
    arguments: Mapping[str, str] | None = None,
    *,
    properties: Mapping[str, Value] | None = None,
    packages: Packages | None = None,
    limits: Limits = DEFAULT,
    root_dir: str = os.curdir,
    lenient: bool = False,
) -> Expansion:
    """Expand a text as if it were the file `base_path`, which need not exist."""
    name = os.fspath(base_path)
    run = Run(name, arguments or {}, packages, limits, root_dir, lenient)
    with reading(name):
        return _expand(Source(name, text), name, run, properties or {})


def clear_cache() -> None:
    """Forget parsed files, compiled expressions and YAML data."""
    from kbot.xacro import yaml  # most robots read no YAML: start-up time

    files.clear_cache()
    compiler.clear_cache()
    templates.clear_cache()
    yaml.clear_cache()


def _expand(source: Source, name: str, run: Run, properties: Mapping[str, Value]) -> Expansion:
    root, document = None, None
    scope, expander = Scope(run), Expander(run, TAGS, call_macro, dict(properties))
    stopped: tuple[Diagnostic, ...] = ()
    collecting = gc.isenabled()
    gc.disable()  # looking for cycles takes a tenth of the time, and there are none
    try:
        with recursion_limit(run.limits.nesting * _FRAMES_PER_LEVEL + 1000):
            # urdfdom reads plain URDF, but only xacro reads xacro
            document = run.parsed(source, lenient=run.lenient and "xacro:" not in source.text)
            if document.diagnostics:
                run.adopt(document.diagnostics, None)
            root = _walk(document, expander, scope)
    except DescriptionError as error:
        return Expansion(name, None, None, error.diagnostics, ())
    except LimitFault as fault:
        stopped = (_stopped(fault, name),)
    finally:
        if collecting:
            gc.enable()
    diagnostics, dependencies = (*run.diagnostics(), *stopped), tuple(run.dependencies)
    return Expansion(
        name,
        document,
        root,
        diagnostics,
        dependencies,
        scope,
        expander.macros,
        run.defaults,
        frozenset(run.declared),
        {name: expander.overrides[name] for name in expander.overridden},
        run.limits.steps - run.budget.steps + _NODE_STEPS * (run.limits.nodes - run.nodes),
    )


def _walk(document: XmlDocument, expander: Expander, scope: Scope) -> Element:
    root = expander.root(document.root, scope)
    expander.run.check_result(root)
    expander.run.point_at_later_definitions(scope.find)
    expander.run.point_at_unprefixed(document.root)
    _warn_about_unknown(expander, scope)
    return root


def _warn_about_unknown(expander: Expander, scope: Scope) -> None:
    run = expander.run
    for name, value in run.given.items():
        if name in run.declared or name in expander.overridden:
            continue
        if name in scope.values:
            hint = f"'{name}' is a property: kbot expand --set {name}={value} overrides it"
        else:
            hint = did_you_mean(name, run.declared) or _near_property(name, value, scope)
        if not hint:
            listed = ", ".join(sorted(run.declared))
            hint = f"the arguments are {listed}" if listed else "the description declares no arguments"
        run.warn_at("X206", f"the description declares no argument '{name}'", None, hint)
    for name in expander.overrides:
        if name not in expander.overridden:
            run.warn_at("X207", f"the description defines no property '{name}' at its top level", None)


def _near_property(name: str, value: str, scope: Scope) -> str:
    """How to override the property that a misspelled name most likely means; empty if there is none."""
    written = ("value", "default")  # neither a block nor assigned in an expression
    near = nearest(name, [n for n, binding in scope.values.items() if binding.attribute in written], count=1)
    return (
        f"did you mean the property {near[0]}? kbot expand --set {near[0]}={value} overrides it"
        if near
        else ""
    )


def _stopped(fault: LimitFault, name: str) -> Diagnostic:
    from kbot.text.diagnostic import Severity  # only for an error: start-up time

    origin = fault.origin or Origin(Span(Source(name, ""), 0, 0))
    return Problem(fault.code, Severity.ERROR, fault.message, origin, fault.hint).diagnostic()
