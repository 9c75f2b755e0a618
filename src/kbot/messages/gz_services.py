"""What gz's services of a world are asked, as ros_gz_interfaces has it."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.messages.types import Pose, Time, UInt8, UInt32, UInt64

ORIGIN, START = Pose(), Time()


@dataclass(frozen=True, slots=True)
class Entity:
    """What gz speaks of, by its name; it has no number here."""

    id: UInt64 = 0
    name: str = ""
    type: UInt8 = 0


@dataclass(frozen=True, slots=True)
class EntityFactory:
    """One of `sdf` (a text, of URDF too), `sdf_filename` and `clone_name` says what is spawned."""

    name: str = ""
    allow_renaming: bool = False
    sdf: str = ""
    sdf_filename: str = ""
    clone_name: str = ""
    pose: Pose = ORIGIN
    relative_to: str = "world"


@dataclass(frozen=True, slots=True)
class WorldReset:
    all: bool = False
    time_only: bool = False
    model_only: bool = False


@dataclass(frozen=True, slots=True)
class WorldControl:
    """`multi_step` steps are done at once, and then it is paused."""

    pause: bool = False
    step: bool = False
    multi_step: UInt32 = 0
    reset: WorldReset = WorldReset()
    seed: UInt32 = 0
    run_to_sim_time: Time = START


@dataclass(frozen=True, slots=True)
class GzSpawnEntityRequest:
    entity_factory: EntityFactory = EntityFactory()


@dataclass(frozen=True, slots=True)
class GzDeleteEntityRequest:
    entity: Entity = Entity()


@dataclass(frozen=True, slots=True)
class SetEntityPoseRequest:
    entity: Entity = Entity()
    pose: Pose = ORIGIN


@dataclass(frozen=True, slots=True)
class ControlWorldRequest:
    world_control: WorldControl = WorldControl()
