"""Policies from ONNX files, and how they drive a robot."""
