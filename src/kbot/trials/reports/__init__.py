"""Writes the results of trials: a table, JUnit XML, grades, and a page."""
