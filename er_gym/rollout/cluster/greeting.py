"""Checks within seconds whether Ray answers at an address; Ray itself would wait for minutes."""

from __future__ import annotations

import os
import socket

PATIENCE = 5.0
"""Seconds in which a server must have answered."""
_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
_SETTINGS = b"\0\0\0\4\0\0\0\0\0"
"""A frame of HTTP/2: no settings; RFC 9113, section 6.5. gRPC, which Ray speaks, begins so."""
_KIND = 3
"""Where in a frame's head its kind is; 4 is that of settings."""


def problem_at(host: str, port: int, patience: float = PATIENCE) -> str:
    """Why no Ray server can be at an address, in words; empty if one may be.

    Args:
        host: a name or an IP address, IPv6 without brackets.
        port: of TCP.
        patience: seconds for each of: to connect, to answer.
    """
    try:
        connection = socket.create_connection((host, port), patience)
    except (OSError, OverflowError, UnicodeError) as error:
        return str(error)
    if os.environ.get("RAY_USE_TLS", "0") not in ("", "0"):
        connection.close()
        return ""  # it waits for a handshake with certificates, which is Ray's to do
    with connection:
        try:
            connection.sendall(_PREFACE + _SETTINGS)
            head = _read(connection, len(_SETTINGS))
        except TimeoutError:
            return f"it accepts connections and says nothing for {patience:g} s"
        except OSError as error:
            return f"it accepts connections and closes them: {error}"
    if not head:
        return "it accepts connections and closes them"
    if len(head) < len(_SETTINGS) or head[_KIND] != _SETTINGS[_KIND]:
        return "what answers there does not speak gRPC, as Ray does"
    return ""


def _read(connection: socket.socket, size: int) -> bytes:
    """So many bytes, or fewer where the server closes the connection before."""
    data = b""
    while len(data) < size and (more := connection.recv(size - len(data))):
        data += more
    return data
