"""The settings of a model agent: one validated YAML file. Imports no model.

er-gym's own files are ``configs/agents/NAME.yaml``. Every field has a default. Settings never hold
an API key; they name the environment variable that holds it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from agents.configs import StrictSettings


def _no_bool(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("give a number")
    return value


def _addresses(value: object) -> object:
    if isinstance(value, str):
        return value
    if not (isinstance(value, (list, tuple)) and value and all(map(_is_text, value))):
        raise ValueError("give the address of a server, or a list of addresses")
    return tuple(value)


def _is_text(value: object) -> bool:
    return isinstance(value, str) and value != ""


Positive = Annotated[int, BeforeValidator(_no_bool), Field(gt=0)]
Pixels = Annotated[int, BeforeValidator(_no_bool), Field(gt=0, le=8192)]
Seconds = Annotated[float, BeforeValidator(_no_bool), Field(gt=0, le=86_400)]
Dollars = Annotated[float, BeforeValidator(_no_bool), Field(ge=0, le=1_000_000)]


class Pictures(StrictSettings):
    """Which pictures are sent, and how.

    Attributes:
        format, quality: the file format; quality is JPEG's, 1 to 95.
        min_pixels, max_pixels: a picture with fewer or more pixels is scaled as Qwen's models
            expect, to sides that are multiples of 28, before it is sent.
        model_min_pixels, model_max_pixels: the bounds to which the model itself scales what it is
            sent, for a model in this process or one that er-gym serve starts; None for those above.
            A tuned model is sent pictures as training files have them, and scales them as it did
            when it was tuned.
        keep: how many of the last pictures of earlier turns stay in the conversation; None for all.
            Each older picture is replaced by a short text, which invalidates the server's prefix
            cache.
        views: whether the three pictures that ``observe`` takes are sent.
        width, height: the size of rendered frames in pixels; None for the suite's own size.
        noise: whether the model is shown noise in place of every picture: a blind copy of it, by
            which one can tell what its eyes are worth.
    """

    format: Literal["jpeg", "png"] = "jpeg"
    quality: int = Field(85, ge=1, le=95)
    min_pixels: Positive = 3_136
    max_pixels: Positive = 351_232
    model_min_pixels: Positive | None = None
    model_max_pixels: Positive | None = None
    keep: int | None = Field(None, ge=0)
    views: bool = True
    width: Pixels | None = None
    height: Pixels | None = None
    noise: bool = False

    @model_validator(mode="after")
    def _bounds_in_order(self) -> Pictures:
        for prefix, (least, most) in {
            "": (self.min_pixels, self.max_pixels),
            "model_": self.model_bounds,
        }.items():
            if least > most:
                raise ValueError(
                    f"{prefix}min_pixels {least} is more than {prefix}max_pixels {most}"
                )
        return self

    @property
    def model_bounds(self) -> tuple[int, int]:
        """The least and the most pixels of a picture as the model sees it."""
        return (
            self.min_pixels if self.model_min_pixels is None else self.model_min_pixels,
            self.max_pixels if self.model_max_pixels is None else self.model_max_pixels,
        )


class Prompts(StrictSettings):
    """Which prompts the model is given.

    Attributes:
        profile: a directory of ``configs/prompts``, or a path to one like it.
        language: ``en`` or ``zh``.
        dataset: a training file in the paper's format, whose texts are used instead.
        dialect: a dialect by name or folder (:mod:`er_gym.data.dialects`), whose texts are used
            instead: a model that was tuned on training files of a dialect plays with it.
    """

    profile: str = "default"
    language: Literal["en", "zh"] = "en"
    dataset: str = ""
    dialect: str = ""

    @model_validator(mode="after")
    def _one_source(self) -> Prompts:
        if self.dataset and self.dialect:
            raise ValueError("dataset and dialect are both given; give one of them")
        return self


class Sampling(StrictSettings):
    """Sampling parameters; ``max_tokens`` limits one reply, thoughts included."""

    temperature: float = Field(0.0, ge=0)
    top_p: float = Field(1.0, gt=0, le=1)
    max_tokens: Positive = 1024


class Reasoning(StrictSettings):
    """How a reasoning model's thoughts are handled.

    Attributes:
        effort: the reasoning effort sent to the server; "" for the server's default.
        in_history: whether earlier thoughts are sent back to the model; most servers ask to leave
            them out.
    """

    effort: Literal["", "none", "minimal", "low", "medium", "high"] = ""
    in_history: bool = False


class History(StrictSettings):
    """Which earlier turns of the conversation are sent with each turn.

    Attributes:
        trim: whether the oldest pictures, and after them the oldest words, are left out where the
            whole conversation is over a limit of the server: the length of its context, or a number
            of pictures. Otherwise the episode ends there. None for yes if the model is shown
            pictures, which fill a context soon. The record of each reply says what was left out.
    """

    trim: bool | None = None


class Matching(StrictSettings):
    """How a name that a model writes is matched with an object type.

    Attributes:
        fuzzy: the lowest spelling similarity of a match, 0 to 100.
        embeddings: a sentence-transformers model, by name or directory, for names that spelling
            does not match; "" for none.
        threshold: the lowest cosine similarity of a match by meaning.
    """

    fuzzy: float = Field(86.0, ge=0, le=100)
    embeddings: str = ""
    threshold: float = Field(0.7, ge=-1, le=1)


class Prices(StrictSettings):
    """US dollars per million tokens; ``cached_prompt`` defaults to ``prompt``."""

    prompt: Dollars = 0.0
    completion: Dollars = 0.0
    cached_prompt: Dollars | None = None


class Server(StrictSettings):
    """The address and limits of an OpenAI-compatible server, or of several with the same model.

    Attributes:
        base_url: such as ``http://127.0.0.1:8000/v1``; OpenAI's own if empty. A query string is
            sent with each request. Or a list of such addresses: each request goes to the server
            with the fewest under way (:mod:`agents.vlm.clients.endpoints`).
        key_from: the environment variable that holds the API key. If it is not set, no key is sent;
            local servers need none. All servers get the same.
        api_version: Azure's API version; if it is set, the server is taken for Azure's.
        timeout: seconds for one try, from the first byte sent to the last byte received.
        connect: the part of ``timeout`` for the connection, seconds.
        tries: the most tries of a request after a failure that may pass: no connection, 408, 409,
            425, 429, 5xx and broken answers. A request that times out is tried twice at most, since
            the server may charge for each try.
        requests_per_minute: the limit of each server over all episodes; None for no limit.
        max_tokens_field: the server's name for the limit of a reply.
        extra: further fields of the request body; null removes a field that would be sent.
    """

    base_url: Annotated[str | tuple[str, ...], BeforeValidator(_addresses)] = ""
    key_from: str = "OPENAI_API_KEY"
    api_version: str = ""
    timeout: Seconds = 60.0
    connect: Seconds = 10.0
    tries: Positive = 6
    requests_per_minute: Positive | None = None
    max_tokens_field: Literal["max_tokens", "max_completion_tokens"] = "max_tokens"
    extra: dict[str, Any] = Field(default_factory=dict)

    @property
    def base_urls(self) -> tuple[str, ...]:
        """The addresses that are given: none for OpenAI's own."""
        given = (self.base_url,) if isinstance(self.base_url, str) else self.base_url
        return given if any(given) else ()


