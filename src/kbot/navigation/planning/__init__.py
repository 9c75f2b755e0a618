"""Paths on a map: from a grid and two poses to a path that the robot can drive."""
