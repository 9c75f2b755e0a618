"""A session that plays a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from kbot.workbench.playback.playback import PlayedRun
from kbot.workbench.playback.recorded_run import RecordedRun
from kbot.workbench.playback.recorded_way import RecordedWay
from kbot.workbench.playback.recorded_world import RecordedWorld
from kbot.workbench.session.session import Session
from kbot.workbench.source.description import DescriptionFile
from kbot.workbench.timeline.marks import Marks


def played_session(
    path: str,
    package_path: Sequence[str] = (),
    attend: Callable[[PlayedRun], None] = lambda playback: None,
) -> Session:
    """A session that plays a recording; meshes are looked for in packages around it too. `attend` is told of
    what plays it.

    Raises:
        DescriptionError: its description makes no robot.
        KbotError: no such recording, or it does not hold what is needed to show it.
    """
    run = RecordedRun(path)
    world = RecordedWorld(run)
    around = str(Path(path).absolute().parent)
    session = Session(
        DescriptionFile(run.description, None, (*package_path, around)),
        "play",
        lambda robot: PlayedRun(robot, run, world, attend),
    )
    session.played, session.marks = path, Marks(path)
    session.way = RecordedWay(run, session.shown.robot)
    broken = run.index.broken and f"{path} is not whole: {run.index.broken}; what can be read is shown."
    session.note = " ".join(note for note in (broken, world.note, session.marks.note) if note)
    session.topics.counts = False
    session.paused = False
    return session
