"""Time in the page: the last minutes, bookmarks, and recordings that a page starts."""
