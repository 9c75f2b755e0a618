"""Publishes the transforms of robots on /tf and /tf_static."""
