"""The HTTP and WebSocket server: who may come in, what pages say and are told."""
