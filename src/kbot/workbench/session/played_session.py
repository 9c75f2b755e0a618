"""A session that plays back a recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from kbot.workbench.playback.playback import PlayedRun
from kbot.workbench.playback.recorded_path import RecordedPath
from kbot.workbench.playback.recorded_run import DESCRIPTION, RecordedRun
from kbot.workbench.playback.recorded_world import RecordedWorld
from kbot.workbench.session.session import Session
from kbot.workbench.source.description_file import DescriptionFile
from kbot.workbench.timeline.marks import Marks

ONLY_FRAMES = "only frames and sensors are shown. Add the robot with --robot FILE."


def played_session(
    path: str,
    package_path: Sequence[str] = (),
    on_start: Callable[[PlayedRun], None] = lambda playback: None,
    robot: str = "",
    arguments: Mapping[str, str] | None = None,
    properties: Mapping[str, str] | None = None,
) -> Session:
    """Return a session that plays back a recording.

    Meshes are also searched in packages around the recording. `on_start` is called with what plays it back.
    `robot` is the file of a robot to display instead of the recorded one, with its `arguments` and
    `properties`. Without any robot, the frames and sensors are displayed.

    Raises:
        DescriptionError: its description does not make a robot.
        KbotError: there is no such recording, or it does not contain what is needed to display it.
    """
    run = RecordedRun(path, robot)
    world = RecordedWorld(run)
    around = str(Path(path).absolute().parent)
    session = Session(
        DescriptionFile(run.description, arguments, (*package_path, around), properties=properties),
        "play",
        lambda robot: PlayedRun(robot, run, world, on_start),
    )
    session.require_robot()
    session.played, session.marks = path, Marks(path)
    session.recorded_path = RecordedPath(run, session.shown.robot)
    broken = run.index.broken and f"{path} is incomplete: {run.index.broken}. The readable part is shown."
    unknown = "" if run.has_robot else f"{path} has no readable /{DESCRIPTION}: {ONLY_FRAMES}"
    if unknown:
        session.display_file.show_frames(session.shown.robot.root, run.index.topics)
    session.note = " ".join(note for note in (broken, unknown, world.note, session.marks.note) if note)
    session.topics.counts = False
    session.paused = False
    return session
