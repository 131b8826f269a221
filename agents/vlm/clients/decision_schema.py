"""The request fields for decisions outside of tags: a tool call, or JSON with a schema."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from er_gym.tasks import verbs

TOOL = "act"

_ACTION = {
    "type": "string",
    "enum": [*verbs.OBJECT_VERBS, *verbs.BARE_VERBS],
    "description": "what to do",
}
_OBJECT = {
    "type": "string",
    "description": 'with which type of object; "" for ' + ", ".join(verbs.BARE_VERBS),
}
_THOUGHTS = {"type": "string", "description": "what leads to the action"}


def _object(**properties: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


REQUEST_FIELDS: Mapping[str, Mapping[str, Any]] = {
    "tags": {},
    "tools": {
        "tools": [
            {
                "type": "function",
                "function": {
                    "name": TOOL,
                    "description": "Do the next action.",
                    "parameters": _object(action=_ACTION, object=_OBJECT),
                },
            }
        ],
        "tool_choice": {"type": "function", "function": {"name": TOOL}},
    },
    "json": {
        "response_format": {
            "type": "json_schema",
            "json_schema": {
                "name": "decision",
                "strict": True,
                "schema": _object(thoughts=_THOUGHTS, action=_ACTION, object=_OBJECT),
            },
        }
    },
}
"""By ``AgentSettings.decide``: the fields of a request that ask for it, in OpenAI's terms. Thoughts
come first, so that the model writes them before it chooses the action."""
