"""Runs that were set back to a state of before and went on another way; done again, they are set back too."""

from __future__ import annotations

from collections import defaultdict

from kbot.record.journal import read_command
from kbot.record.reader import Recording, Summary
from kbot.record.recorder import COMMANDS_TOPIC
from kbot.sim import Simulation
from kbot.sim.snapshots import State
from kbot.text import KbotError


class Branches:
    """The states that a run was set back to, kept as it passes by them again: each by how much had been
    journalled when it was taken, and its step."""

    def __init__(self, recording: Recording, summary: Summary) -> None:
        self._path = recording.path
        self._first = int(summary.notes.get("kbot", {}).get("first_note", "0"))
        self._wanted: dict[int, set[int]] = defaultdict(set)
        for entry in recording.entries():
            if entry.topic == COMMANDS_TOPIC:
                command = read_command(entry)
                if command["do"] == "restore":
                    self._wanted[command["noted"] - self._first].add(command["to"])
        self._states: dict[tuple[int, int], State] = {}
        self._count = 0

    def pass_by(self, simulation: Simulation) -> None:
        """To be called before each thing that was done: go up to what was saved before that, and save it."""
        for step in sorted(self._wanted[self._count]):
            if step >= simulation.steps:
                simulation.step(step - simulation.steps)
                self._states[self._count, step] = simulation.state()
        self._count += 1

    def go_back(self, simulation: Simulation, noted: int, step: int) -> None:
        """Raises KbotError: the run was set back to before its recording began."""
        state = self._states.get((noted - self._first, step))
        if state is None:
            at = f"step {step}, which is not in the recording"
            raise KbotError(f"{self._path} was set back to {at}: it cannot be done again")
        simulation.restore(state)
