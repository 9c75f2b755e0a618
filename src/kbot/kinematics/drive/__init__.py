"""How a robot drives: what commands its wheels, the wheels, the drive that they make, and its faults."""
