"""`kbot launch`: its options, and what it prints about a launch."""
