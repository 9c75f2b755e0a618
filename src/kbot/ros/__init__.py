"""Everything that exists because ROS exists. The core does not import it."""
