"""What moves the robot: joint sliders, or the simulation."""
