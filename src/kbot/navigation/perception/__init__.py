"""What a robot finds out from its own sensors: obstacles, its pose, and whether it may drive on."""
