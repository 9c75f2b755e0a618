"""The verbs and options that the ROS wing adds."""
