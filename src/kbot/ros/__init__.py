"""The ROS wing: everything that exists because ROS exists. The core does not import it."""
