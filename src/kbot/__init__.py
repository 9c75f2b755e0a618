"""A robot description goes in, a robot that drives comes out."""
