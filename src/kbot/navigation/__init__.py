"""Goals, paths, and the controllers and planner that get a robot there."""
