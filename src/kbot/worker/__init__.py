"""Starts processes. Some of them read untrusted files for a server, with limits on time and memory."""

from kbot.worker.worker import PEER_READING, READING, LimitExceeded, ProcessEnded, Worker, WorkerLimits

__all__ = ["PEER_READING", "READING", "LimitExceeded", "ProcessEnded", "Worker", "WorkerLimits"]
