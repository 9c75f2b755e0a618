"""Topics as the pages hear and speak on them."""
