"""Recordings of messages and commands: write, read, cut, convert, play back and replay.

Names are imported when they are first used: whether a file is a recording is asked before a robot is shown.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.record.feed import Feed
    from kbot.record.formats import BrokenOff
    from kbot.record.reader import Recording, Summary
    from kbot.record.recorder import Recorder
    from kbot.record.writer import open_writer

_HOMES = {
    "BrokenOff": "formats",
    "Feed": "feed",
    "Recorder": "recorder",
    "Recording": "reader",
    "Summary": "reader",
    "open_writer": "writer",
}

__all__ = ["BrokenOff", "Feed", "Recorder", "Recording", "Summary", "open_writer"]


def __getattr__(name: str) -> object:
    if name in _HOMES:
        from importlib import import_module  # names are imported when used: start-up time

        value: object = getattr(import_module(f"kbot.record.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'kbot.record' has no attribute '{name}'")
