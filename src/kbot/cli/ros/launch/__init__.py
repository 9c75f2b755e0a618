"""`kbot launch`: its command, and the text that it prints."""
