"""`kbot bag`: its commands, what `info` prints, and `play`."""
