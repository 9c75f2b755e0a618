"""Estimates a robot's true parameters from a recording of a drive."""
