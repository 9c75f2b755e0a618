"""Writes a design as a xacro: the robot's files, with the values at the lines that define them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from kbot.checks.formats import relative
from kbot.model.load import resolve_robot_path
from kbot.sweep.inputs import read_robot_inputs
from kbot.sweep.plan import Plan, design_robot
from kbot.sweep.results import Design
from kbot.sweep.space import Target, Value
from kbot.text import Edit, KbotError, Span, read_source, rewrite, write_text
from kbot.text.edits import apply_edits, edited_texts, unified_diff
from kbot.text.files import unsaved
from kbot.text.notes import notes_sent_to
from kbot.text.span import Call
from kbot.text.xml import parse_document
from kbot.trials.scenario import RobotSource
from kbot.xacro import Expansion, Packages, expand
from kbot.xacro.packages import may_change, package_around, package_name
from kbot.xacro.written_values import ParameterEdit, is_same_robot, parameter_edits

_MOST_LISTED = 20
"""Designs that an error lists. The table has all of them."""


@dataclass(frozen=True, slots=True)
class WrittenFile:
    """A file of a design: a copy of `source`, or `source` itself if `path` is the same."""

    path: str
    source: str
    before: str
    after: str

    def diff(self) -> str:
        return unified_diff(self.before, self.after, relative(self.source), relative(self.path))


@dataclass(frozen=True, slots=True)
class WrittenDesign:
    """The files of a design that are not written yet.

    changes     each changed value: its name, its old and new text, and its line
    elsewhere   the values of the design that are not part of the robot, such as `world=rooms`
    """

    files: tuple[WrittenFile, ...]
    changes: tuple[str, ...]
    elsewhere: tuple[str, ...]

    def diff(self) -> str:
        """The changes of all files."""
        return "".join(file.diff() for file in self.files)

    @property
    def paths(self) -> list[str]:
        """The files, as messages name them."""
        return [relative(file.path) for file in self.files]

    def existing(self) -> list[str]:
        """Those of the files that exist."""
        return [path for path in self.paths if os.path.lexists(path)]

    def write(self) -> None:
        """Write the files. Raises KbotError: one cannot be written."""
        for file in self.files:
            if file.path != file.source:
                write_text(file.path, file.after)
        rewrite({file.path: (file.before, file.after) for file in self.files if file.path == file.source})


def written_design(plan: Plan, design: Design, path: str) -> WrittenDesign:
    """A design as a xacro file `path`.

    If `path` is the robot's file, the robot's files change. Otherwise `path` is a copy of it. Each included
    file in which a value changes gets a copy beside it, which the new file includes.

    Raises:
        KbotError: a value is defined in a file of another package, or the copy is not the same robot.
    """
    robot = resolve_robot_path(plan.robot.file)
    packages = Packages(plan.robot.packages)
    arguments: dict[str, float | str] = dict(plan.robot.arguments)
    properties: dict[str, float | str] = dict(plan.robot.properties)
    elsewhere = []
    for dimension in plan.space.dimensions:
        value = design.values[dimension.name]
        if dimension.target is Target.ARGUMENT:
            arguments[dimension.name] = value
        elif dimension.target is Target.PROPERTY:
            properties[dimension.name] = value
        else:
            elsewhere.append(f"{dimension.name}={value}")
    found = parameter_edits(robot, arguments, properties, packages)
    if not Path(path).absolute().parent.is_dir():
        raise KbotError(f"{path} cannot be written: its folder does not exist")
    is_copy = os.path.realpath(path) != os.path.realpath(robot)
    _require_own(found.edits, robot if is_copy else "")
    if is_copy:
        files = _copies(found.edits, robot, path)
        simulated = design_robot(plan.robot, plan.space, tuple(design.values.values()))
        difference = _difference(
            files, RobotSource(path, packages=plan.robot.packages), found.wanted, simulated
        )
        if difference is not None:
            raise KbotError(
                f"{path} would not be the robot that was simulated{difference}. "
                f"Write it to the folder {Path(robot).parent}"
            )
    else:
        texts = edited_texts(each.edit for each in found.edits)
        files = tuple(WrittenFile(file, file, before, after) for file, (before, after) in texts.items())
    changes = tuple(
        f"{each.name}: {each.edit.span.text} → {each.edit.replacement} ({_place(each.edit.span)})"
        for each in found.edits
    )
    return WrittenDesign(files, changes, tuple(elsewhere))


def _difference(
    files: Sequence[WrittenFile], copy: RobotSource, wanted: Expansion, simulated: RobotSource
) -> str | None:
    """How the robot of the copied files differs from the simulated one, as the end of a sentence.

    Its expansion must be `wanted`. Its meshes and the files of its controllers are found from its folder, and
    must be the same too. Returns None if they are.
    """
    # that a package ships with KBot is reported when the new file is used
    with unsaved({file.path: file.after for file in files}), notes_sent_to(lambda text: None):
        result = expand(copy.file, packages=Packages(copy.packages), lenient=True)
        if not is_same_robot(result, wanted):
            return next((f": {d}" for d in result.diagnostics if d.is_error), "")
        used = set(map(os.path.realpath, read_robot_inputs(copy).files))
    copies = {os.path.realpath(file.source): os.path.realpath(file.path) for file in files}
    before = {copies.get(file, file) for file in map(os.path.realpath, read_robot_inputs(simulated).files)}
    for file in sorted(before - used):
        return f": from its folder, it does not find {relative(file)}"
    for file in sorted(used - before):
        return f": from its folder, it also uses {relative(file)}"
    return None


def _place(span: Span) -> str:
    return f"{relative(span.file)}:{span.line}"


def _require_own(edits: Sequence[ParameterEdit], copied: str) -> None:
    """Raises KbotError: an edit changes a file of another package. The file `copied` is only read."""
    for each in edits:
        file = Path(each.edit.span.file).resolve()
        if copied and file == Path(copied).resolve():
            continue
        if not may_change(file):
            raise KbotError(
                f"'{each.name}' is defined in {_place(each.edit.span)}, outside the working directory. "
                "Copy this file into your package, or run the command in the folder of its package"
            )


def _copies(edits: Sequence[ParameterEdit], robot: str, path: str) -> tuple[WrittenFile, ...]:
    """The copy of the robot's file, and those of the included files that change."""
    own: dict[str, set[Edit]] = {robot: set(_moved_includes(robot, path))}
    for each in edits:
        own.setdefault(each.edit.span.file, set()).add(each.edit)
        for include in _includes(each):
            edit = _redirected(include, path)
            own.setdefault(edit.span.file, set()).add(edit)
    files = []
    for file, changes in own.items():
        text = read_source(file).text
        copied = path if file == robot else str(Path(file).with_name(_copy_name(file, path)))
        files.append(WrittenFile(copied, file, text, apply_edits(text, list(changes))))
    return tuple(files)


