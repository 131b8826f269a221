"""What an agent that speaks is: one YAML file, checked. Imports no model.

``configs/agents/NAME.yaml`` are those that come with er-gym; every field has a default. Keys are
never here: a setting names the environment variable that holds one.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator


def _no_bool(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("give a number")
    return value


Positive = Annotated[int, BeforeValidator(_no_bool), Field(gt=0)]
Pixels = Annotated[int, BeforeValidator(_no_bool), Field(gt=0, le=8192)]
Seconds = Annotated[float, BeforeValidator(_no_bool), Field(gt=0, le=86_400)]
Dollars = Annotated[float, BeforeValidator(_no_bool), Field(ge=0, le=1_000_000)]


class _Settings(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Pictures(_Settings):
    """What is seen, and how it is sent.

    Attributes:
        format, quality: of the files; quality is JPEG's, 1 to 95.
        min_pixels, max_pixels: a picture with fewer or more is scaled, as Qwen's models are fed:
            both sides multiples of 28.
        keep: how many pictures of earlier turns stay in the conversation, the last ones; all for
            None. Another becomes a few words, which costs a server what it remembered of the
            conversation.
        views: whether ``observe`` shows the three pictures that it takes.
        width, height: of what is drawn, pixels; the suite's own for None.
    """

    format: Literal["jpeg", "png"] = "jpeg"
    quality: int = Field(85, ge=1, le=95)
    min_pixels: Positive = 3_136
    max_pixels: Positive = 351_232
    keep: int | None = Field(None, ge=0)
    views: bool = True
    width: Pixels | None = None
    height: Pixels | None = None

    @model_validator(mode="after")
    def _bounds_in_order(self) -> Pictures:
        if self.min_pixels > self.max_pixels:
            raise ValueError(
                f"min_pixels {self.min_pixels} is more than max_pixels {self.max_pixels}"
            )
        return self


class Prompts(_Settings):
    """Which words the model is given.

    Attributes:
        profile: a directory of ``configs/prompts``, or the path of one.
        language: ``en`` or ``zh``.
        dataset: a training file in the paper's format, whose own words are used instead.
    """

    profile: str = "default"
    language: Literal["en", "zh"] = "en"
    dataset: str = ""


class Sampling(_Settings):
    """How the model chooses its words; ``max_tokens`` is of one reply, thoughts included."""

    temperature: float = Field(0.0, ge=0)
    top_p: float = Field(1.0, gt=0, le=1)
    max_tokens: Positive = 1024


class Reasoning(_Settings):
    """What is done with what a reasoning model thinks before it speaks.

    Attributes:
        effort: passed on to the server; "" for its own.
        in_history: whether earlier thoughts are given back to the model; most servers ask that they
            be left out.
    """

    effort: Literal["", "none", "minimal", "low", "medium", "high"] = ""
    in_history: bool = False


class Matching(_Settings):
    """How a name that a model writes becomes an object type.

    Attributes:
        fuzzy: how alike letters must be, 0 to 100.
        embeddings: a sentence-transformers model, by name or directory, to ask where letters do not
            help; "" for none.
        threshold: how alike meanings must be, cosine.
    """

    fuzzy: float = Field(86.0, ge=0, le=100)
    embeddings: str = ""
    threshold: float = Field(0.7, ge=-1, le=1)


class Prices(_Settings):
    """US dollars for a million tokens; ``cached_prompt`` as ``prompt`` where it is not given."""

    prompt: Dollars = 0.0
    completion: Dollars = 0.0
    cached_prompt: Dollars | None = None


class Server(_Settings):
    """Where an OpenAI-compatible server is, and how long requests wait for it.

    Attributes:
        base_url: such as ``http://127.0.0.1:8000/v1``; OpenAI's own where empty. A query string is
            sent with each request.
        key_from: the environment variable that holds the key. Without a value none is sent, which
            is right for servers of one's own.
        api_version: of Azure's; its presence says that the server is Azure's.
        timeout: seconds for one try, from the first byte sent to the last received.
        connect: seconds of these for a connection.
        tries: how often a request is sent when what goes wrong may pass: no connection, 408, 409,
            425, 429, 5xx and broken answers. A request that times out is sent twice at most, since
            the server may charge for each.
        requests_per_minute: at most so many, over all episodes; no limit for None.
        max_tokens_field: what the server calls the limit of a reply.
        extra: further fields of the request's body; null leaves one out that would be sent.
    """

    base_url: str = ""
    key_from: str = "OPENAI_API_KEY"
    api_version: str = ""
    timeout: Seconds = 60.0
    connect: Seconds = 10.0
    tries: Positive = 6
    requests_per_minute: Positive | None = None
    max_tokens_field: Literal["max_tokens", "max_completion_tokens"] = "max_tokens"
    extra: dict[str, Any] = {}


class Local(_Settings):
    """How transformers runs a model in this process.

    Attributes:
        adapter: a directory with a LoRA adapter; "" for none.
        dtype, device_map, attention: as ``from_pretrained`` takes them.
        batch: how many episodes' turns are worked out together.
        wait: seconds that a batch waits for more.
    """

    adapter: str = ""
    dtype: str = "auto"
    device_map: str = "auto"
    attention: str = ""
    batch: Positive = 8
    wait: float = Field(0.02, ge=0)


class AgentSettings(_Settings):
    """An agent that speaks.

    Attributes:
        sees: ``pictures``, or ``text`` for models without eyes: what is in view, in hand and within
            reach, in words.
        decide: how it says what it does: in ``tags``, by a ``tools`` call, or in ``json`` of a
            stated schema.
        seed: sent with each request, together with the episode's; not sent for None.
    """

    sees: Literal["pictures", "text"] = "pictures"
    decide: Literal["tags", "tools", "json"] = "tags"
    seed: int | None = Field(0, ge=0)
    prompts: Prompts = Prompts()
    pictures: Pictures = Pictures()
    sampling: Sampling = Sampling()
    reasoning: Reasoning = Reasoning()
    matching: Matching = Matching()
    prices: Prices = Prices()
    server: Server = Server()
    local: Local = Local()

    @property
    def obs_mode(self) -> str:
        """What it needs of the environment."""
        return "rgb" if self.sees == "pictures" else "text"
