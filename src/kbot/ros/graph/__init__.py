"""A running KBot asked by another process of this machine: what serves it, how it is found, what asks."""
