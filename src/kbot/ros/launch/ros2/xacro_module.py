"""The Python module `xacro` for launch files.

Names, arguments and results are those of xacro 1.14 (Noetic) and 2 (ROS 2): documents are those of
`xml.dom.minidom`, which launch files search, change and print.
"""

from __future__ import annotations

from collections.abc import Mapping
from optparse import OptionParser, Values
from typing import NoReturn
from weakref import WeakKeyDictionary
from xml.dom.expatbuilder import parseString
from xml.dom.minidom import Document

from kbot.ros.launch.commands import expand_within
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.text import Source, parse_xml, read_source
from kbot.xacro import Expansion

_UNNAMED = "the text given to xacro.parse"
"""The name of a text without a file, in errors."""
_EMPTY = "<robot/>"
"""Replaces a description that cannot be expanded at all. Its errors are reported."""


def xacro_functions(context: LaunchContext) -> dict[str, object]:
    """The content of the module, by name. The context learns which file each expanded text is from."""
    xacro = _Xacro(context)
    names = ("parse", "process_doc", "process_file", "process")
    return {
        **{name: getattr(xacro, name) for name in names},
        "process_args": process_args,
        "XacroException": LaunchError,
    }


def process_args(argv: list[str], require_input: bool = True) -> tuple[Values, str | None]:
    """The options and the file of a command line of xacro. `vars(options)` are keywords of `process_file`.

    Raises:
        LaunchError: L056 xacro does not have the option, L041 there is not exactly one file.
    """
    parser = _Parser()
    parser.add_option("-o", dest="output")
    parser.add_option("--deps", action="store_true", dest="just_deps", default=False)
    parser.add_option("-i", "--inorder", action="store_true", dest="in_order")
    parser.add_option("--root-dir", dest="root_dir")
    parser.add_option("-q", action="store_const", const=0, dest="verbosity")
    parser.add_option("-v", action="count", dest="verbosity")
    parser.add_option("--verbosity", type="int", dest="verbosity", default=1)
    words = [str(word) for word in argv]
    options, files = parser.parse_args([word for word in words if ":=" not in word])
    if len(files) != 1 and (files or require_input):
        raise LaunchError("L041", f"xacro takes one file, and the arguments name {len(files)}")
    pairs = (word.split(":=", 1) for word in words if ":=" in word)
    options.mappings = {name.strip(): value.strip() for name, value in pairs}
    options.in_order = True  # as in xacro, with or without the option
    return options, files[0] if files else None


class _Parser(OptionParser):
    def __init__(self) -> None:
        super().__init__(add_help_option=False)

    def error(self, msg: str) -> NoReturn:
        raise LaunchError("L056", f"xacro: {msg}")


class _Xacro:
    def __init__(self, context: LaunchContext) -> None:
        self.context = context
        self._parsed: WeakKeyDictionary[Document, tuple[str, str]] = WeakKeyDictionary()
        """The file of each document that `parse` read, and its XML at that time."""

    def parse(self, inp: object, filename: object = None) -> object:
        """The document of a text or an open file or, without either, of a file name. It is not expanded yet.

        A document is returned as it is.
        """
        if inp is None:
            path = str(filename)
            text = read_source(path).text
        elif isinstance(inp, str):
            path, text = "", inp
        elif hasattr(inp, "read"):
            data = inp.read()
            path, text = getattr(inp, "name", ""), data.decode() if isinstance(data, bytes) else data
        else:
            return inp
        known = self.context.descriptions.get(text)
        path = known.path if known else path if isinstance(path, str) else ""
        parse_xml(Source(path or _UNNAMED, text))  # for its errors, which have a place and a hint
        document = _document(text)
        self._parsed[document] = path, document.toxml()
        if path:
            self.context.descriptions[document.toxml()] = RobotDescription(path, {})
        return document

    def process_doc(self, doc: Document, mappings: Mapping[str, object] | None = None, **_: object) -> None:
        """Expand a document in place."""
        path, parsed = self._parsed.get(doc, ("", ""))
        text = doc.toxml()
        if not path or text != parsed:  # a launch file can also build or change a document
            path = scratch_file(text, ".xacro")
        expanded = self._expand(path, mappings)[0]
        while doc.firstChild is not None:
            doc.removeChild(doc.firstChild)
        for node in list(expanded.childNodes):
            doc.appendChild(node)

    def process_file(
        self, input_file_name: object, *, mappings: Mapping[str, object] | None = None, **_: object
    ) -> Document:
        """The expanded document of a file."""
        return self._expand(str(input_file_name), mappings)[0]

    def process(
        self,
        input_file_name: object,
        just_deps: bool = False,
        xacro_ns: bool = True,
        verbosity: int = 1,
        mappings: Mapping[str, object] | None = None,
    ) -> str:
        """The expanded text of a file or, with `just_deps`, the files that it includes."""
        _, expansion = self._expand(str(input_file_name), mappings)
        return " ".join(expansion.dependencies) if just_deps else expansion.text

    def _expand(self, path: str, mappings: Mapping[str, object] | None) -> tuple[Document, Expansion]:
        arguments = {str(name): str(value) for name, value in (mappings or {}).items()}
        expansion = expand_within(self.context.budget, path, arguments, self.context.packages)
        for diagnostic in expansion.diagnostics:
            self.context.note(diagnostic)
        document = _document(expansion.text or _EMPTY)
        self.context.descriptions[document.toxml()] = RobotDescription(path, arguments)
        return document, expansion


def _document(text: str) -> Document:
    """The document of a text. As in other readers of URDF, a prefix need not be declared."""
    return parseString(text, namespaces=False)
