"""Stand-ins for the nodes of other packages that a launch file starts."""
