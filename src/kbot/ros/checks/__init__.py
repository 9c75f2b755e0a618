"""Rules for launch files."""
