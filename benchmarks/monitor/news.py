"""News of what changes, as server-sent events."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Awaitable, Callable

from fastapi import Request, Response
from fastapi.responses import StreamingResponse

_BEAT_SECONDS = 15.0
"""A line is sent at least so often, so that both sides notice a lost connection."""


def news(
    request: Request,
    closing: threading.Event,
    version: Callable[[], Awaitable[object]],
    look_seconds: float,
    data: Callable[[object], object] = lambda version: 1,
) -> Response:
    """An event for each change, until the browser leaves or ``closing`` is set.

    Args:
        request: asks for it.
        closing: set when the server is to end.
        version: what differs after a change.
        look_seconds: how often it is looked at.
        data: what an event says, of the version.
    """
    return StreamingResponse(
        _events(request, closing, version, look_seconds, data),
        media_type="text/event-stream",
        headers={"X-Accel-Buffering": "no"},
    )


async def _events(
    request: Request,
    closing: threading.Event,
    version: Callable[[], Awaitable[object]],
    look_seconds: float,
    data: Callable[[object], object],
) -> AsyncIterator[str]:
    yield "retry: 1000\n\n"
    last, silent = await version(), 0.0
    while not (closing.is_set() or await request.is_disconnected()):
        await asyncio.sleep(look_seconds)
        now = await version()
        silent += look_seconds
        if now != last:
            last, silent = now, 0.0
            yield f"event: change\ndata: {data(now)}\n\n"
        elif silent >= _BEAT_SECONDS:
            silent = 0.0
            yield ": still here\n\n"
