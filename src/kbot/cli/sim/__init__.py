"""`kbot sim`: its options, the drive to a goal, and how far a run is."""
