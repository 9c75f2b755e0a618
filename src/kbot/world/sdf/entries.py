"""The models of an SDF file, nested as they are written."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from kbot.kinematics.transform import Transform
from kbot.text import Element
from kbot.world.sdf.frames import Frames


@dataclass(frozen=True, slots=True)
class SdfContext:
    """Where an element is: its file and SDF version, the files that include it, and the models around it."""

    file: str
    files: tuple[str, ...]
    version: tuple[int, ...]
    static: bool = False
    prefix: str = ""


@dataclass(frozen=True, slots=True)
class ModelEntry:
    """A model. `merged` are the models that a merging `<include>` made part of it, each with its context."""

    name: str
    model: Element
    placed_by: Element
    pose: Element | None
    offset: Transform
    frames: Frames
    nested: list[ModelEntry]
    context: SdfContext
    merged: list[tuple[Element, SdfContext]] = field(default_factory=list)

    def elements(self, tag: str) -> Iterator[tuple[Element, SdfContext]]:
        """The children of a tag, including those of merged models."""
        for model, context in ((self.model, self.context), *self.merged):
            for element in model.elements(tag):
                yield element, context
