"""What keeps a value of a launch file from being had."""

from __future__ import annotations


class Fault(Exception):
    """A value that cannot be had; `piece` is the part of the text that is at fault."""

    def __init__(self, code: str, message: str, hint: str = "", piece: str = "") -> None:
        super().__init__(message)
        self.code, self.message, self.hint, self.piece = code, message, hint, piece
