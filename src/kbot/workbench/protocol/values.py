"""Values that messages of both directions are made of, and the bounds of what a page may send."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal


@dataclass(frozen=True, slots=True)
class Range:
    """The finite numbers from `low` to `high` that a page may send."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Length:
    """The longest text, in characters, or list that a page may send."""

    most: int


ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh"]

Name = Annotated[str, Length(256)]
SettingsText = Annotated[str, Length(60_000)]
PathName = Annotated[str, Length(4096)]
Fields = Annotated[tuple[Name, ...], Length(12)]
"""What is plotted together."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where something was written: 1-based line and column, and how many characters of that line."""

    file: str
    line: int
    column: int
    length: int


@dataclass(frozen=True, slots=True)
class Shape:
    """A primitive or a mesh, in the frame of its link or of the world.

    `size`: box x, y, z; cylinder and capsule radius, length (along z); sphere radius; ellipsoid half
    axes; mesh scale x, y, z. `mesh` is the id to fetch as `/mesh/<id>`, empty where there is none.
    """

    kind: ShapeKind
    size: tuple[float, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    rgba: tuple[float, ...]
    mesh: str
    place: Place | None
