"""Forms that change something: read, and only if they come from a page of this process."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Mapping
from urllib.parse import parse_qsl, urlsplit

from fastapi import Request

_MOST_BYTES = 8192
_MOST_FIELDS = 16
_KIND = "application/x-www-form-urlencoded"


class BadForm(Exception):
    """A request that is not answered.

    Attributes:
        status: HTTP's.
    """

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.status = status


class Forms:
    """Reads the forms of this process's pages.

    Args:
        most_bytes: of a form.

    Attributes:
        secret: is in every form of a page. No page of another origin can read it.
    """

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self.secret = secrets.token_urlsafe(24)

    async def read(self, request: Request) -> Mapping[str, str]:
        """The fields of a form.

        Raises:
            BadForm: another page sent it, or it is no form.
        """
        origin = urlsplit(request.headers.get("origin", ""))
        if origin.scheme not in ("http", "https") or origin.netloc != request.headers.get("host"):
            raise BadForm("the request does not come from a page of this server", 403)
        if request.headers.get("content-type", "").partition(";")[0].strip().lower() != _KIND:
            raise BadForm(f"send {_KIND}", 415)
        body = b""
        async for chunk in request.stream():
            body += chunk
            if len(body) > self._most_bytes:
                raise BadForm("the form is too long", 413)
        try:
            pairs = parse_qsl(body.decode(), True, errors="strict", max_num_fields=_MOST_FIELDS)
        except ValueError:
            raise BadForm("this is no form", 400) from None
        fields = dict(pairs)
        if len(fields) != len(pairs):
            raise BadForm("a field is there twice", 400)
        if not hmac.compare_digest(fields.get("secret", "").encode(), self.secret.encode()):
            raise BadForm("the page is of an earlier start of er-gym ui: load it again", 403)
        return fields
