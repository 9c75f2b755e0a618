"""What the page draws: the robot and its world as shapes in frames."""
