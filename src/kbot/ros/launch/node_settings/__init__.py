"""Reads the settings of the nodes that KBot replaces, from arguments and parameters: a file for each kind."""
