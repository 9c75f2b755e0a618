"""What is drawn: links, joints and the world's bodies, each with the place it was written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kbot.workbench.protocol.values import Place, Shape


@dataclass(frozen=True, slots=True)
class InertiaView:
    """Mass in kg, and the solid box of that mass with the same principal moments of inertia."""

    mass: float
    box: tuple[float, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    place: Place | None


@dataclass(frozen=True, slots=True)
class LinkView:
    """A link; `parent` and `joint` are empty for the root."""

    name: str
    parent: str
    joint: str
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]
    inertia: InertiaView | None
    place: Place | None


@dataclass(frozen=True, slots=True)
class JointView:
    """A joint whose position is one number, about or along `axis` in the frame of its child. `lower` and
    `upper` are the slider's ends. `control` is what may be told to it here, `speed` the most it goes at in
    rad/s or m/s."""

    name: str
    kind: Literal["continuous", "revolute", "prismatic"]
    child: str
    axis: tuple[float, ...]
    lower: float
    upper: float
    mimics: str
    control: Literal["none", "position", "velocity"]
    speed: float
    place: Place | None


@dataclass(frozen=True, slots=True)
class BodyView:
    """A thing in the world and where it starts; a `moving` one has its pose in every state."""

    name: str
    moving: bool
    parts: tuple[Shape, ...]
    position: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """All that is drawn; states refer to it by `revision`, in the order of its links and joints.

    `world` is the frame that states have their poses in, `ground` the height the floor lies at; `radius` is
    that of a sphere around the robot and `centre` its middle in the root frame, at zero.
    """

    revision: int
    robot: str
    root: str
    world: str
    links: tuple[LinkView, ...]
    joints: tuple[JointView, ...]
    bodies: tuple[BodyView, ...]
    ground: float
    radius: float
    centre: tuple[float, ...]
    type: Literal["scene"] = "scene"


@dataclass(frozen=True, slots=True)
class Things:
    """The world's bodies are others, and all else of the scene is as it was."""

    revision: int
    bodies: tuple[BodyView, ...]
    type: Literal["things"] = "things"
