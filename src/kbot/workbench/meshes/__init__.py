"""Meshes for the page: which files it may load, their bytes, and simplified versions."""
