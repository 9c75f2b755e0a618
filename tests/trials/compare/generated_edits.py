"""Seeded edits of real descriptions: harmless ones, which change nothing that moves, and faults.

Each edit takes the texts of a robot by path and changes them in place.
"""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from kbot.model.load import SHIPPED_PACKAGE, load_robot
from kbot.text import Element, Source, parse_xml
from kbot.trials.compare.revisions import Description
from kbot.xacro import expand

Texts = dict[Path, str]


@dataclass(frozen=True)
class Robot:
    """A robot in a repository: the folder to copy, the robot's file there, and its arguments."""

    name: str
    folder: str
    file: str
    arguments: tuple[tuple[str, str], ...] = ()

    def source(self, shared: Path | None) -> Path:
        return (shared / "corpus" / "src" / self.folder) if shared else SHIPPED_PACKAGE

    def copy(self, shared: Path | None, to: Path) -> Description:
        shutil.copytree(self.source(shared), to, copy_function=shutil.copyfile)
        for folder in (to, *(path for path in to.rglob("*") if path.is_dir())):
            folder.chmod(0o755)
        return Description(str(to / self.file), str(to / self.file), dict(self.arguments))


KBOT = Robot("kbot", "kbot_description", "urdf/kbot.xacro", (("lidar", "true"),))
CORPUS = (
    Robot("burger", "ROBOTIS-GIT+turtlebot3", "turtlebot3_description/urdf/turtlebot3_burger.urdf"),
    Robot("kobuki", "yujinrobot+kobuki", "kobuki_description/urdf/kobuki_standalone.urdf.xacro"),
    Robot("linorobot2", "linorobot+linorobot2", "linorobot2_description/urdf/robots/2wd.urdf.xacro"),
    Robot("diffbot", "ros-mobile-robots+diffbot", "diffbot_description/urdf/diffbot.urdf.xacro"),
)


def texts_of(robot: Description) -> Texts:
    """The XML files that a robot is made from."""
    loaded = load_robot(robot.file, robot.values)
    assert not loaded.has_errors, loaded.diagnostics
    names = dict.fromkeys((robot.file, *loaded.expansion.dependencies))
    return {Path(name): Path(name).read_text() for name in names if not name.endswith(".yaml")}


def write(texts: Texts) -> None:
    for path, text in texts.items():
        path.write_text(text)


# --- harmless ------------------------------------------------------------------------------------


def _elements(text: str) -> list[Element]:
    root = parse_xml(Source("", text))
    return [root, *root.descendants()]


def _starts(text: str) -> list[int]:
    """Where a line begins whose first word is a tag that is not the root's."""
    inner = {element.start for element in _elements(text)[1:]}
    return [m.start() for m in re.finditer(r"^[ \t]*(?=<\w)", text, re.M) if m.end() in inner]


def _insert(line: str) -> Callable[[random.Random, Texts, Path], bool]:
    def edit(rng: random.Random, texts: Texts, path: Path) -> bool:
        text = texts[path]
        starts = _starts(text)
        if not starts:
            return False
        at = rng.choice(starts)
        texts[path] = text[:at] + line.format(rng.randrange(10**6)) + text[at:]
        return True

    return edit


def _replace_one(
    pattern: str, replacement: Callable[[random.Random, re.Match[str]], str]
) -> Callable[[random.Random, Texts, Path], bool]:
    def edit(rng: random.Random, texts: Texts, path: Path) -> bool:
        text = texts[path]
        comments = [m.span() for m in re.finditer(r"<!--.*?-->|<\?.*?\?>", text, re.S)]
        found = [
            m
            for m in re.finditer(pattern, text, re.M | re.S)
            if not any(a < m.end() and m.start() < b for a, b in comments)
        ]
        if not found:
            return False
        match = rng.choice(found)
        texts[path] = text[: match.start()] + replacement(rng, match) + text[match.end() :]
        return texts[path] != text

    return edit


def _colour(rng: random.Random, match: re.Match[str]) -> str:
    return 'rgba="{:.2f} {:.2f} {:.2f} 1"'.format(*(rng.random() for _ in range(3)))


def _rewritten(rng: random.Random, match: re.Match[str]) -> str:
    numbers = list(re.finditer(r"(?<![\w.])(-?)(\d+)\.(\d+)(?![\w.])", match[0]))
    if not numbers:
        return match[0]
    number = rng.choice(numbers)
    forms = (
        f"{number[0]}0",
        f"{number[1]}0{number[2]}.{number[3]}",
        f"{number[1]}{number[2]}{number[3]}e-{len(number[3])}",
    )
    return match[0][: number.start()] + rng.choice(forms) + match[0][number.end() :]


