"""The Foxglove WebSocket protocol."""
