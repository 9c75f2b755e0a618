"""The drive of a simulated robot: from twist commands to wheel speeds, as its own controller drives."""
