"""Save the text of the page's editor, without losing the changes of another program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from kbot.text import KbotError, read_source, rewrite, write_text
from kbot.workbench.protocol import SaveSource, SourceConflict, SourceSaved
from kbot.workbench.protocol.messages import MOST_TEXT, MOST_TEXTS
from kbot.workbench.source.merging import merge
from kbot.xacro.packages import is_shipped

SHIPPED_REASON = "this robot ships with KBot and cannot be changed. Work on a copy of its package"


def read_only_reason(file: str, text: str) -> str:
    """Return why a file of the description cannot be saved, or an empty string."""
    if is_shipped(file):
        return SHIPPED_REASON
    if len(text.encode()) > MOST_TEXT:
        return f"the file has more than {MOST_TEXT:,} bytes. Change it in another editor"
    if Path(file).exists() and not os.access(file, os.W_OK):
        return "you do not have permission to write this file"
    return ""


def save(message: SaveSource) -> SourceSaved | SourceConflict:
    """Write a text to its file, merged with what another program has changed in the meantime.

    Raises:
        KbotError: the file is read-only or cannot be written, or its folder is missing.
    """
    file, text = message.file, message.text
    require_valid(text)
    reason = read_only_reason(file, text)
    if reason:
        raise KbotError(reason)
    if not Path(file).exists():
        return _save_deleted(message)
    now = read_source(file).text
    merged = merge(message.was or "", text, now)
    if merged is None:
        return SourceConflict(file, now)
    if merged != now:
        rewrite({file: (now, merged)})
    return SourceSaved(file, text, merged)


def _save_deleted(message: SaveSource) -> SourceSaved | SourceConflict:
    """Create the file if the message asks for it."""
    file, text = message.file, message.text
    folder = Path(file).resolve().parent
    if not folder.is_dir():
        raise KbotError(f"the folder {folder} was deleted. Create it, then save {Path(file).name} again")
    if message.was is not None:
        return SourceConflict(file, None)
    write_text(file, text)
    return SourceSaved(file, text, text)


def require_valid(text: str) -> None:
    """Raise KbotError if a text cannot be encoded: JSON can contain half of a surrogate pair."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise KbotError(f"the text has an invalid character at position {error.start}") from None


def require_small(texts: Sequence[str]) -> None:
    """Raise KbotError if texts cannot be encoded, or are too large for one check."""
    for text in texts:
        require_valid(text)
    size = sum(len(text.encode()) for text in texts)
    if size > MOST_TEXTS:
        raise KbotError(
            f"the unsaved texts have {size:,} bytes: the limit of a check is {MOST_TEXTS:,}. Save some"
        )
