"""From twist commands to the speeds of drive wheels, as the description has its own controller drive."""
