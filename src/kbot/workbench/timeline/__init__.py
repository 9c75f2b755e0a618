"""Time in the page: the last minutes, bookmarks, and recordings begun there."""
