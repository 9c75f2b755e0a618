"""Time in the page: the last minutes, recordings begun there, and recordings played."""
