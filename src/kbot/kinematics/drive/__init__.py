"""How a robot drives: its wheels, the controllers that command them, the drive they make, and its faults."""
