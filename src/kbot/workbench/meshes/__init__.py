"""Meshes for the page: which files may be served, their bytes, and simpler ones."""
