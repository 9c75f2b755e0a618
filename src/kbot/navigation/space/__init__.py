"""The outline of a robot, and distances, regions and ways on grids of cells."""
