"""Facts that rules look at: sources, bodies, wheels and plugins. No findings are made here."""
