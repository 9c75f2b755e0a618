"""The rosbridge protocol."""
