"""Controllers that drive a robot along a path or to a pose, and one that stops it before obstacles."""
