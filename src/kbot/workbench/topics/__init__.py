"""Topics that pages subscribe to and publish."""
