"""Meshes for the page: which may be served, their bytes, and those of many triangles made lighter."""