def _swapped(rng: random.Random, match: re.Match[str]) -> str:
    return f"{match[1]}{match[4]}{match[3]}{match[2]}"


def _rename(rng: random.Random, texts: Texts, path: Path) -> bool:
    """A new name for a property, with all its uses. The expansion stays the same."""
    defined = re.findall(r'<xacro:property name="(\w+)" value=', "".join(texts.values()))
    if not defined:
        return False
    name = rng.choice(defined)
    new = f"{name}_{rng.randrange(100)}"
    renamed = {
        file: re.sub(
            r"\$\{[^{}]*\}",
            lambda m: re.sub(rf"(?<![\w'.]){name}\b(?!')", new, m[0]),
            text.replace(f'<xacro:property name="{name}" value=', f'<xacro:property name="{new}" value='),
        )
        for file, text in texts.items()
    }
    before = {file: file.read_text() for file in texts}
    main = next(iter(texts))
    expansions = []
    try:
        for version in (texts, renamed):
            write(version)
            result = expand(main, dict(ARGUMENTS.get(str(main), ())))
            expansions.append(result.plain_text if result.ok else None)
    finally:
        write(before)
    if expansions[0] is None or expansions[0] != expansions[1]:
        return False
    texts.update(renamed)
    return True


ARGUMENTS: dict[str, tuple[tuple[str, str], ...]] = {}
"""The arguments of a robot by its file."""


def _swap_elements(rng: random.Random, texts: Texts, path: Path) -> bool:
    """Two neighbours in another order: links and joints, or the different parts of one."""
    text = texts[path]
    pairs = []
    for parent in _elements(text):
        children = list(parent.elements())
        for one, other in pairwise(children):
            whole = {"link", "joint"}
            parts = {"origin", "geometry", "mass", "inertia", "parent", "child", "axis", "limit", "dynamics"}
            parts |= {"visual", "collision", "inertial"}
            if {one.tag, other.tag} <= whole or ({one.tag, other.tag} <= parts and one.tag != other.tag):
                pairs.append((one, other))
    if not pairs:
        return False
    one, other = rng.choice(pairs)
    middle = text[one.end : other.start]
    texts[path] = (
        text[: one.start]
        + text[other.start : other.end]
        + middle
        + text[one.start : one.end]
        + text[other.end :]
    )
    return True


def _visual(rng: random.Random, texts: Texts, path: Path) -> bool:
    """A moved visual of a link that has a round collision."""
    text = texts[path]
    found = []
    for link in _elements(text):
        if link.tag != "link":
            continue
        inner = [e.tag for c in link.elements("collision") for e in c.descendants()]
        if "cylinder" in inner or "sphere" in inner:
            found += [visual for visual in link.elements("visual") if visual.find("origin") is None]
    if not found:
        return False
    at = rng.choice(found).tag_end
    texts[path] = f'{text[:at]}\n        <origin xyz="0 0 {rng.random():.3f}"/>{text[at:]}'
    return True


def _always(rng: random.Random, texts: Texts, path: Path) -> bool:
    """A link or joint in a condition that is always true."""
    text = texts[path]
    found = [e for e in _elements(text) if e.tag in ("link", "joint")]
    if not found or "xmlns:xacro" not in text:
        return False
    element = rng.choice(found)
    inner = text[element.start : element.end]
    wrapped = f'<xacro:if value="${{1 &lt; 2}}">\n    {inner}\n    </xacro:if>'
    texts[path] = text[: element.start] + wrapped + text[element.end :]
    return True


_ATTRIBUTE = r'[\w:]+="[^"<>]*"'
HARMLESS: dict[str, Callable[[random.Random, Texts, Path], bool]] = {
    "comment": _insert("  <!-- checked on the real robot, note {} -->\n"),
    "blank line": _insert("\n"),
    "unused property": _insert('  <xacro:property name="unused_{}" value="0.5"/>\n'),
    "indentation": _replace_one(
        r"^[ \t]*(?=<(link|joint|origin|mass|axis|parent)\b)", lambda r, m: m[0] + "   "
    ),
    "colour": _replace_one(r'rgba="[^"]*"', _colour),
    "gazebo colour": _replace_one(
        r"<material>Gazebo/\w+</material>", lambda r, m: "<material>Gazebo/Green</material>"
    ),
    "number": _replace_one(
        r'\b(xyz|rpy|radius|length|size|ixx|iyy|izz)="[^"${}]*\d\.\d[^"${}]*"|<mass value="\d+\.\d+"',
        _rewritten,
    ),
    "attributes": _replace_one(rf"(<(?!\?)[\w:]+ )({_ATTRIBUTE})(\s+)({_ATTRIBUTE})", _swapped),
    "line break": _replace_one(rf'(?<=") (?={_ATTRIBUTE})', lambda r, m: "\n        "),
    "quotes": _replace_one(r'(?<=[a-z]=)"([^"\'<>]*)"', lambda r, m: f"'{m[1]}'"),
    "expression": _replace_one(r"(?<!find )\$\{([\w*/+. -]+)\}", lambda r, m: f"${{({m[1]})}}"),
    "rename": _rename,
    "order": _swap_elements,
    "visual": _visual,
    "condition": _always,
}  # fmt: skip


