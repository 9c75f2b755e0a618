"""The drive of a simulated robot: converts twist commands to wheel speeds as its own controller does."""
