"""Connections to other systems, one folder each."""
