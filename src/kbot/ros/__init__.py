"""Everything that exists because of ROS. The core does not import it."""
