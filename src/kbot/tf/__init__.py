"""Transforms of robots on /tf and /tf_static."""
