"""Checks of launch files."""
