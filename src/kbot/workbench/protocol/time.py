"""Time: going back in it, through a recording, and recording it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kbot.workbench.protocol.values import Name, Range


@dataclass(frozen=True, slots=True)
class Seek:
    """Show the moment `at` seconds along the timeline: to this page alone, or where a recording is played to
    all."""

    at: Annotated[float, Range(0, 1e12)]
    type: Literal["seek"] = "seek"


@dataclass(frozen=True, slots=True)
class GoLive:
    """Show what is, and no longer what was."""

    type: Literal["go_live"] = "go_live"


@dataclass(frozen=True, slots=True)
class Resume:
    """Let the simulation go on from the moment that this page is shown, or the nearest one that was saved."""

    type: Literal["resume"] = "resume"


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Whether a recording that came to its end begins again."""

    loop: bool
    type: Literal["set_loop"] = "set_loop"


@dataclass(frozen=True, slots=True)
class AskTrail:
    """Say which way the robot took since the simulation was reset so many times."""

    resets: Annotated[float, Range(0, 1e12)]
    type: Literal["ask_trail"] = "ask_trail"


@dataclass(frozen=True, slots=True)
class Trail:
    """The way since so many resets, as far as it is kept: where the robot was, x and y in m of the world, at
    moments in s along the timeline. To the points of these numbers, from 0, it did not drive: it was put
    there."""

    resets: int
    at: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]
    jumps: tuple[int, ...]
    type: Literal["trail"] = "trail"


@dataclass(frozen=True, slots=True)
class Mark:
    """Bookmark the moment `at` seconds along the timeline, which is `time` by the simulation's clock."""

    at: Annotated[float, Range(0, 1e12)]
    time: Annotated[float, Range(-1e12, 1e12)]
    type: Literal["mark"] = "mark"


@dataclass(frozen=True, slots=True)
class NoteMark:
    """Write on a bookmark."""

    number: Annotated[float, Range(0, 1e15)]
    note: Name
    type: Literal["note_mark"] = "note_mark"


@dataclass(frozen=True, slots=True)
class RemoveMark:
    number: Annotated[float, Range(0, 1e15)]
    type: Literal["remove_mark"] = "remove_mark"


@dataclass(frozen=True, slots=True)
class Bookmark:
    """A moment that was marked, in seconds along the timeline and by the simulation's clock, and what was
    noted of it."""

    number: int
    at: float
    time: float
    note: str


@dataclass(frozen=True, slots=True)
class Bookmarks:
    """All of them, in the order of their moments."""

    all: tuple[Bookmark, ...]
    type: Literal["bookmarks"] = "bookmarks"


@dataclass(frozen=True, slots=True)
class RecordRun:
    """Begin or end a recording of the simulation, in a file that the server names."""

    on: bool
    type: Literal["record"] = "record"


@dataclass(frozen=True, slots=True)
class RecordingView:
    """A recording under way: its file, its bytes on disk so far, and the seconds of simulated time in it."""

    file: str
    bytes: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording has ended: its file, and the address that gives it, empty where it is too large."""

    file: str
    address: str
    type: Literal["recorded"] = "recorded"


@dataclass(frozen=True, slots=True)
class Timeline:
    """What there is to go back to, from `start` to `end` in seconds along a timeline that only grows, and
    what this page is shown of it: the moment `at`, or what is (`live`). With `played` it is that of a
    recorded file, whole. `paused` and `speed` are of now. Topics that are `silent` had said nothing until
    that moment. The page `asked` for a moment last, which may be before or after all there is."""

    start: float
    end: float
    at: float
    live: bool
    played: bool
    loop: bool
    paused: bool
    speed: float
    silent: tuple[str, ...]
    recording: RecordingView | None
    asked: float | None = None
    type: Literal["timeline"] = "timeline"
