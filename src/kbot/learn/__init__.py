"""Gymnasium environments, and the policies that are trained in them."""
