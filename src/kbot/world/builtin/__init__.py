"""The built-in worlds: open ground, mazes, rooms, ramps, stairs, a line to follow."""
