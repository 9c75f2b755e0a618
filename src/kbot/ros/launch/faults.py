"""What keeps a value of a launch file from being had."""

from __future__ import annotations


class Fault(Exception):
    """A value that cannot be computed.

    piece     the part of the text that is at fault
    is_limit  whether the file takes more work than it may; then all work that follows is refused too
    """

    def __init__(
        self, code: str, message: str, hint: str = "", piece: str = "", *, is_limit: bool = False
    ) -> None:
        super().__init__(message)
        self.code, self.message, self.hint, self.piece, self.is_limit = code, message, hint, piece, is_limit
