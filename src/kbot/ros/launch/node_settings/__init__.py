"""What nodes that KBot stands in for are told, in arguments and parameters: one file a kind of node."""
