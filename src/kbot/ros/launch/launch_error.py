"""The error for a value in a launch file that cannot be computed."""

from __future__ import annotations


class LaunchError(Exception):
    """A value that cannot be computed.

    piece     the part of the text that is wrong
    is_limit  whether the file exceeds the budget of work. All later work fails for the same reason.
    """

    def __init__(
        self, code: str, message: str, hint: str = "", piece: str = "", *, is_limit: bool = False
    ) -> None:
        super().__init__(message)
        self.code, self.message, self.hint, self.piece, self.is_limit = code, message, hint, piece, is_limit


class LaunchPackageError(LaunchError, KeyError):
    """A package that is not found. Launch files catch it as PackageNotFoundError, which is a KeyError."""
