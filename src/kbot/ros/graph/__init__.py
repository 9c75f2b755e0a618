"""Queries of a running KBot from another process on this machine: server, discovery and client."""
