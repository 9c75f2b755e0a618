"""Bridges to other systems, a folder for each."""
