"""Shared by the Foxglove and rosbridge bridges: a WebSocket server, and clients of it."""
