"""Facts that rules check: sources, bodies, meshes, folders and the URDF vocabulary. They make no findings."""
