"""Messages as bytes and as JSON: CDR, ROS 1, and the definitions that recordings carry."""
