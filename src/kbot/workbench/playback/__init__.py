"""Play back a recorded run in the page."""
