"""The selection of findings: which codes are reported, in which files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from kbot.brief import Brief
from kbot.checks.former_codes import covers


@dataclass(frozen=True, repr=False)
class Config(Brief):
    """The configuration of a check. `folder` is the folder of the configuration file."""

    select: tuple[str, ...] = ("ALL",)
    ignore: tuple[str, ...] = ()
    per_file_ignores: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    baseline: str | None = None
    arguments: tuple[Mapping[str, str], ...] = ()
    folder: str = ""

    def wants(self, code: str, file: str = "") -> bool:
        """Whether a finding of this code in this file is reported. The longest matching prefix decides."""
        ignored = list(self.ignore)
        for pattern, codes in self.per_file_ignores.items():
            if file and self._fits(file, pattern):
                ignored += codes
        chosen = max((_weight(word, code) for word in self.select), default=-1)
        refused = max((_weight(word, code) for word in ignored), default=-1)
        return chosen > refused

    def _fits(self, file: str, pattern: str) -> bool:
        path = Path(file).absolute()
        names = [file, path.name, str(path)]
        if self.folder and path.is_relative_to(self.folder):
            names.append(path.relative_to(self.folder).as_posix())
        return any(fnmatch(name, pattern) for name in names)


def _weight(word: str, code: str) -> int:
    """How specific a match is: -1 for no match, 0 for "ALL", else the length of the matching prefix."""
    if word == "ALL":
        return 0
    return len(word) if code.startswith(word) or covers(word, code) else -1
