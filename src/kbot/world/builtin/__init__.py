"""The worlds that are known by a name: open ground, mazes, rooms, ramps and stairs, a line to follow."""
