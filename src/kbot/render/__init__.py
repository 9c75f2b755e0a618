"""Draw robots, worlds and runs: pictures, GLB and plots."""
