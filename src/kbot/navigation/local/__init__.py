"""Navigation without a map: a rolling grid of what the lidars detect, a cost-to-go on it, and a controller
that samples trajectories. `kbot.navigation.without_map` runs it in a simulation."""
