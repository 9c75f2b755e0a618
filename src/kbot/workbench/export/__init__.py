"""A robot as a file: a picture, a page, a model for other programs."""
