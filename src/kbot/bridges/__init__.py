"""A simulation as a peer of other systems: each bridge speaks one protocol."""
