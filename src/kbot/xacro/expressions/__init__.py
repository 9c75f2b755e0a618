"""Evaluates the expressions of `${…}`: Python expressions with limited work and without side effects."""
