"""The world of a recording: as built, with objects that were spawned and deleted, and their poses."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

from kbot.kinematics.transform import Transform
from kbot.messages import TFMessage
from kbot.model import RobotModel
from kbot.model.load import load_robot_text
from kbot.record.entry import RecordedMessage
from kbot.record.formats import read_text
from kbot.record.world_recorder import WORLD_TOPIC
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.tf.foreign_frames import read_transform
from kbot.workbench.playback.recorded_run import RecordedRun
from kbot.world import World, load_world
from kbot.world.things import read_sdf_model, thing
from kbot.world.world import Body

KEPT = 200
"""Most spawned models of each kind that are cached."""

Present = tuple[World | None, Mapping[str, RobotModel]]


class RecordedWorld:
    """What is in the world at the displayed time, and the poses received for it."""

    def __init__(self, run: RecordedRun) -> None:
        self._run = run
        self.note = ""
        """Why no world is displayed; empty if one is, or if none was recorded."""
        self._built: World | None = None
        world_name = run.facts.get("world")
        if world_name is not None:
            try:
                self._built = load_world(world_name)
            except (KbotError, OSError) as error:
                self.note = f"The recording's world '{world_name}' cannot be displayed: {error}"
        self._text = "[]"
        self.present: Present = (self._built, {})
        """The world, and the robots besides the one on display."""
        self._poses: dict[str, Transform] = {}

    def go_to(self, nanoseconds: int) -> None:
        """Find what is in the world at a time, and forget all poses. Raises KbotError if it cannot be
        read."""
        self._poses.clear()
        self._take(self._run.index.newest(WORLD_TOPIC, nanoseconds))

    def apply_changes(self, after: int, until: int) -> None:
        """Apply the changes between two times. Raises KbotError if they cannot be read."""
        for entry in self._run.index.between((WORLD_TOPIC,), after, until):
            self._take(entry)

    def _take(self, entry: RecordedMessage | None) -> None:
        text = "[]" if entry is None else read_text(entry)
        if self._built is None or text == self._text:
            return
        try:
            self.present = self._after(self._built, parse_json(text))
        except (ValueError, LookupError, TypeError) as error:
            raise KbotError(f"the world in {self._run.path} cannot be read: {error}") from None
        self._text = text

    def receive(self, message: TFMessage) -> None:
        """Receive true poses."""
        for stamped in message.transforms:
            pose = read_transform(stamped)
            if pose is not None:
                self._poses[stamped.child_frame_id] = pose

    def pose(self, name: str) -> Transform | None:
        """Return the true pose of something, or None if it was not recorded."""
        return self._poses.get(name)

    def poses(self) -> Iterator[Transform]:
        """Yield the poses of everything that moves, in the order of the page's scene."""
        world, others = self.present
        for body in world.bodies if world is not None else ():
            if not body.is_static:
                yield self._poses.get(body.name, body.pose)
        for name, robot in others.items():
            for link in robot.links:
                yield self._poses.get(f"{name}/{link}", Transform.identity())

    def _after(self, built: World, changes: list[dict[str, Any]]) -> Present:  # Any: JSON
        bodies, others = list(built.bodies), dict[str, RobotModel]()
        for change in changes:
            match change:
                case {"do": "spawn_thing"}:
                    bodies.append(_thing(json.dumps(change)))
                case {"do": "spawn_sdf"}:
                    bodies += _model(json.dumps(change))
                case {"do": "spawn_model", "robot": name, "description": text}:
                    others[name] = _robot(name, text)
                case {"do": "delete_model", "robot": name}:
                    others.pop(name, None)
                    bodies = [body for body in bodies if name not in (body.name, body.model)]
        return dataclasses.replace(built, bodies=tuple(bodies)), others


@lru_cache(KEPT)
def _thing(change: str) -> Body:
    """Return a spawned object. It is cached, because each journal message repeats all earlier changes."""
    values = parse_json(change)
    pose = Transform.from_xyz_rpy((values["x"], values["y"], values["z"]), (0.0, 0.0, values["yaw"]))
    return thing(values["kind"], values["name"], pose, values["size"] and tuple(values["size"]))


@lru_cache(KEPT)
def _model(change: str) -> tuple[Body, ...]:
    values = parse_json(change)
    name, is_confined = values["name"], values.get("is_confined", False)
    model = read_sdf_model(values["sdf"], name, is_confined=is_confined)
    return model.placed(name, Transform(values["matrix"]))[0]


@lru_cache(KEPT)
def _robot(name: str, description: str) -> RobotModel:
    return load_robot_text(description, f"{name}.urdf").require()
