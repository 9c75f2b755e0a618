"""Plays back a recorded run in the page."""
