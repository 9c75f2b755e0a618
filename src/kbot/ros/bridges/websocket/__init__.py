"""What the bridges over WebSocket share: Foxglove and rosbridge."""
