"""Drives a robot to goals with nothing but its own sensors: a way on a grid that moves with the robot, and a
controller that samples trajectories."""
