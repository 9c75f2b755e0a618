"""A session that plays back a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from kbot.workbench.playback.playback import PlayedRun
from kbot.workbench.playback.recorded_path import RecordedPath
from kbot.workbench.playback.recorded_run import RecordedRun
from kbot.workbench.playback.recorded_world import RecordedWorld
from kbot.workbench.session.session import Session
from kbot.workbench.source.description_file import DescriptionFile
from kbot.workbench.timeline.marks import Marks


def played_session(
    path: str,
    package_path: Sequence[str] = (),
    on_start: Callable[[PlayedRun], None] = lambda playback: None,
) -> Session:
    """Return a session that plays back a recording.

    Meshes are also searched in packages around the recording. `on_start` is called with what plays it back.

    Raises:
        DescriptionError: its description does not make a robot.
        KbotError: there is no such recording, or it does not contain what is needed to display it.
    """
    run = RecordedRun(path)
    world = RecordedWorld(run)
    around = str(Path(path).absolute().parent)
    session = Session(
        DescriptionFile(run.description, None, (*package_path, around)),
        "play",
        lambda robot: PlayedRun(robot, run, world, on_start),
    )
    session.require_robot()
    session.played, session.marks = path, Marks(path)
    session.recorded_path = RecordedPath(run, session.shown.robot)
    broken = run.index.broken and f"{path} is incomplete: {run.index.broken}. The readable part is shown."
    session.note = " ".join(note for note in (broken, world.note, session.marks.note) if note)
    session.topics.counts = False
    session.paused = False
    return session
