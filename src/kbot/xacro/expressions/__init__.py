"""The language of `${…}`: Python's expressions with bounded work, which only compute."""
