"""`kbot sim`: its command, and runs without the page."""
