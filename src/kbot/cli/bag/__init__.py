"""`kbot bag`: inspect, convert, play back and replay recordings."""
