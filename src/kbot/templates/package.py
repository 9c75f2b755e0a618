"""Makes a new robot package from the files of `robot/`, with its name and sizes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path

from kbot.brief import Brief
from kbot.model.load import load_robot
from kbot.text import KbotError
from kbot.text.file_kind import ROBOT, kind_of_file

TEMPLATE = Path(__file__).parent / "robot"
FILLED = ".in"
"""In files with this suffix `@NAME@` and the sizes are filled in, and the suffix is removed."""

GAP = 0.01
"""Distance between the body and a wheel, in m."""
_SHORTEST, _LONGEST = 0.002, 100.0
"""The range of all sizes in m."""
_BESIDE_A_WHEEL = 0.55 / math.sqrt(2.0)
"""Largest wheel radius, as a share of the body's length, with which the wheel ends ahead of the caster ball.
The ball has half the radius of the wheel and is 0.55 lengths behind the axle."""
_OF_NEW_ROBOT = ("urdf", "test", ".github", "README.md")
"""Files that fit only the robot of the template."""
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_DEVICE = re.compile(r"con|prn|aux|nul|com[0-9]|lpt[0-9]")
"""Names that a file cannot have on Windows."""
_NEEDED = re.compile(r"<[a-z]+_depend\b[^<>]*>([^<]+)<")
"""The packages that a manifest depends on."""
_NAMED_ROBOT = re.compile(r"<robot\b[^<>]*\sname\s*=")
"""The root of a robot. A file that is only included has no name."""
_LINK = re.compile(r"<link\b[^<>$]*\bname\s*=\s*[\"']([^\"'$]+)")
_PACKAGE = re.compile(r"<name>\s*([\w.-]+)\s*</name>")


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of a robot in metres. The body is above the axle, so that the wheels may also be below the body.
    `separation` is the distance between the middles of the wheels."""

    length: float = 0.3
    width: float = 0.2
    height: float = 0.08
    wheel_radius: float = 0.05
    wheel_width: float = 0.02
    separation: float = 0.24

    @classmethod
    def of(cls, length: float, width: float, height: float, wheel_radius: float, wheel_width: float) -> Sizes:
        """Sizes with a small gap between the body and the wheels."""
        return cls(length, width, height, wheel_radius, wheel_width, width + wheel_width + 2.0 * GAP)

    @property
    def middle(self) -> float:
        """Half of the robot's height in m."""
        return (self.wheel_radius + self.height) / 2.0

    @property
    def view_distance(self) -> float:
        """Distance in m of rviz's camera, whose angle of view is 45 degrees, that shows the whole robot."""
        behind = 0.7 * self.length  # the axle is 0.2 lengths ahead of the body's middle
        beside = (self.separation + self.wheel_width) / 2.0
        reach = math.hypot(behind, beside, max(self.middle, self.wheel_radius))
        return 1.2 * reach / math.sin(math.pi / 8.0)

    def check(self) -> None:
        """Raises KbotError: a robot with these sizes does not stand on two wheels and a caster."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not _SHORTEST <= value <= _LONGEST:
                name = field.name.replace("_", "-")
                raise KbotError(f"--{name} must be between {_SHORTEST:g} and {_LONGEST:g} m, not {value:g}")
        if self.separation / 2.0 < (self.wheel_width + self.width) / 2.0:
            least = self.width + self.wheel_width
            raise KbotError(
                f"the wheels would be inside the body: --separation must be at least {least:g} m (--width"
                f" {self.width:g} plus --wheel-width {self.wheel_width:g}), not {self.separation:g}"
            )
        between = self.separation - self.wheel_width
        most = min(self.length, max(_BESIDE_A_WHEEL * self.length, between))
        if self.wheel_radius > most:
            raise KbotError(
                f"--wheel-radius must be at most {most:g} m, not {self.wheel_radius:g}: the caster's"
                " diameter equals the wheel radius, and the caster must fit between the wheels or behind them"
            )


def check_name(name: str) -> None:
    """Raises KbotError: the name is not valid for a ROS package (REP 144), is that of a package that the new
    one depends on, or is not valid for a folder on Windows."""
    if _DEVICE.fullmatch(name):
        raise KbotError(f"'{name}' is not a valid package name: it is a device on Windows. Use {name}_robot")
    if name in _NEEDED.findall((TEMPLATE / f"package.xml{FILLED}").read_text(encoding="utf-8")):
        raise KbotError(
            f"'{name}' is not a valid package name: the new package depends on a package of this name. "
            f"Use {name}_robot"
        )
    if _NAME.fullmatch(name) and len(name) > 1:
        return
    near = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_").lstrip("0123456789_")
    hint = f", for example {near}" if _NAME.fullmatch(near) and len(near) > 1 else ""
    raise KbotError(
        f"'{name}' is not a valid package name. Use two or more lower-case letters, digits and single"
        f" underscores, beginning with a letter{hint}"
    )


@dataclass(frozen=True, slots=True, repr=False)
class NewPackage(Brief):
    """The files that `make_package` added and kept, and the robot of the launch files, as paths in the
    folder."""

    added: tuple[Path, ...]
    kept: tuple[Path, ...]
    robot: Path


def make_package(folder: Path, name: str, sizes: Sizes) -> NewPackage:
    """Make a package in a folder, or add what is missing in a folder that exists. Existing files are kept.

    If the folder has a robot in `urdf`, the launch files name it, and no other robot is added. If this fails,
    nothing is written.

    Raises:
        KbotError: the name or a size is invalid, or the folder cannot be written.
    """
    check_name(name)
    sizes.check()
    if (folder.exists() or folder.is_symlink()) and not folder.is_dir():
        raise KbotError(f"{folder} is not a folder. Choose another name, or another folder with --in DIR")
    name = _package_name(folder) or name
    existing = find_robot(folder, name)
    values = {"NAME": name, **_values(sizes), **_values_of_robot(folder, existing, name)}
    texts = dict(_filled_files(values))
    if existing is not None:
        texts = {file: text for file, text in texts.items() if file.parts[0] not in _OF_NEW_ROBOT}
    kept = tuple(file for file in texts if (folder / file).exists() or (folder / file).is_symlink())
    added = tuple(file for file in texts if file not in kept)
    robot = existing if existing is not None else Path("urdf", f"{name}.xacro")
    try:
        _add(folder, {file: texts[file] for file in added})
    except OSError as error:
        raise KbotError(f"cannot make {error.filename or folder}: {error.strerror}") from None
    return NewPackage(added, kept if existing is None else (existing, *kept), robot)


def find_robot(folder: Path, name: str) -> Path | None:
    """The robot in a package's folder `urdf`, as a path in the folder; None without one.

    Of several, it is the one with the package's name, or the first that no other file includes.
    """
    files = sorted(file for file in (folder / "urdf").glob("*") if kind_of_file(str(file)) == ROBOT)
    texts = {file: file.read_text(encoding="utf-8", errors="replace") for file in files if file.is_file()}
    robots = [file for file, text in texts.items() if _NAMED_ROBOT.search(text)]
    robots.sort(
        key=lambda file: (
            file.name.split(".")[0] != name,
            any(f"/{file.name}" in text or f'"{file.name}' in text for text in texts.values()),
        )
    )
    return robots[0].relative_to(folder) if robots else None


def _values(sizes: Sizes) -> dict[str, str]:
    values = {field.name.upper(): f"{getattr(sizes, field.name):.12g}" for field in fields(sizes)}
    return values | {"DISTANCE": f"{sizes.view_distance:.2g}", "MIDDLE": f"{sizes.middle:.2g}"}


def _values_of_robot(folder: Path, robot: Path | None, name: str) -> dict[str, str]:
    """What the templates need about the robot: the one in the folder, or the new one."""
    if robot is None:
        details = ": two driven wheels and a ball caster"
        plugins = {"CLASSIC": " control:=classic", "GZ": " control:=gz"}
        return {"ROBOT": f"{name}.xacro", "FRAME": "base_footprint", "DETAILS": details, **plugins}
    text = (folder / robot).read_text(encoding="utf-8", errors="replace")
    link = _LINK.search(text)
    frame = link.group(1) if link is not None else "base_footprint"
    with suppress(KbotError):  # a robot with errors has no tree yet
        frame = load_robot(folder / robot).require().root
    return {"ROBOT": robot.name, "FRAME": frame, "DETAILS": "", "CLASSIC": "", "GZ": ""}


def _package_name(folder: Path) -> str:
    """The name in a folder's package.xml, or an empty string."""
    manifest = folder / "package.xml"
    if not manifest.is_file():  # nor a pipe, which would never end
        return ""
    try:
        found = _PACKAGE.search(manifest.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return ""
    return found.group(1) if found is not None else ""


def _filled_files(values: dict[str, str]) -> Iterator[tuple[Path, str]]:
    """Each file of the package with its text."""
    for file in sorted(TEMPLATE.rglob("*")):
        if file.is_file():
            name, text = str(file.relative_to(TEMPLATE)), file.read_text(encoding="utf-8")
            if name.endswith(FILLED):
                name, text = _filled(name.removesuffix(FILLED), values), _filled(text, values)
            yield Path(name), text


def _add(folder: Path, texts: dict[Path, str]) -> None:
    """Write new files, all or none."""
    made: list[Path] = []
    try:
        for file, text in texts.items():
            for parent in reversed((folder / file).relative_to(folder.parent).parents[:-1]):
                if not (folder.parent / parent).is_dir():
                    (folder.parent / parent).mkdir()
                    made.append(folder.parent / parent)
            with (folder / file).open("x", encoding="utf-8", newline="\n") as opened:
                made.append(folder / file)
                opened.write(text)
    except (OSError, KeyboardInterrupt):
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir() if path.is_dir() else path.unlink()
        raise


def _filled(text: str, values: dict[str, str]) -> str:
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text