def edit_harmlessly(rng: random.Random, texts: Texts, kind: str | None = None) -> str:
    """Make one harmless edit. Returns its kind."""
    while True:
        chosen = kind or rng.choice(list(HARMLESS))
        path = rng.choice(list(texts))
        is_plain = "xmlns:xacro" not in texts[path]
        if is_plain and chosen in ("unused property", "condition", "expression"):
            continue
        if HARMLESS[chosen](rng, texts, path):
            return chosen
        kind = None


# --- faults --------------------------------------------------------------------------------------

_N = r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
FAULTS: dict[str, str] = {
    "mass": rf'<mass value="({_N})"',
    "inertia": rf'<inertia [^>]*\bizz="({_N})"',
    "inertial origin": rf'<inertial>(?:\s|<!--[^<]*-->)*<origin [^>]*xyz="({_N}) ',
    "joint x": rf'<joint (?:(?!</joint>).)*?<origin [^>]*xyz="({_N}) ',
    "joint y": rf'<joint (?:(?!</joint>).)*?<origin [^>]*xyz="[^" ]+ ({_N}) ',
    "joint yaw": rf'<joint (?:(?!</joint>).)*?<origin [^>]*rpy="[^" ]+ [^" ]+ ({_N})"',
    "collision radius": rf'<collision(?:(?!</collision>).)*?<cylinder [^>]*radius="({_N})"',
    "axis": rf'<axis xyz="[^"]*\b({_N})"',
    "friction": rf"<mu1>({_N})</mu1>",
    "size": rf'<xacro:property name="(?:wheel|base|caster)[^"]*" value="({_N})"',
    "argument": rf'<xacro:arg name="(?:wheel|base)[^"]*" default="({_N})"',
    "speed limit": rf'<limit [^>]*velocity="({_N}|\$\{{[^{{}}]+\}})"',
    "effort limit": rf'<limit [^>]*effort="({_N}|\$\{{[^{{}}]+\}})"',
    "caster x": r'<xacro:property name="caster_wheel_joint_offset\w*" value="(\$\{[^{}]+\})"',
    "damping": rf'<dynamics damping="({_N})"',
    "acceleration": rf"<(?:wheelAcceleration|max_wheel_acceleration)>({_N})<",
    "update rate": rf"<(?:updateRate|update_rate)>({_N})<",
    "separation": r"<(?:wheelSeparation|wheel_separation)>(\$\{[^{}]+\})<",
    "diameter": r"<(?:wheelDiameter|wheel_diameter)>(\$\{[^{}]+\})<",
    "torque": r"<wheelTorque>(\$\{[^{}]+\})<",
    "base mass": r'<xacro:property name="\w*mass" value="(\$\{[^{}]+\})"',
    "moment": r'\bi(?:xx|yy)="(\$\{[^{}]+\})"',
    "mount": r'<joint (?:(?!</joint>).)*?<origin [^>]*xyz="(\$\{[^{}]+\})',
    "range": rf"<range>\s*<min>({_N})</min>",
    "noise": rf"<stddev>({_N})</stddev>",
    "joint side": r"<(?:leftJoint|left_joint)>(left_wheel_joint)<",
}
"""Patterns whose group is the value to change, by the kind of fault."""


def faulty(rng: random.Random, texts: Texts, kind: str) -> Iterator[tuple[Path, int, Texts]]:
    """Each way to make a fault of this kind, in random order: the file, the line, and the texts with it."""
    found = []
    for path, text in texts.items():
        comments = [m.span() for m in re.finditer(r"<!--.*?-->", text, re.S)]
        for match in re.finditer(FAULTS[kind], text, re.S):
            if not any(a <= match.start(1) < b for a, b in comments):
                found.append((path, match))
    rng.shuffle(found)
    for path, match in found:
        text, value = texts[path], match[1]
        if value.startswith("$"):
            changed = f"${{1.07*({value[2:-1]})}}"
        elif value == "left_wheel_joint":
            changed = "right_wheel_joint"
        else:
            changed = f"{float(value) * 1.07 or 0.0123:.6g}"
        line = text.count("\n", 0, match.start(1)) + 1
        yield path, line, {**texts, path: text[: match.start(1)] + changed + text[match.end(1) :]}
