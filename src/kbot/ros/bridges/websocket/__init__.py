"""Bridges over a WebSocket: the protocols of Foxglove and of rosbridge."""
