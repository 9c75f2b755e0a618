"""What moves the robot in the page: joint sliders or the simulation."""
