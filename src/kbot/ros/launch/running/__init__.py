"""Runs a staged launch: the robots, the stand-ins of known nodes, and the user's own programs."""
