"""What a session offers to pages, such as worlds and whether the robot can drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from kbot.model import RobotModel
from kbot.workbench.driving.no_robot import NO_ROBOT
from kbot.workbench.protocol import About, WorldChoice
from kbot.workbench.source.shown import ShownDescription
from kbot.world import built_in
from kbot.world.world import World

Mode: TypeAlias = Literal["view", "sim", "play"]


@dataclass(frozen=True, slots=True)
class Offers:
    """What pages may request.

    `cannot_drive` returns why a robot cannot drive, or an empty string. `limits` returns its greatest forward
    speed in m/s and turning speed in rad/s. `worlds` returns the worlds to choose from, given the current one
    (`world_name`). `things` can be spawned.
    """

    cannot_drive: Callable[[RobotModel], str] = lambda robot: ""
    limits: Callable[[RobotModel], tuple[float, float]] = lambda robot: (0.0, 0.0)
    worlds: Callable[[str], tuple[WorldChoice, ...]] = lambda world_name: ()
    world_name: str = ""
    things: tuple[str, ...] = ()


def about(
    shown: ShownDescription,
    mode: Mode,
    world: World | None,
    offers: Offers,
    *,
    played: str,
    seed: int,
    folder: str,
    client: int,
) -> About:
    """Return the description of the session for a page."""
    linear, angular = offers.limits(shown.robot) if shown.has_robot else (0.0, 0.0)
    return About(
        file=shown.file,
        played=played,
        mode=mode,
        world=(built_in(offers.world_name) or offers.world_name)
        if offers.world_name
        else world.name
        if world
        else "",
        cannot_drive=offers.cannot_drive(shown.robot) if shown.has_robot else NO_ROBOT,
        linear_limit=linear,
        angular_limit=angular,
        files=shown.files,
        worlds=offers.worlds(offers.world_name),
        things=offers.things,
        seed=seed,
        folder=folder,
        client=client,
    )
