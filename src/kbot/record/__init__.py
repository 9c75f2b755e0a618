"""Recordings of messages and commands: write, read, cut, convert, play back and replay.

Names are imported on first use, because KBot checks whether a file is a recording before it shows a robot.
"""

from kbot.lazy_names import lazy_names, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.record.feed import Feed
    from kbot.record.formats import BrokenOff
    from kbot.record.index import open_index
    from kbot.record.reader import Recording, Summary
    from kbot.record.recorder import Recorder
    from kbot.record.writer import open_writer

_HOMES = {
    "BrokenOff": "formats",
    "Feed": "feed",
    "Recorder": "recorder",
    "Recording": "reader",
    "Summary": "reader",
    "open_index": "index",
    "open_writer": "writer",
}

__all__ = ["BrokenOff", "Feed", "Recorder", "Recording", "Summary", "open_index", "open_writer"]

__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