def _moved_includes(robot: str, path: str) -> Iterator[Edit]:
    """The edits that let a copy in another folder include the same files as the robot's file."""
    folder, target = Path(robot).resolve().parent, Path(path).resolve().parent
    if folder == target:
        return
    package = package_around(folder)
    if folder.is_relative_to(Path.cwd().resolve()) or package is None:
        prefix = Path(os.path.relpath(folder, target)).as_posix()
    else:
        inside = folder.relative_to(package.resolve()).as_posix()
        prefix = f"$(find {package_name(str(package))})/{inside}"
    for tag in parse_document(read_source(robot), lenient=True).root.descendants():
        name = tag.attributes.get("filename", "")
        if tag.tag == "xacro:include" and name and not name.startswith(("$", "/")):
            start = tag.attribute_origin("filename").span.start
            yield Edit(Span(tag.source, start, start), f"{prefix}/")


def _includes(edit: ParameterEdit) -> Iterator[Call]:
    """The includes that lead to an edit."""
    for call in edit.calls:
        for each in call.chain() if call is not None else ():
            if each.kind == "include":
                yield each


def _copy_name(file: str, path: str) -> str:
    """The name of the copy of an included file: `best_wheel.xacro` if the robot becomes `best.xacro`."""
    return f"{Path(path).name.partition('.')[0]}_{Path(file).name}"


def _redirected(include: Call, path: str) -> Edit:
    """The edit that lets an include read the copy of its file.

    Raises:
        KbotError: the include does not name its file.
    """
    tag, name = include.span, Path(include.name).name
    before, found, _ = tag.text.rpartition(name)
    if not found:
        raise KbotError(
            f"{_place(tag)}: this include does not name {name}, in which a value changes. "
            "Write the design to the file of the robot itself"
        )
    start = tag.start + len(before.encode())
    return Edit(Span(tag.source, start, start + len(name.encode())), _copy_name(include.name, path))


def chosen_design(best: Sequence[Design], number: int | None) -> Design:
    """The design to write: the only best one, or the one that the user chose.

    Raises:
        KbotError: there is none, there are several, or the number is not that of one of them.
    """
    if not best:
        raise KbotError("no design passed all its runs and has a value of each objective, so none is written")
    by_number = {design.number: design for design in best}
    if number is None and len(best) == 1:
        return best[0]
    if number in by_number:
        return by_number[number]
    listed = "; ".join(
        f"{each.number}: {_shown({**each.values, **each.objectives})}" for each in best[:_MOST_LISTED]
    )
    more = f"; and {len(best) - _MOST_LISTED} more" if len(best) > _MOST_LISTED else ""
    problem = f"{len(best)} designs are best" if number is None else f"design {number} is not one of the best"
    raise KbotError(f"{problem}. Choose one with --design N: {listed}{more}")


def _shown(values: Mapping[str, Value]) -> str:
    return ", ".join(
        f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in values.items()
    )
