"""Drives a robot to goals on a map: plans a path, follows it, and recovers."""
