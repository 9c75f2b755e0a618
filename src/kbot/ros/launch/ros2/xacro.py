"""What launch files ask of the module `xacro`: a file of a robot expanded, at once or from a document."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.ros.launch.commands import expand_within
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.text import read_source


def xacro_functions(context: LaunchContext) -> dict[str, object]:
    """The module's functions by name; what they expand is known to the context as that file's robot."""
    xacro = _Xacro(context)
    return {name: getattr(xacro, name) for name in ("process_file", "process", "parse", "process_doc")}


class _Document:
    """What xacro.process_file and xacro.parse give, as far as launch files use it."""

    def __init__(self, text: str, path: str = "") -> None:
        self.text, self.path = text, path

    def toxml(self, *_: object, **__: object) -> str:
        return self.text

    toprettyxml = toxml


class _Xacro:
    def __init__(self, context: LaunchContext) -> None:
        self.context = context

    def process_file(
        self, path: object, mappings: Mapping[str, object] | None = None, **_: object
    ) -> _Document:
        arguments = {str(name): str(value) for name, value in (mappings or {}).items()}
        expansion = expand_within(self.context.budget, str(path), arguments, self.context.packages)
        for diagnostic in expansion.diagnostics:
            self.context.note(diagnostic)
        self.context.descriptions[expansion.text] = RobotDescription(str(path), arguments)
        return _Document(expansion.text)

    def parse(self, source: object, filename: object = None) -> _Document:
        """A document that is not expanded yet, of an open file or of one that is named."""
        text = source.read() if hasattr(source, "read") else read_source(str(filename)).text
        known = self.context.descriptions.get(text)
        return _Document(text, str(filename) if filename else known.path if known else "")

    def process_doc(
        self, document: _Document, mappings: Mapping[str, object] | None = None, **more: object
    ) -> None:
        document.text = self.process_file(document.path, mappings, **more).text

    def process(self, path: object, mappings: Mapping[str, object] | None = None, **more: object) -> str:
        return self.process_file(path, mappings, **more).text
