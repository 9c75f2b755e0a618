"""Verbs that ask a running KBot, with the words of `ros2`."""
