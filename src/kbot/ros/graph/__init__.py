"""Queries of a running KBot by another process of this machine: server, discovery and client."""
