"""Reads the settings of the nodes that KBot replaces from arguments and parameters. Each kind has a file."""
