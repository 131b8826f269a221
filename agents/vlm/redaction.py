"""Removes secrets from server output: an API key, a password, the values of a URL's query.

A server may repeat the key in an error, a header or a reply. Its output is redacted before it is
stored, shown or raised.
"""

from __future__ import annotations

import json
import logging
import re
from typing import Any
from urllib.parse import parse_qsl, quote, unquote, urlsplit

REDACTED = "***"
LONG = 8
"""Characters. A shorter secret occurs in too many words to be redacted everywhere."""
LOGS = (
    "httpcore2.connection",
    "httpcore2.http11",
    "httpcore2.proxy",
    "httpx2",
    "openai._base_client",
)
"""The loggers of the HTTP packages; some log the headers of answers."""
_LONG_VALUE = 12  # characters of a query's value: api-version=2024-10-21 is no secret


class Secrets:
    """The secrets of a server's settings.

    A key shorter than :data:`LONG`, such as ``none`` or ``x``, is redacted only after a word such
    as ``Bearer`` or ``api_key``.

    Args:
        key: the server's API key; "" for none.
        urls: addresses; their passwords and the long values of their queries are secrets.
    """

    def __init__(self, key: str, *urls: str) -> None:
        words, values = {key}, set[str]()
        for url in urls:
            try:
                place = urlsplit(url)
                words.add(unquote(place.password or ""))
                values.update(v for _, v in parse_qsl(place.query) if len(v) >= _LONG_VALUE)
            except ValueError:
                continue
        long = {each for each in words if len(each) >= LONG} | values
        short = {each for each in words if 0 < len(each) < LONG}
        # As plain text, in JSON and in a URL; longest first, since one may contain another.
        forms = {form for each in long for form in (each, json.dumps(each)[1:-1], quote(each, ""))}
        patterns = [re.escape(form) for form in sorted(forms, key=len, reverse=True)]
        told = r"((?:bearer|basic|key|token|authorization|password)(?: provided)?\W{1,6})"
        after = "|".join(map(re.escape, sorted(short, key=len, reverse=True)))
        self._anywhere = re.compile("|".join(patterns)) if patterns else None
        self._after = re.compile(rf"(?i:{told})(?:{after})(?!\w)") if after else None

    def redact(self, text: str) -> str:
        """The text without the secrets."""
        if self._anywhere is not None:
            text = self._anywhere.sub(REDACTED, text)
        if self._after is not None:
            text = self._after.sub(rf"\g<1>{REDACTED}", text)
        return text

    def redact_all(self, value: Any) -> Any:
        """A JSON value without the secrets in any string, field names included."""
        if isinstance(value, str):
            return self.redact(value)
        if isinstance(value, dict):
            return {self.redact_all(name): self.redact_all(each) for name, each in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.redact_all(each) for each in value]
        return value


class RedactingLogFilter:
    """Removes secrets from the log records of the HTTP packages until it is closed."""

    def __init__(self, secrets: Secrets) -> None:
        self._secrets = secrets
        for name in LOGS:
            logging.getLogger(name).addFilter(self)

    def filter(self, record: logging.LogRecord) -> bool:
        """Remove the secrets from a record; every record passes."""
        said = record.getMessage()
        plain = self._secrets.redact(said)
        if plain != said:
            record.msg, record.args = plain, ()
        return True

    def close(self) -> None:
        """Remove the filter from the loggers."""
        for name in LOGS:
            logging.getLogger(name).removeFilter(self)
