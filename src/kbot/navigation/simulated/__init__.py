"""A simulated robot as navigation sees it: how it moves, its shape, limits and lidars, and what drives it."""
