"""The command line: one module a verb, or a folder whose `command` it is."""
