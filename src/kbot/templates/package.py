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
"""Files with this suffix have `@NAME@` and the sizes filled in, and lose it."""

GAP = 0.01
"""Between the body and a wheel, in m."""
_SHORTEST, _LONGEST = 0.002, 100.0
_BESIDE_A_WHEEL = 0.55 / math.sqrt(2.0)
"""Of the body's length: the largest wheel that ends ahead of the ball, half as large and 0.55 lengths behind
the axle."""
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_DEVICE = re.compile(r"con|prn|aux|nul|com[0-9]|lpt[0-9]")
"""Names that are no file's on Windows, with any suffix or none."""
_NEEDED = re.compile(r"<[a-z]+_depend\b[^<>]*>([^<]+)<")
"""What a manifest depends on."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """In metres. The body stands above the wheels' axle, so that they may also stand beneath it;
    `separation` is between the middles of the wheels."""

    length: float = 0.3
    width: float = 0.2
    height: float = 0.08
    wheel_radius: float = 0.05
    wheel_width: float = 0.02
    separation: float = 0.24

    @classmethod
    def of(cls, length: float, width: float, height: float, wheel_radius: float, wheel_width: float) -> Sizes:
        """With the wheels a little beside the body."""
        return cls(length, width, height, wheel_radius, wheel_width, width + wheel_width + 2.0 * GAP)

    @property
    def middle(self) -> float:
        """Half the robot's height over the ground, m."""
        return (self.wheel_radius + self.height) / 2.0

    @property
    def view_distance(self) -> float:
        """From where rviz's camera, 45 degrees high, sees all of the robot with a little around it, m."""
        behind = 0.7 * self.length  # of the axle, which stands 0.2 lengths ahead of the body's middle
        beside = (self.separation + self.wheel_width) / 2.0
        reach = math.hypot(behind, beside, max(self.middle, self.wheel_radius))
        return 1.2 * reach / math.sin(math.pi / 8.0)

    def check(self) -> None:
        """Raises KbotError: these sizes make no robot that stands on two wheels and a caster."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not _SHORTEST <= value <= _LONGEST:
                name = field.name.replace("_", "-")
                raise KbotError(f"--{name} is between {_SHORTEST:g} and {_LONGEST:g} m, not {value:g}")
        if self.separation / 2.0 < (self.wheel_width + self.width) / 2.0:
            least = self.width + self.wheel_width
            raise KbotError(
                f"the wheels stand in the body: --separation is at least {least:g} m, that is --width"
                f" {self.width:g} and --wheel-width {self.wheel_width:g}; not {self.separation:g}"
            )
        between = self.separation - self.wheel_width
        most = min(self.length, max(_BESIDE_A_WHEEL * self.length, between))
        if self.wheel_radius > most:
            raise KbotError(
                f"--wheel-radius is at most {most:g} m, so that the caster, as high as that, has its place"
                f" between the wheels or behind them; not {self.wheel_radius:g}"
            )


def check_name(name: str) -> None:
    """Raises KbotError: ROS takes no package of this name (REP 144), nor one that needs itself, or Windows no
    folder."""
    if _DEVICE.fullmatch(name):
        raise KbotError(f"'{name}' is no name of a package: on Windows it is a device: {name}_robot")
    if name in _NEEDED.findall((TEMPLATE / f"package.xml{FILLED}").read_text(encoding="utf-8")):
        raise KbotError(f"'{name}' is a package that the new one needs: {name}_robot")
    if _NAME.fullmatch(name) and len(name) > 1:
        return
    near = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_").lstrip("0123456789_")
    hint = f": {near}" if _NAME.fullmatch(near) and len(near) > 1 else ""
    raise KbotError(
        f"'{name}' is no name of a package: two or more lower-case letters, digits and single _,"
        f" a letter first{hint}"
    )


def make_package(folder: Path, name: str, sizes: Sizes) -> list[Path]:
    """Make a package in a folder that does not exist yet: whole, or not at all. Its files, as paths in it.

    Raises:
        KbotError: the name or the sizes are no good, the folder exists, or it cannot be written.
    """
    check_name(name)
    sizes.check()
    if folder.exists() or folder.is_symlink():
        raise KbotError(f"{folder} exists, and is left as it is: name another with --in DIR, or move it away")
    values = {"NAME": name, **{f.name.upper(): f"{getattr(sizes, f.name):.12g}" for f in fields(sizes)}}
    values |= {"DISTANCE": f"{sizes.view_distance:.2g}", "MIDDLE": f"{sizes.middle:.2g}"}
    try:
        scratch = Path(tempfile.mkdtemp(prefix=f".{name}.", dir=folder.parent))
    except OSError as error:
        raise KbotError(f"{folder} cannot be made: {error.strerror}") from None
    try:
        written = [_write(file, scratch, values) for file in _files()]
        scratch.chmod(0o755)
        scratch.rename(folder)
    except OSError as error:
        raise KbotError(f"{folder} cannot be made: {error.strerror}") from None
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
