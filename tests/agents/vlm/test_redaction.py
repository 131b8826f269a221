"""Secrets are removed from a server's output, and other text stays."""

from __future__ import annotations

import json

import pytest

from agents.vlm.redaction import Secrets

KEY = "sk-test-4f1c9e0b7a2d"


@pytest.mark.parametrize("text", [KEY, f"x{KEY}y", f"Bearer {KEY}", json.dumps({"a": KEY})])
def test_a_key_is_struck_out_wherever_it_stands(text: str) -> None:
    assert Secrets(KEY).redact(text) == text.replace(KEY, "***")


def test_a_key_is_found_in_json_and_in_an_address() -> None:
    secrets = Secrets('sk/"quoted"+key')
    assert secrets.redact(json.dumps('sk/"quoted"+key')) == '"***"'
    assert secrets.redact("?key=sk%2F%22quoted%22%2Bkey") == "?key=***"


@pytest.mark.parametrize("key", ["a", "no", "end", "none", "EMPTY"])
def test_a_short_key_spoils_no_words(key: str) -> None:
    secrets = Secrets(key)
    for text in (f"{key} is a word, and an {key}", f"<DecisionMaking>{key}</DecisionMaking>", ""):
        assert secrets.redact(text) == text
    told = f"Incorrect API key provided: {key}."
    assert secrets.redact(told) == "Incorrect API key provided: ***."
    assert secrets.redact(f"{{'api_key': '{key}'}}") == "{'api_key': '***'}"
    assert secrets.redact(f"Authorization: Bearer {key}") == "Authorization: Bearer ***"


def test_an_address_holds_secrets_too() -> None:
    secrets = Secrets("", "http://me:pass-word-1@host/v1?api-version=1&code=long-enough-1")
    told = "pass-word-1 long-enough-1 api-version=1 me host"
    assert secrets.redact(told) == "*** *** api-version=1 me host"


def test_without_secrets_nothing_is_struck_out() -> None:
    assert Secrets("").redact("*** a Bearer b") == "*** a Bearer b"
    assert Secrets("", "http://[broken").redact("x") == "x"


def test_all_strings_of_a_value() -> None:
    value = {"a": [KEY, 1, None], KEY: {"b": (f"x {KEY}",)}}
    assert Secrets(KEY).redact_all(value) == {"a": ["***", 1, None], "***": {"b": ["x ***"]}}
