"""Compares two robots: how their behaviour differs, and which edits of their sources are the causes."""
