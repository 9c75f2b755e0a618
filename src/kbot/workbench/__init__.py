"""The workbench: a page that shows a robot, drives it and knows its source lines, and its server."""
