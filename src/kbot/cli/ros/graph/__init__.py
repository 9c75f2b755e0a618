"""Verbs that query a running KBot, with the same commands as `ros2`."""
