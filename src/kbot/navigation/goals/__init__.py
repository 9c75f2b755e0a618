"""Goals of a running simulation, with and without a map, and their topics and actions."""
