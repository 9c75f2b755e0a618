"""Publishes the values that the user's program plots, each on its own topic."""

from __future__ import annotations

import re
import reprlib
from numbers import Real

from kbot.messages.bus import Bus, Publisher
from kbot.messages.control import Float64
from kbot.messages.program_topics import PLOTTED
from kbot.text import KbotError

MOST = 100
"""Names. The page can subscribe to 256 topics, and the robot's own need some."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*")
LONGEST = 100
"""Characters of a name. ROS 2 limits a topic to 247, with `/plot/` and the namespaces of a bridge."""


class Plots:
    """Values over time by name. The page plots them, and recordings contain them."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._publishers: dict[str, Publisher[Float64]] = {}

    def add(self, name: str, value: float) -> None:
        """Publish a value on `/plot/NAME`.

        A value that is infinite or NaN, such as the distance to nothing, is a gap in the page's curve.

        Raises:
            KbotError: the name is not part of a topic name, there are too many names, or the value is not a
                number.
        """
        publisher = self._publishers.get(name) if isinstance(name, str) else None
        if not isinstance(value, Real):
            raise KbotError(
                f"plot {reprlib.repr(name)}: the value must be a number, not {reprlib.repr(value)}"
            )
        if publisher is None:
            publisher = self._advertise(name)
        try:
            publisher.publish(Float64(float(value)))
        except OverflowError:  # an integer of more than 308 digits
            raise KbotError(f"plot {reprlib.repr(name)}: {reprlib.repr(value)} is too large") from None

    def _advertise(self, name: object) -> Publisher[Float64]:
        if not (isinstance(name, str) and len(name) <= LONGEST and _NAME.fullmatch(name)):
            raise KbotError(
                f"a plot cannot be called {reprlib.repr(name)}: use at most {LONGEST} letters, digits and "
                "underscores, starting with a letter"
            )
        if len(self._publishers) >= MOST:
            raise KbotError(f"plot {name!r}: the limit of {MOST} plots is reached")
        # latched, so that the first value reaches those who subscribe to a new topic
        publisher = self._publishers[name] = self._bus.advertise(PLOTTED + name, Float64, latched=True)
        self._bus.announce()
        return publisher
