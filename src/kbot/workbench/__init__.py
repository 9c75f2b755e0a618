"""The workbench: the server of the page that displays and drives a robot."""
