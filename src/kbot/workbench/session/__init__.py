"""A session: what all open pages share, and the commands that they send."""
