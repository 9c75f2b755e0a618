"""The facts that rules check: sources, expansion, robot, drive and poses, each computed on first use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from kbot.checks.config import Config
from kbot.checks.edits import copy_as_collision, insert_child, set_value
from kbot.checks.facts.bodies import LinkBody, body_of
from kbot.checks.facts.folders import Folders
from kbot.checks.facts.sources import SourceFile, in_order, read_sources
from kbot.checks.facts.unprefixed import unprefixed
from kbot.checks.facts.vocabulary import CHILDREN
from kbot.kinematics.controller_files import ControllerFile, controller_files
from kbot.kinematics.drive.declared import DeclaredDrive, declared_drives, drive_controller
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, find_drive
from kbot.kinematics.drive.findings import drive_findings, plugin_findings, wheel_pairs
from kbot.kinematics.drive.programs import setting_findings
from kbot.kinematics.drive.wheels import MOST_JOINTS, MobileBase, Pair, meant_base
from kbot.kinematics.frames import FrameTree, rest_frames
from kbot.kinematics.spatial import SpatialFrame
from kbot.model import Joint, Link, RobotModel
from kbot.text import Diagnostic, Element, Fix, Origin, Source, Span
from kbot.text.suggest import Candidates

if TYPE_CHECKING:
    from kbot.xacro import Expansion, Packages


class Context:
    """One description that is being checked.

    `problems` are the findings of expansion and of the URDF reader. `unsure` names the links and joints that
    an error affects: their values are not what the author meant, so most rules skip them.
    """

    def __init__(
        self,
        entry: Source,
        expansion: Expansion,
        robot: RobotModel | None,
        problems: tuple[Diagnostic, ...],
        packages: Packages,
        config: Config,
        arguments: Mapping[str, str],
    ) -> None:
        self.entry = entry
        self.expansion = expansion
        self.document: Element | None = expansion.document
        self._robot = robot
        self.problems = problems
        self.packages = packages
        self.config = config
        self.arguments = arguments
        self.folders = Folders()

    @property
    def robot(self) -> RobotModel:
        """The robot. Only for rules that declare that they need it."""
        if self._robot is None:
            raise LookupError("a rule used the robot but does not declare that it needs it")
        return self._robot

    @property
    def root(self) -> Element:
        """The root of the expanded document. Only for rules that declare that they need it."""
        if self.document is None:
            raise LookupError("a rule used the document but does not declare that it needs it")
        return self.document

    def value_in_use(self, definition: Element) -> str | None:
        """The value of a top-level `<xacro:property>`: the override if there is one, else the written value.
        None for a property without a value, such as a block."""
        written = definition.attributes.get("value")
        name = definition.attributes.get("name", "")
        return written if written is None else str(self.expansion.overridden.get(name, written))

    def reports(self, code: str, origin: Origin) -> bool:
        """Whether findings of a code are wanted at a place. Others then need not report the same fault."""
        return self.config.wants(code, origin.span.file)

    def has(self, needs: str) -> bool:
        """Whether the facts that a rule needs are available."""
        match needs:
            case "source":
                return bool(self.sources)
            case "document":
                return self.document is not None and self.document.tag == "robot"
            case "robot":
                return self._robot is not None
            case "drive":
                return self._robot is not None and self.mobile_base is not None
        return False

    @cached_property
    def sources(self) -> tuple[SourceFile, ...]:
        """The entry and every file it includes, parsed and not expanded; the entry first."""
        return read_sources(self.entry, self.expansion.dependencies)

    @cached_property
    def unprefixed(self) -> tuple[Element, ...]:
        """The tags of xacro that are written without their prefix, in any of the files."""
        return tuple(unprefixed(self.sources))

    @cached_property
    def words(self) -> frozenset[str]:
        """Every name that is used in any of the files."""
        return frozenset().union(*(file.words for file in self.sources))

    @cached_property
    def is_part(self) -> bool:
        """Whether the file is meant to be included: a xacro file without a robot name and without links."""
        root = self.document
        return (
            root is not None
            and root.tag == "robot"
            and "name" not in root.attributes
            and root.find("link") is None
            and any(
                name.startswith("xmlns:xacro") for file in self.sources[:1] for name in file.root.attributes
            )
        )

    @cached_property
    def parameters(self) -> Mapping[str, frozenset[str]]:
        """The parameters of each macro, by macro name."""
        return {
            m.element.attributes["name"].removeprefix("xacro:"): frozenset(m.parameters)
            for file in self.sources
            for m in file.macros
        }

    @cached_property
    def unsure(self) -> frozenset[str]:
        errors: dict[tuple[Source, int], list[Origin]] = {}
        """Origins of errors, by the source and the offset of the start tag that each is in."""
        for problem in self.problems:
            if problem.is_error and problem.origin:
                span = problem.origin.span
                tag = span.source.data.rfind(b"<", 0, span.start + 1)
                errors.setdefault((span.source, tag), []).append(problem.origin)
        if not errors or self.document is None:
            return frozenset()
        names = set()
        for element in self.document.elements():
            if element.tag not in ("link", "joint"):
                continue
            if any(_is_unexpanded(e) or _touches(e, errors) for e in (element, *element.descendants())):
                names.add(element.attributes.get("name", ""))
                names.update(e.attributes.get("link", "") for e in element.elements("child"))
        return frozenset(names)

    @cached_property
    def elements(self) -> tuple[Element, ...]:
        """The root and every element of the result, in document order."""
        return tuple(in_order(self.root))

    @cached_property
    def _by_tag(self) -> Mapping[str, list[Element]]:
        found: dict[str, list[Element]] = {}
        for element in self.elements:
            if element.tag in found:
                found[element.tag].append(element)
            else:
                found[element.tag] = [element]
        return found

    def tagged(self, *tags: str) -> Iterator[Element]:
        """The elements of the result with one of these tags."""
        for tag in tags:
            yield from self._by_tag.get(tag, ())

    @cached_property
    def urdf(self) -> tuple[tuple[Element, Element], ...]:
        """Every element of URDF with its parent, without the content of extensions."""
        return tuple(_urdf(self.root))

    @cached_property
    def _elements_by_place(self) -> Mapping[tuple[str, int], Element]:
        return {(e.source.path, e.start): e for e in self.elements}

    def element_at(self, origin: Origin) -> Element | None:
        """The element of the result whose start tag contains a place, for fixes.

        A fix of an element that a macro made edits the macro's body. If not every call of the macro has the
        finding, `merge_findings` removes the fix.
        """
        if self.document is None:
            return None
        span = origin.span
        at = span.source.data.rfind(b"<", 0, span.start + 1)
        return self._elements_by_place.get((span.file, at))

    def call_at(self, span: Span) -> Element | None:
        """The source element that calls a macro at a place."""
        return self._calls.get((span.file, span.start))

    @cached_property
    def _calls(self) -> Mapping[tuple[str, int], Element]:
        return {(f.path, e.start): e for f in self.sources for e in f.xacro if e.tag.startswith("xacro:")}

    def replace_plain(self, origin: Origin, text: str, title: str, safe: bool) -> Fix | None:
        """A fix that replaces an attribute value. None if the value contains an expression."""
        if "$" in origin.span.text:
            return None
        edits = set_value(origin.span, text)
        return Fix(title, edits, safe) if edits else None

    def exchange(self, origin: Origin, name: str, other: str) -> Fix | None:
        """A fix that swaps the values of two attributes. None if one of them contains an expression."""
        element = self.element_at(origin)
        spans = element.attribute_spans() if element is not None else {}
        if name not in spans or other not in spans:
            return None
        first, second = spans[name][1], spans[other][1]
        if "$" in first.text + second.text or first.text == second.text:
            return None
        edits = (*set_value(first, second.text), *set_value(second, first.text))
        return Fix(f"swap {name} and {other}", edits, safe=False)

    def copy_visual(self, origin: Origin) -> Fix | None:
        """A fix that inserts a copy of a visual as collision after it. None if the visual is a mesh."""
        visual = self.element_at(origin)
        if visual is None or visual.find("geometry") is None:
            return None
        if any(e.tag == "mesh" for e in visual.descendants()):
            return None
        return copy_as_collision(visual)

    def insert_into(self, origin: Origin, text: str, title: str, safe: bool) -> Fix | None:
        """A fix that inserts a first child into the element at a place."""
        element = self.element_at(origin)
        return insert_child(element, text, title, safe) if element is not None else None

    @cached_property
    def frames(self) -> Mapping[str, SpatialFrame]:
        """The pose of each link in the root's frame with every joint at 0."""
        return rest_frames(self.robot)

    @cached_property
    def link_names(self) -> Candidates:
        return Candidates(self.robot.links)

    @cached_property
    def joint_names(self) -> Candidates:
        return Candidates(self.robot.joints)

    @cached_property
    def tree(self) -> FrameTree:
        return FrameTree(self.robot)

    @cached_property
    def bodies(self) -> Mapping[str, LinkBody]:
        return {name: body_of(link) for name, link in self.robot.links.items()}

    @cached_property
    def declared_drives(self) -> tuple[DeclaredDrive, ...]:
        """The plugins and controllers that drive the wheels."""
        return declared_drives(self.robot)

    @cached_property
    def controller_files(self) -> tuple[ControllerFile, ...]:
        """The controller parameter files that Gazebo plugins name."""
        return tuple(controller_files(self.robot))

    @cached_property
    def mobile_base(self) -> MobileBase | None:
        sides = [
            (side, joint.text)
            for c in self.declared_drives
            for side, joints in c.sides.items()
            for joint in joints
        ]
        if len(self.robot.joints) > MOST_JOINTS:
            return None
        return meant_base(self.tree, {name: side for side, name in sides if name in self.robot.joints})

    @cached_property
    def drive(self) -> DifferentialDrive | NoDrive | None:
        """The drive that KBot would simulate. None if it is not known, or if the robot has no drive."""
        is_meant = bool(self.declared_drives) or self.mobile_base is not None
        if self.unsure or not is_meant or len(self.robot.joints) > MOST_JOINTS:
            return None
        return find_drive(self.robot, self.tree)

    @cached_property
    def wheel_pairs(self) -> tuple[Pair, ...]:
        """The driven wheels. If KBot cannot drive the robot, the wheels that are meant to be driven."""
        if isinstance(self.drive, DifferentialDrive):
            return wheel_pairs(self.tree, self.drive)
        return self.level_pairs

    @cached_property
    def is_holonomic(self) -> bool:
        """Whether the robot also drives sideways, with wheels that do not form two sides."""
        running = drive_controller(self.declared_drives)
        return (running is not None and running.holonomic is not None) or isinstance(
            self.drive, HolonomicDrive
        )

    @cached_property
    def level_pairs(self) -> tuple[Pair, ...]:
        """Pairs of left and right wheels, side by side, that are meant to be driven. A holonomic base has
        none."""
        if self.is_holonomic:
            return ()
        pairs = self.mobile_base.pairs if self.mobile_base is not None else ()
        return tuple(pair for pair in pairs if pair.is_level and self.unsure.isdisjoint(pair.names))

    @cached_property
    def drive_findings(self) -> tuple[Diagnostic, ...]:
        """The faults in how plugins and controllers drive the robot."""
        return (
            *drive_findings(self.robot, self.declared_drives, self.drive, self.wheel_pairs),
            *plugin_findings(self.robot),
            *setting_findings(self.robot),
        )

    @property
    def base(self) -> MobileBase:
        """The mobile base. Only for rules that declare that they need a drive."""
        if self.mobile_base is None:
            raise LookupError("a rule used the drive but does not declare that it needs it")
        return self.mobile_base

    @cached_property
    def sure_links(self) -> tuple[Link, ...]:
        return tuple(link for name, link in self.robot.links.items() if name not in self.unsure)

    @cached_property
    def sure_joints(self) -> tuple[Joint, ...]:
        return tuple(joint for name, joint in self.robot.joints.items() if name not in self.unsure)


def _urdf(root: Element) -> Iterator[tuple[Element, Element]]:
    inner = [(root, iter(root.children))]
    while inner:
        parent, children = inner[-1]
        for child in children:
            if type(child) is Element and ":" not in child.tag:
                yield parent, child
                if child.children and child.tag in CHILDREN:
                    inner.append((child, iter(child.children)))
                    break
        else:
            inner.pop()


def _is_unexpanded(element: Element) -> bool:
    """Whether an expression of an attribute failed: its text then stays as it is."""
    return any("$" in value and ("${" in value or "$(" in value) for value in element.attributes.values())


def _touches(element: Element, errors: Mapping[tuple[Source, int], list[Origin]]) -> bool:
    """Whether an error is in the start tag of an element and comes from the same macro calls."""
    found = errors.get((element.source, element.start), ())
    return any(o.span.start < element.tag_end and o.call == element.call for o in found)
