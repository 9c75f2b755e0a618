"""Verbs that query a running KBot, with the words of `ros2`."""
