"""Displays: which kinds there are, and their settings in files."""
