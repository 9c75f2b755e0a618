"""Programs of the user's own beside KBot: found, started, watched, ended."""
