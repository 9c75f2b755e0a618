"""The log of the `websockets` library, without its tracebacks."""

from __future__ import annotations

import logging

from websockets.exceptions import WebSocketException

from kbot.text.complaints import Complaints


class _ToComplaints(logging.Handler):
    """Converts log records of `websockets` to complaints and faults."""

    def __init__(self, complaints: Complaints) -> None:
        super().__init__(logging.WARNING)
        self._complaints = complaints

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage()
        error = record.exc_info[1] if record.exc_info else None
        if error is not None and not isinstance(error, (OSError, WebSocketException)):
            self._complaints.fault("a connection", error)
        elif "handshake" not in text:
            # A client with a bad handshake gets an HTTP status. Older releases of websockets also log it.
            self._complaints.add(text)


def socket_logger(complaints: Complaints) -> logging.Logger:
    """The logger for `websockets.serve`."""
    logger = logging.Logger("kbot.sockets", logging.WARNING)  # not registered: it belongs to one server
    logger.addHandler(_ToComplaints(complaints))
    return logger