class Local(StrictSettings):
    """How transformers runs a model in this process, or in Ray actors.

    Attributes:
        adapter: a directory with a LoRA adapter; "" for none.
        dtype, device_map, attention: arguments of ``from_pretrained``.
        batch: the largest number of episodes whose turns are generated together.
        wait: seconds that a batch waits for further requests, where conversations cannot join it
            later (:mod:`agents.vlm.clients.packed_rows`).
        reuse: whether what the model computed for the earlier turns of a conversation is kept for
            its next turn; it does not change a reply beyond rounding.
        actors: how many copies run on a Ray cluster (``--executor ray``) instead of in this
            process; 0 for none.
        actor_gpus, actor_cpus: what each copy asks the cluster for, may be fractions.
    """

    adapter: str = ""
    dtype: str = "auto"
    device_map: str = "auto"
    attention: str = ""
    batch: Positive = 8
    wait: float = Field(0.02, ge=0)
    reuse: bool = True
    actors: int = Field(0, ge=0)
    actor_gpus: float = Field(0.0, ge=0)
    actor_cpus: float = Field(1.0, ge=0)


class AgentSettings(StrictSettings):
    """The settings of a model agent.

    Attributes:
        sees: ``pictures``; or ``text``, for text-only models: the objects in view, in hand and
            within reach as text.
        decide: the form of a decision: ``tags``, a ``tools`` call, or ``json`` with a schema.
        seed: added to the episode's seed and sent with each request; None sends no seed.
    """

    sees: Literal["pictures", "text"] = "pictures"
    decide: Literal["tags", "tools", "json"] = "tags"
    seed: int | None = Field(0, ge=0)
    prompts: Prompts = Prompts()
    pictures: Pictures = Pictures()
    sampling: Sampling = Sampling()
    reasoning: Reasoning = Reasoning()
    history: History = History()
    matching: Matching = Matching()
    prices: Prices = Prices()
    server: Server = Server()
    local: Local = Local()

    @property
    def trims(self) -> bool:
        """Whether a conversation that is over a limit is shortened (``history.trim``)."""
        trim = self.history.trim
        return self.sees == "pictures" if trim is None else trim

    @property
    def obs_mode(self) -> str:
        """The observation mode that the agent needs of the environment."""
        if self.sees == "pictures":
            return "rgb"
        return "objects" if self.prompts.dialect else "text"

    @property
    def env(self) -> dict[str, Any]:
        """The arguments of the environment that the agent needs: observations and their size."""
        size = {"width": self.pictures.width, "height": self.pictures.height}
        wanted = {name: pixels for name, pixels in size.items() if pixels is not None}
        return {**wanted, "obs_mode": self.obs_mode}
