"""The workbench: the server of the page that shows and drives a robot."""
