"""The displays of the page: their kinds, and their settings in files."""
