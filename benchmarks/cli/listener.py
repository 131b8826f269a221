"""The socket of a server that a command runs."""

from __future__ import annotations

import socket

from benchmarks.cli.errors import BadInput

LOOPBACK = "127.0.0.1"


def listen(host: str, port: int) -> tuple[socket.socket, str]:
    """A listening socket, and its address as it stands in a URL: ``127.0.0.1:8010``.

    Raises:
        BadInput: nothing can listen there.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except OSError as error:
        raise BadInput(
            f"cannot listen on {host}:{port}: {error.strerror or error}; choose another --port"
        ) from None
    shown = f"[{host}]" if ":" in host else host
    return listener, f"{shown}:{listener.getsockname()[1]}"
