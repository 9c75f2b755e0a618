"""What rules look at: the sources, bodies, wheels and plugins of a description. No finding is made here."""
