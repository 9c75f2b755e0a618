"""Encodes messages as CDR, in ROS 1 format and as JSON, and handles the definitions in recordings."""
