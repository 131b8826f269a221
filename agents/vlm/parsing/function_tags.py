"""Rewrites calls such as ``<function=open>{"object": "Fridge"}</function>`` as tool calls in JSON.

Llama writes them so. Qwen3-Coder writes ``<parameter=object>Fridge</parameter>`` within them, and
Claude ``<invoke name="open"><parameter name="object">Fridge</parameter></invoke>``.
"""

from __future__ import annotations

import json
import re

_BEGIN = re.compile(r"<(?:function=|invoke name=)[\"']?([\w -]{1,40})[\"']?>")
_PARAMETER = re.compile(r"<parameter(?:=| name=)[\"']?([\w -]{1,40})[\"']?>([^<]*)")
_END = re.compile(r"</(?:function|invoke)>")


def tagged_calls(text: str) -> str:
    """The text with such calls as ``<tool_call>{…}</tool_call>``; in linear time."""
    before, *calls = _BEGIN.split(text)
    pairs = zip(calls[::2], calls[1::2], strict=True)
    return before + "".join(_rewritten(name, rest) for name, rest in pairs)


def _rewritten(name: str, rest: str) -> str:
    inside, *after = _END.split(rest, maxsplit=1)
    fields = {key.strip(): value.strip() for key, value in _PARAMETER.findall(inside)}
    arguments = json.dumps(fields) if fields else inside.strip() or "{}"
    named = f'{{"name": {json.dumps(name)}, "arguments": {arguments}}}'
    return f"<tool_call>{named}</tool_call>{''.join(after)}"
