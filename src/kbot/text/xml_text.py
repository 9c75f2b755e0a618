"""Writes names and texts into XML and HTML. They may have characters that XML does not allow."""

from __future__ import annotations

import re
from html import escape
from xml.etree import ElementTree

_REFUSED = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What is not a character of XML 1.0: https://www.w3.org/TR/xml/#charsets. HTML does not allow it either."""


def allowed(text: str) -> str:
    """Replace characters that XML does not allow by visible escapes such as `\\x1b`."""
    return _REFUSED.sub(lambda match: ascii(match[0])[1:-1], text)


def escaped(text: str) -> str:
    """A text as content or attribute value of XML and HTML."""
    return escape(allowed(text))


def xml_document(root: ElementTree.Element) -> str:
    """The indented XML of a report, whose texts may have any characters."""
    for element in root.iter():
        element.attrib = {name: allowed(value) for name, value in element.attrib.items()}
        element.text = None if element.text is None else allowed(element.text)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
