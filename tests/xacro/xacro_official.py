"""The official xacro, run in this process, for tests that compare with it."""

import contextlib
import io
import warnings
import xml.dom.minidom
import xml.parsers.expat
from pathlib import Path

import xacro


def expand_text(text: str, arguments: dict[str, str] | None = None, base: Path | None = None) -> str | None:
    """What the official package makes of a text, without a banner; None where it gives an error."""
    try:
        with contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Python, about such as `a is 0`
            document = xml.dom.minidom.parseString(text)
            xacro.init_stacks(str(base) if base else None)
            xacro.process_doc(document, mappings=dict(arguments or {}))
            return document.toprettyxml(indent="  ")
    except Exception:  # noqa: BLE001 - whatever it raises, it is an error to its user
        return None
