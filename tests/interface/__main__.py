"""Renews the snapshot of the public interface: `python tests/interface`."""

import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).parents[1])  # the folder of this package, in place of its own

from interface import FOLDER, KINDS, text_of  # noqa: E402 - found from now on

for kind in KINDS:
    (FOLDER / f"{kind}.txt").write_text(text_of(kind), "utf-8", newline="\n")
