"""Recordings of what a simulation said and was told."""
