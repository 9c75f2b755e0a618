"""The description in the page: whose each line is, what its numbers are, and what the page writes into it."""
