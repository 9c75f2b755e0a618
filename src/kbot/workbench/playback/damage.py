"""Where a recording is damaged, and where it is whole next to that."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.record.formats import Index


@dataclass(frozen=True, slots=True)
class Damage:
    """From when on nothing can be read until when; nanoseconds of the recording's clock. `before` and `after`
    are the nearest moments that are whole, None where there is none."""

    start: int
    end: int
    before: int | None
    after: int | None

    def nearest(self, nanoseconds: int) -> int:
        """The moment to show instead of one within."""
        whole = [moment for moment in (self.before, self.after) if moment is not None]
        return min(whole, key=lambda moment: abs(moment - nanoseconds), default=nanoseconds)

    def told(self, first: int) -> str:
        """In words, by the time since `first`."""
        start, end = (self.start - first) * 1e-9, (self.end - first) * 1e-9
        return f"the recording is damaged from {start:.2f} s to {end:.2f} s"


def damage_at(index: Index, nanoseconds: int) -> Damage | None:
    """The damage that a moment lies in; None where it is whole. Raises KbotError: the file is gone."""
    span = index.damage(nanoseconds)
    if span is None:
        return None
    start, end = span
    return Damage(start, end, start - 1 if start > index.start else None, end if end <= index.end else None)
