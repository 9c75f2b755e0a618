"""A file that only ever grows by whole pieces: what does not fit is taken out again."""

from __future__ import annotations

import os


class WholeFile:
    """Unbuffered, so that what was written survives the process; a write that fails leaves no half."""

    def __init__(self, path: str) -> None:
        """Raises OSError: it exists already, or cannot be made."""
        self._descriptor = os.open(
            path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666
        )
        self._end = 0

    def write(self, data: bytes) -> int:
        """Append all of it. Raises OSError with the file as it was before."""
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._descriptor, view) :]
        except OSError:
            os.ftruncate(self._descriptor, self._end)
            raise
        self._end += len(data)
        return len(data)

    def tell(self) -> int:
        return self._end

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        os.close(self._descriptor)
