"""What the open pages share: the robot on show, its offers, the commands to it."""
