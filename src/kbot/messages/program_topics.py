"""The topics of what the user's program prints, plots and draws."""

PRINTED = "/log"
DRAWN = "/draw"
PLOTTED = "/plot/"
"""Followed by the name of the plot."""


def is_program_topic(topic: str) -> bool:
    """Whether a program prints, plots or draws on a topic."""
    return topic in (PRINTED, DRAWN) or topic.startswith(PLOTTED)
