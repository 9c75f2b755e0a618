"""Makes a new robot package from the files of `robot/`, with its name and sizes."""

from __future__ import annotations

import math
import re
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

from kbot.text import KbotError

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
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_DEVICE = re.compile(r"con|prn|aux|nul|com[0-9]|lpt[0-9]")
"""Names that a file cannot have on Windows."""
_NEEDED = re.compile(r"<[a-z]+_depend\b[^<>]*>([^<]+)<")
"""The packages that a manifest depends on."""


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


def make_package(folder: Path, name: str, sizes: Sizes) -> list[Path]:
    """Make a package in a folder that does not exist yet, and return its files as paths in it. If this fails,
    nothing is written.

    Raises:
        KbotError: the name or a size is invalid, the folder exists, or it cannot be written.
    """
    check_name(name)
    sizes.check()
    if folder.exists() or folder.is_symlink():
        raise KbotError(f"{folder} already exists. Choose another folder with --in DIR, or move it away")
    values = {"NAME": name, **{f.name.upper(): f"{getattr(sizes, f.name):.12g}" for f in fields(sizes)}}
    values |= {"DISTANCE": f"{sizes.view_distance:.2g}", "MIDDLE": f"{sizes.middle:.2g}"}
    try:
        scratch = Path(tempfile.mkdtemp(prefix=f".{name}.", dir=folder.parent))
    except OSError as error:
        raise KbotError(f"cannot make {folder}: {error.strerror}") from None
    try:
        written = [_write(file, scratch, values) for file in _files()]
        scratch.chmod(0o755)
        scratch.rename(folder)
    except OSError as error:
        raise KbotError(f"cannot make {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return written


def _files() -> Iterator[Path]:
    return (file for file in sorted(TEMPLATE.rglob("*")) if file.is_file())


def _write(file: Path, target: Path, values: dict[str, str]) -> Path:
    text = file.read_text(encoding="utf-8")
    name = str(file.relative_to(TEMPLATE))
    if name.endswith(FILLED):
        name = _filled(name.removesuffix(FILLED), values)
        text = _filled(text, values)
    written = target / name
    written.parent.mkdir(exist_ok=True)
    written.write_text(text, encoding="utf-8", newline="\n")
    return Path(name)


def _filled(text: str, values: dict[str, str]) -> str:
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text
