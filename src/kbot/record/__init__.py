"""Recordings of what a simulation said and was told: written, read, cut, converted, and run again."""

from kbot.record.formats import BrokenOff
from kbot.record.reader import Recording, Summary
from kbot.record.recorder import Recorder
from kbot.record.writer import open_writer

__all__ = ["BrokenOff", "Recorder", "Recording", "Summary", "open_writer"]
