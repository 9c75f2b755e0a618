"""Checks `package.xml` for the elements that catkin and colcon require."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.checks.config import Config
from kbot.checks.file_kinds import FileKind
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, Source, parse_xml
from kbot.text.diagnostic import ROS_PREFIX
from kbot.text.file_kind import PACKAGE
from kbot.xacro import Packages

_REQUIRED = ("name", "version", "description", "maintainer", "license")


def check_manifest(
    source: Source, arguments: Mapping[str, str], packages: Packages, config: Config
) -> tuple[list[Diagnostic], list[Source]]:
    """The findings in a package manifest, and the source that was read."""
    return _findings(source), [source]


def _findings(source: Source) -> list[Diagnostic]:
    try:
        root = parse_xml(source)
    except DescriptionError as error:
        return list(error.diagnostics)
    if root.tag != "package":
        return [
            Diagnostic(
                "K101",
                Severity.ERROR,
                f"{ROS_PREFIX}the root element is <{root.tag}>, not <package>",
                root.origin,
            )
        ]
    missing = [tag for tag in _REQUIRED if not _has_content(root.find(tag))]
    if not missing:
        return []
    message = f"{ROS_PREFIX}the package lacks " + ", ".join(f"<{tag}>" for tag in missing)
    return [
        Diagnostic(
            "K101", Severity.ERROR, message, Origin(root.origin.span), "catkin and colcon require them"
        )
    ]


def _has_content(element: Element | None) -> bool:
    return element is not None and bool(element.text.strip() or next(element.elements(), None))


PACKAGE_MANIFEST = FileKind(PACKAGE, check_manifest)
