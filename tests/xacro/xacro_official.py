"""Runs the official xacro in this process, for comparison tests."""

import contextlib
import io
import warnings
import xml.dom.minidom
import xml.parsers.expat
from pathlib import Path

import xacro


def expand_text(text: str, arguments: dict[str, str] | None = None, base: Path | None = None) -> str | None:
    """The output of the official package without the banner, or None if it raises an error."""
    try:
        with contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python warns about expressions such as `a is 0`
            document = xml.dom.minidom.parseString(text)
            xacro.init_stacks(str(base) if base else None)
            xacro.process_doc(document, mappings=dict(arguments or {}))
            return document.toprettyxml(indent="  ")
    except Exception:  # noqa: BLE001 - any exception is an error for its user
        return None
