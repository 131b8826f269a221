"""Looks for secrets in what is given away: by their form, and by the values known here."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping

from agents.vlm.redaction import LONG, Secrets

_NAMES = re.compile(r"(?i)key|token|secret|passw|credential")
FORMS: Mapping[str, re.Pattern[str]] = {
    "an API key": re.compile(r"\b(?:sk|pk|rk|gsk|xai|r8)[-_][A-Za-z0-9_-]{20,}"),
    "a token of Hugging Face": re.compile(r"\bhf_[A-Za-z0-9]{20,}"),
    "a token of GitHub": re.compile(r"\b(?:gh[pousr]_[A-Za-z0-9]{30,}|github_pat_\w{30,})"),
    "a key of Google": re.compile(r"\bAIza[A-Za-z0-9_-]{30,}"),
    "a key of Amazon": re.compile(r"\b(?:AKIA|ASIA)[A-Z0-9]{16}\b"),
    "a header with a key": re.compile(r"(?i)\bbearer\s+[A-Za-z0-9+/_.=-]{20,}"),
    "a web token": re.compile(r"\beyJ[A-Za-z0-9_-]{10,}\.eyJ[A-Za-z0-9_-]{10,}"),
    "a private key": re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----"),
    "an address with a password": re.compile(r"[a-z][a-z0-9+.-]*://[^\s/:@]+:[^\s/@]+@"),
}
"""What a secret looks like, by what it is."""


def known_secrets(keys: Iterable[str] = ()) -> list[str]:
    """The values that must not be given away: those of environment variables whose names say so.

    Args:
        keys: names of further variables.
    """
    names = {name for name in os.environ if _NAMES.search(name)} | set(keys)
    values = {os.environ.get(name, "").strip() for name in names}
    return sorted(value for value in values if len(value) >= LONG)


def secrets_in(text: str, values: Iterable[str] = ()) -> Iterator[str]:
    """What kinds of secrets a text holds, in words; never the secrets themselves."""
    yield from (what for what, form in FORMS.items() if form.search(text))
    if any(Secrets(value).redact(text) != text for value in values):
        yield "the value of an environment variable whose name says that it is secret"
