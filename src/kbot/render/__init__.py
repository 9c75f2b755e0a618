"""Robots, worlds and runs as pictures, GLB and plots."""
