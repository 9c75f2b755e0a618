"""The vector environment: many robots at once, in several processes."""
