"""Messages to the page as JSON text."""

from __future__ import annotations

import dataclasses
import json

from kbot.workbench.protocol import FromServer, State

_STATE_FIELDS = tuple(field.name for field in dataclasses.fields(State))


def encode(message: FromServer) -> str:
    """One message as compact JSON."""
    if isinstance(message, State):  # fifty times a second, and nearly flat: no need to copy it deeply
        fields = {name: getattr(message, name) for name in _STATE_FIELDS}
    else:
        fields = dataclasses.asdict(message)
    return json.dumps(fields, separators=(",", ":"), allow_nan=False, default=dataclasses.asdict)
