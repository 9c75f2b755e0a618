"""The language of `${…}`: Python's expressions, bounded, that compute and do nothing more."""
