"""Keeps a model's key and the query of its address out of Inspect's logs.

Inspect logs each answer of a server literally, and some servers repeat the key.
"""

from __future__ import annotations

from typing import Any

from inspect_ai.model import Model, ModelCall, ModelOutput, get_model

from agents.vlm.record import url_without_secrets
from agents.vlm.redaction import Secrets

_DONE = "_er_gym_discreet"


def model_at_url(name: str, address: str | None) -> Model:
    """A model of Inspect at an address. The address's query is sent with each request and not
    logged.

    Raises:
        ValueError: the address holds a password, or a query that the provider cannot send.
    """
    if not address:
        return without_secrets(get_model(name))
    import httpx2

    url = httpx2.URL(address)
    if url.userinfo:
        raise ValueError(
            "--model-base-url holds a user or a password, which Inspect writes into its log; give "
            "the address alone, and the key in the provider's environment variable"
        )
    model = get_model(name, base_url=url_without_secrets(address), memoize=False)
    if url.query:
        client: Any = getattr(model.api, "client", None)
        if not hasattr(client, "with_options"):
            raise ValueError(
                f"{name} does not accept a query in --model-base-url; give the address alone"
            )
        model.api.client = client.with_options(default_query=dict(url.params))
    return without_secrets(model, address)


def without_secrets(model: Model, address: str = "") -> Model:
    """The model, with its key removed from answers and errors."""
    api: Any = model.api
    if getattr(api, _DONE, False):
        return model
    secrets = Secrets(api.api_key or "", address or api.base_url or "")
    ask = api.generate

    async def generate(*args: Any, **named: Any) -> Any:
        try:
            result = await ask(*args, **named)
        except Exception as error:
            _redact_error(error, secrets)
            raise
        if isinstance(result, tuple):
            output, call = result
            return _redact_output(output, secrets), _redact_call(call, secrets)
        return _redact_output(result, secrets)

    api.generate = generate
    setattr(api, _DONE, True)
    return model


def _redact_output(output: ModelOutput | Exception, secrets: Secrets) -> ModelOutput | Exception:
    if isinstance(output, Exception):
        _redact_error(output, secrets)
        return output
    said = output.model_dump()
    plain = secrets.redact_all(said)
    return output if plain == said else ModelOutput.model_validate(plain)


def _redact_call(call: ModelCall | None, secrets: Secrets) -> ModelCall | None:
    # In place, since Inspect may hold the object already.
    if call is not None and call.response is not None:
        call.response = secrets.redact_all(call.response)
    return call


def _redact_error(error: BaseException | None, secrets: Secrets) -> None:
    """Remove secrets from an exception and from its causes."""
    while error is not None:
        error.args = tuple(secrets.redact_all(each) for each in error.args)
        for name, value in vars(error).items():
            if isinstance(value, (str, dict, list)):
                setattr(error, name, secrets.redact_all(value))
        error = error.__cause__ or error.__context__
