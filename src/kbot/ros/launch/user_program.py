"""Finds the files and interpreters of the user's own programs in a launch file."""

from __future__ import annotations

import ast
import re
import shutil
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from kbot.ros.launch.known_packages import NODES, Role, role
from kbot.ros.launch.plan import PlannedNode
from kbot.ros.launch.python_packages import folder_of_module
from kbot.text import DescriptionError, Diagnostic, Severity, read_source
from kbot.text.folders import files_below
from kbot.worker import children
from kbot.xacro.packages import PackageError, Packages

_SHEBANG = re.compile(r"#!.*\bpython[\d.]*\s*$")
_QUERY_TIMEOUT_S = 20.0
"""Time limit for asking another interpreter which modules it has."""


@dataclass(frozen=True, slots=True)
class Program:
    """A user's own node that can run: its interpreter, its file, and the ROS modules that it imports.

    `module_folders`: the folders of the modules that it imports from packages of the workspace.
    """

    node: PlannedNode
    interpreter: str
    file: str
    ros: frozenset[str]
    module_folders: tuple[str, ...] = ()


_WITHOUT_PARAMETERS = (Role.VIEWER, Role.GAMEPAD)
"""Nodes that the page replaces. It does not read their parameters."""


def is_run(node: PlannedNode, packages: Packages) -> bool:
    """Whether KBot runs a node with its parameters: as the user's program, or by a replacement."""
    found = role(node.package, node.type, node.args)
    if found is not None:
        return found not in _WITHOUT_PARAMETERS
    return node.package not in NODES and isinstance(find_program(node, packages), Program)


def find_program(node: PlannedNode, packages: Packages) -> Program | Diagnostic:
    """The program of a node, or the reason why it is not run, with a fix."""
    try:
        folder = packages.find(node.package)
    except PackageError as error:
        return _not_run(node, error.problem, error.hint)
    file = _in_package(Path(folder), node.type)
    if file is None:
        return _not_run(node, f"{folder} has no program {node.type}", "")
    try:
        text = read_source(file).text
    except DescriptionError:
        text = ""
    if not (file.suffix == ".py" or _SHEBANG.match(text.partition("\n")[0])):
        return _not_run(
            node, f"{file} is not a Python program", "KBot runs only Python nodes; run it with ROS"
        )
    try:
        wanted = _imports(ast.parse(text), file.parent, Path(folder))
    except (SyntaxError, ValueError) as error:
        line = f"{file}:{getattr(error, 'lineno', 1)}"
        return _not_run(node, f"{line}: not valid Python", str(getattr(error, "msg", error)))
    ros = wanted & {"rospy", "rclpy"}
    in_workspace = {name: place for name in sorted(wanted) if (place := folder_of_module(name, packages))}
    wanted -= in_workspace.keys()
    interpreter = next(
        (python for python in _interpreters() if not _lacking(python, frozenset(wanted))), None
    )
    if interpreter is None:
        lacking = sorted(_lacking(sys.executable, frozenset(wanted)))
        hint = (
            "install ROS, or use kbot.Node, which does not need ROS" if ros else "install the missing modules"
        )
        return _not_run(node, f"{file} imports {', '.join(lacking)}, not installed", hint)
    return Program(node, interpreter, str(file), frozenset(ros), tuple(in_workspace.values()))


def _not_run(node: PlannedNode, why: str, hint: str) -> Diagnostic:
    severity = Severity.ERROR if node.required else Severity.WARNING
    message = f"{node.full_name} ({node.package}/{node.type}) is not run: {why}"
    hint = f"{hint}; the node is required".lstrip("; ") if node.required else hint
    return Diagnostic("L055", severity, message, node.spans["type"], hint)


def _in_package(folder: Path, name: str) -> Path | None:
    """The file of that name, with or without .py, that is nearest to the root of the package."""
    found = map(Path, files_below(folder, lambda other: other in (name, f"{name}.py")))
    return min(found, key=lambda file: (len(file.parts), str(file)), default=None)


def _imports(tree: ast.Module, folder: Path, package: Path) -> set[str]:
    """The modules that a program imports at its start, without those of its own folder and package."""
    found: set[str] = set()

    def look(nodes: Iterable[ast.stmt]) -> None:
        for node in nodes:
            if isinstance(node, ast.Import):
                found.update(alias.name.partition(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module.partition(".")[0])
            elif isinstance(node, ast.If | ast.With):
                look(node.body)

    look(tree.body)
    own = (folder, package, package / "src")
    return {n for n in found if not any((f / n).is_dir() or (f / f"{n}.py").is_file() for f in own)}


@cache
def _interpreters() -> tuple[str, ...]:
    """KBot's own Python, then those of the machine, for which ROS is installed."""
    other = shutil.which("python3") or shutil.which("python")
    system = "/usr/bin/python3" if Path("/usr/bin/python3").exists() else None
    return tuple(dict.fromkeys(python for python in (sys.executable, other, system) if python))


@cache
def _lacking(python: str, modules: frozenset[str]) -> frozenset[str]:
    """The modules that an interpreter does not find."""
    if python == sys.executable:
        return frozenset(name for name in modules if not _is_here(name))
    code = "import sys, importlib.util as u; print(*(m for m in sys.argv[1:] if u.find_spec(m) is None))"
    # Python imports from its working directory first, and that may have a stranger's warnings.py
    root = Path(sys.executable).anchor
    try:
        done = children.run([python, "-c", code, *sorted(modules)], folder=root, seconds=_QUERY_TIMEOUT_S)
    except OSError:
        return modules
    return modules if done.returncode else frozenset(done.stdout.decode().split())


def _is_here(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except (ImportError, ValueError):
        return False
