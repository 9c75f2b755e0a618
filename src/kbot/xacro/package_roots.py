"""Whether a file lies in a package, for what may not name every file there is."""

from __future__ import annotations

from pathlib import Path

from kbot.xacro.packages import Packages, package_around, package_name


def lies_in_package(file: Path, uri: str, packages: Packages) -> bool:
    """Whether a file, its symbolic links followed, lies in the package that its URI names, or in another
    that is found."""
    scheme, _, rest = uri.partition("://")
    if scheme in ("package", "model"):
        folder = _found(packages, rest.partition("/")[0])
        if folder is not None and file.is_relative_to(folder.resolve()):
            return True
    # a workspace may be installed by links to its sources, each with its package.xml
    source = package_around(file.parent)
    installed = _found(packages, package_name(str(source))) if source else None
    return (
        source is not None
        and installed is not None
        and (installed / "package.xml").resolve() == (source / "package.xml").resolve()
    )


def _found(packages: Packages, name: str) -> Path | None:
    folder = packages.folder(name)
    return None if folder is None else Path(folder)
