"""Runs a model with transformers in this process: Qwen2-VL, Qwen2.5-VL, Qwen3-VL and fine-tuned
variants; for text-only agents, any language model with a chat template.

What the model computes for the turns of a conversation is kept for its next turns
(:mod:`agents.vlm.clients.kv_cache`), unless ``local.reuse`` is off.
"""

from __future__ import annotations

import hashlib
import secrets
import sys
import threading
import time
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import jinja2
import torch
from transformers import DynamicCache

from agents.vlm.chat import (
    ConversationRefused,
    Message,
    Picture,
    Reply,
    Usage,
    pictures_of,
    template_message,
)
from agents.vlm.clients.batching import CLOSED, SteppedJobs, batches
from agents.vlm.clients.checkpoint import Checkpoint, error_summary, load
from agents.vlm.clients.kv_cache import (
    CachedTurns,
    ConversationCache,
    conversation_name,
    joined_past,
    memory_for,
)
from agents.vlm.clients.packed_rows import PackedModel, PackedRow, can_be_packed
from agents.vlm.clients.padded_batch import EncodedPrompt, PaddedBatch
from agents.vlm.clients.seeded_sampling import SeededSampling
from agents.vlm.clients.supervisor import AGAIN, RequestSupervisor
from agents.vlm.pictures import patches_of
from agents.vlm.settings import AgentSettings
from er_gym.data.pictures import open_picture
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.causes import CONTEXT, REQUEST

_THINK, _THOUGHT = "<think>", "</think>"
_SHORT = 32  # tokens
_LIBRARIES_OF_CUDA = ("mha_graph.execute", "CUDNN_STATUS", "CUBLAS_STATUS")
_ENOUGH_FOR_LIBRARIES = 1 << 30  # bytes of a GPU


@dataclass(frozen=True)
class Spoken:
    """A reply in tokens, for those who train the model that says it.

    Attributes:
        reply: the reply.
        prompt: the tokens that the model was given.
        said: the tokens of the reply, the one that ends it included.
        scores: (said,) the logarithm of the probability with which each was drawn; empty where that
            is not known.
        pictures: those of the prompt, in order.
    """

    reply: Reply
    prompt: Sequence[int]
    said: Sequence[int]
    scores: Sequence[float] = ()
    pictures: Sequence[Picture] = ()


class LocalClient:
    """Generates replies with a model in this process.

    Up to ``settings.local.batch`` waiting conversations are generated together. Batching does not
    change a reply beyond rounding: each conversation is masked from the others and sampled with its
    own seed. Pictures are resized by the rule of qwen-vl-utils within ``settings.pictures``, so
    each takes as many tokens as that package says.

    ``settings.sampling`` controls sampling. Of the model's own generation_config only the
    repetition penalty applies, as with servers.

    Args:
        path: a directory that ``save_pretrained`` wrote, which needs no network; or a model's name
            on the Hugging Face hub.
        settings: the agent's settings.
        supervisor: the run's request supervisor; a reply stops when its minutes are over. By
            default there is no limit.
        loaded: the model, where it is in memory already, as while it is trained; ``path`` is then
            only its name. Whoever changes its weights calls :meth:`forget`.
        scored: whether :meth:`spoken` says how likely each token was, where that is known.

    Attributes:
        identity: everything that the replies depend on, as JSON.

    Raises:
        ValueError: the model or adapter does not exist, cannot be loaded, or does not fit the
            settings.
    """

    def __init__(
        self,
        path: str,
        settings: AgentSettings,
        supervisor: RequestSupervisor | None = None,
        *,
        loaded: Checkpoint | None = None,
        scored: bool = False,
    ) -> None:
        if settings.decide == "tools":
            raise ValueError(
                "decide: tools needs a server; a model in this process takes tags or json"
            )
        self._name, self._settings, self._supervisor = (
            path,
            settings,
            supervisor or RequestSupervisor(),
        )
        loaded = loaded or load(path, settings)
        self._scored = scored
        self.identity = loaded.identity
        self._model, self._end_tokens = loaded.model, loaded.end_tokens
        self._tokenizer, self._template, self._image_processor = (
            loaded.tokenizer,
            loaded.template,
            loaded.image_processor,
        )
        config = self._model.config
        self._image_token = getattr(
            config, "image_token_id", None
        )  # the token where a picture goes
        self._context_length = getattr(
            config.get_text_config(), "max_position_embeddings", sys.maxsize
        )
        self._tokenizer_lock = threading.Lock()  # a tokenizer is not thread-safe
        self._closing = threading.Event()
        local = settings.local
        memory = memory_for(self._model) if local.reuse else 0
        self._kept = ConversationCache(memory) if memory else None
        self._packed: PackedModel | None = None
        self._jobs: SteppedJobs[EncodedPrompt, Any, Spoken]
        if self._kept is not None and can_be_packed(self._model):
            self._packed = PackedModel(
                self._model,
                self._image_token if loaded.image_processor else None,
                settings.sampling,
            )
            self._jobs = SteppedJobs(self._begun, self._next_tokens, self._ended, local.batch)
        else:
            self._jobs = batches(self._replies, local.batch, local.wait)

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The model's next turn.

        At a temperature above 0, the seed, ``settings.seed`` and the number of messages determine
        the sampling; without ``settings.seed`` each reply is sampled anew.

        Raises:
            ModelError: the conversation is too long for the memory.
            ConversationRefused: it is too long for the model, or a picture cannot be read.
            CannotGoOn: the model's chat template does not take such conversations, the device
                fails, or :meth:`close` has been called.
        """
        return self.spoken(messages, seed).reply

    def spoken(self, messages: Sequence[Message], seed: int) -> Spoken:
        """The model's next turn with its tokens; as :meth:`reply`."""
        if self._closing.is_set():
            raise CannotGoOn(CLOSED.message)
        start = time.monotonic()
        spoken = self._jobs.do(self._row(messages, seed))
        reply = replace(spoken.reply, seconds=time.monotonic() - start)
        return replace(spoken, reply=reply, pictures=pictures_of(messages))

    def forget(self) -> None:
        """Drop what is kept of conversations: memory is short, or the model's weights are others
        now."""
        if self._kept is not None:
            self._kept.clear()

    def close(self) -> None:
        """Stop at the next token and release the model; waiting callers get CannotGoOn."""
        self._closing.set()
        self._jobs.close()
        self._model = None
        self.forget()

    # -- conversation to tokens, in the caller's thread ------------------------------------------

    def _row(self, messages: Sequence[Message], seed: int) -> EncodedPrompt:
        text = self._prompt(messages)
        pictures = pictures_of(messages)
        digests = [picture.digest for picture in pictures]
        name = conversation_name(messages, seed)
        kept = self._kept.take(name) if self._kept is not None else None
        known = _grids_by_digest(kept)
        seen = {
            picture.digest: self._patches([picture])
            for picture in {
                each.digest: each for each in pictures if each.digest not in known
            }.values()
        }
        known |= {digest: grid for digest, (_, grid) in seen.items()}
        grids = torch.cat([known[each] for each in digests]) if pictures else None
        ids, places = self._with_image_tokens(self._ids(text), grids)
        most = self._settings.sampling.max_tokens
        if len(ids) + most > self._context_length:
            raise ConversationRefused(
                f"the conversation has {len(ids)} tokens, which with sampling.max_tokens {most} is "
                f"more than the {self._context_length} of {self._name}; lower pictures.keep",
                CONTEXT,
            )
        reused = kept.usable(ids, digests, places) if kept else 0
        new = [each for each, place in zip(pictures, places, strict=True) if place >= reused]
        pixels = [
            (seen[each.digest] if each.digest in seen else self._patches([each]))[0] for each in new
        ]
        return EncodedPrompt(
            ids=ids,
            pictures=digests,
            grids=grids,
            new_pixels=torch.cat(pixels) if pixels else None,
            new_pictures=len(new),
            seed=self._seed(seed, len(messages)),
            thinking=text.rstrip().endswith(_THINK),
            name=name,
            kept=kept if reused else None,
            reused=reused,
        )

    def _prompt(self, messages: Sequence[Message]) -> str:
        """The conversation in the model's chat format, up to the model's turn."""
        effort = self._settings.reasoning.effort
        thinks = {"enable_thinking": effort != "none"} if effort else {}
        try:
            text: str = self._tokenizer.apply_chat_template(
                [self._turn(message) for message in messages],
                chat_template=self._template,
                tokenize=False,
                add_generation_prompt=True,
                **thinks,
            )
        except (jinja2.TemplateError, TypeError) as error:
            raise CannotGoOn(
                f"{self._name}: its chat template does not accept this conversation: "
                f"{error_summary(error)}"
            ) from None
        return text

    def _turn(self, message: Message) -> dict[str, Any]:
        parts = list(message.parts)
        if message.reasoning and self._settings.reasoning.in_history:
            # In the text: templates differ in how they take thoughts separately, and most do not
            # take them at all. Templates that drop earlier thoughts find them here too.
            parts.insert(0, f"{_THINK}\n{message.reasoning}\n{_THOUGHT}\n")
        return template_message(message.role, parts)

    def _patches(self, pictures: Sequence[Picture]) -> tuple[torch.Tensor, torch.Tensor]:
        if self._image_processor is None:
            raise CannotGoOn(
                f"{self._name} was loaded without vision, since the agent's setting sees is text, "
                "but the conversation has a picture"
            )
        try:
            return patches_of(
                self._image_processor,
                [open_picture(each.data) for each in pictures],
                self._settings.pictures.model_bounds,
            )
        except (OSError, ValueError) as error:
            raise ConversationRefused(
                f"a picture cannot be processed: {error_summary(error)}", REQUEST
            ) from None

    def _with_image_tokens(
        self, ids: Sequence[int], grids: torch.Tensor | None
    ) -> tuple[list[int], list[int]]:
        """The tokens, with each picture's token repeated once per merged patch; and where the
        tokens of each picture begin."""
        counts: list[int] = []
        if grids is not None:
            counts = (grids.prod(dim=1) // self._image_processor.merge_size**2).tolist()
        if ids.count(self._image_token) != len(counts):
            raise ConversationRefused(
                f"the conversation has {len(counts)} pictures and "
                f"{ids.count(self._image_token)} places for them; "
                "no words of it may be the model's own marks",
                REQUEST,
            )
        found: list[int] = []
        places: list[int] = []
        for each in ids:
            if each == self._image_token:
                count = counts[len(places)]
                places.append(len(found))
                found += [each] * count
            else:
                found.append(each)
        return found, places

    def _seed(self, episode: int, messages: int) -> int:
        """The seed of one reply. With the episode's seed, all turns would use the same random
        numbers."""
        if self._settings.seed is None:
            return secrets.randbits(63)
        text = f"{self._settings.seed} {episode} {messages}"
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")

    # -- tokens to replies, in the thread of the jobs: step by step ------------------------------

    def _begun(self, prompt: EncodedPrompt) -> PackedRow:
        assert self._packed is not None
        return self._packed.begin(prompt, scored=self._scored)

    def _next_tokens(self, rows: Sequence[PackedRow]) -> None:
        assert self._packed is not None
        self._go_on()
        try:
            self._packed.step(rows)
        except RuntimeError as error:
            self.forget()
            raise _explained(error, [row.prompt for row in rows]) from None

    def _ended(self, row: PackedRow) -> Spoken | None:
        """The reply, once it has ended."""
        full = len(row.said) == self._settings.sampling.max_tokens
        if not (full or (row.said and row.said[-1] in self._end_tokens)):
            return None
        if self._kept is not None:
            self._kept.keep(row.prompt.name, row.turns())
        assert self._packed is not None
        self._packed.ended(row)
        reply = self._reply(row.prompt, row.said)
        return Spoken(reply, row.prompt.ids, row.said, row.scores)

    # -- elsewhere, in whole batches ---------------------------------------------------------------

    def _replies(self, rows: Sequence[EncodedPrompt]) -> list[Spoken]:
        try:
            generated = self._generate(rows)
        except RuntimeError as error:
            self.forget()
            raise _explained(error, rows) from None
        self._go_on()
        return [
            Spoken(self._reply(row, said), row.ids, said)
            for row, said in zip(rows, generated, strict=True)
        ]

    def _go_on(self) -> None:
        """Raise CannotGoOn if it must not."""
        if self._closing.is_set():
            raise CannotGoOn(CLOSED.message)
        if self._supervisor.over:
            raise CannotGoOn(f"the minutes are over; {AGAIN}")

    def _generate(self, rows: Sequence[EncodedPrompt]) -> list[list[int]]:
        """The tokens that the model generates for each row, up to an end token or the limit."""
        if self._kept is not None:
            rows = self._long_ones_processed(rows)
        sampling = self._settings.sampling
        batch, inputs, cache = self._inputs(rows, sampling.max_tokens)
        choices = []
        if sampling.temperature > 0:
            choices = [
                SeededSampling(sampling.temperature, sampling.top_p, [row.seed for row in rows])
            ]

        def closing(input_ids: torch.Tensor, scores: Any, **more: Any) -> torch.Tensor:
            ends = self._closing.is_set() or self._supervisor.over
            return torch.full((len(rows),), ends, device=input_ids.device)

        out = self._model.generate(
            **inputs,
            generation_config=self._model.generation_config,
            logits_processor=choices,
            stopping_criteria=[closing],
        )
        said = [self._until_end(each) for each in out[:, batch.length :].tolist()]
        if self._kept is not None and cache is not None:
            for row, turns in zip(rows, batch.turns(said, cache), strict=True):
                self._kept.keep(row.name, turns)
        return said

    def _inputs(
        self, rows: Sequence[EncodedPrompt], most: int
    ) -> tuple[PaddedBatch, dict[str, Any], DynamicCache | None]:
        """Rows as arguments of ``generate``, for up to ``most`` tokens; and the cache in them."""
        batch = PaddedBatch(rows)
        inputs = batch.inputs(self._model, self._image_token, positions=self._kept is not None)
        told: dict[str, Any] = {name: each.to(self._model.device) for name, each in inputs.items()}
        if self._kept is None:
            return batch, told, None
        room = batch.length - max(row.reused for row in rows) + most
        cache = joined_past(self._model, [row.past for row in rows], room)
        return batch, {**told, "past_key_values": cache}, cache

    def _long_ones_processed(self, rows: Sequence[EncodedPrompt]) -> list[EncodedPrompt]:
        """The rows, those with many more new tokens than most processed but for the last token.

        Rows of a batch are padded to the longest. A conversation that begins would make all the
        others, which bring a short turn, as long as its instructions.
        """
        new = [len(row.ids) - row.reused for row in rows]
        limit = 2 * sorted(new)[len(new) // 2] + _SHORT
        places = [place for place, tokens in enumerate(new) if tokens > limit]
        if not places:
            return list(rows)
        heads = [replace(rows[place], ids=rows[place].ids[:-1]) for place in places]
        batch, inputs, cache = self._inputs(heads, 1)
        assert cache is not None
        one = copy(self._model.generation_config)
        one.max_new_tokens = 1
        self._model.generate(**inputs, generation_config=one)
        found = list(rows)
        nothing: list[list[int]] = [[] for _ in heads]
        for place, turns in zip(places, batch.turns(nothing, cache), strict=True):
            found[place] = replace(
                rows[place], kept=turns, reused=len(turns.ids), new_pixels=None, new_pictures=0
            )
        return found

    def _until_end(self, said: list[int]) -> list[int]:
        """The tokens up to the end token; padding follows in rows that end early."""
        ends = (place for place, each in enumerate(said, start=1) if each in self._end_tokens)
        return said[: next(ends, None)]

    def _reply(self, row: EncodedPrompt, said: Sequence[int]) -> Reply:
        with self._tokenizer_lock:
            text = self._tokenizer.decode(
                said, skip_special_tokens=True, clean_up_tokenization_spaces=False
            )
        thought, text = _without_thought(text, row.thinking)
        return Reply(
            text=text,
            reasoning=thought,
            usage=Usage(
                prompt=len(row.ids),
                cached=row.reused,
                completion=len(said),
                reasoning=min(len(said), len(self._ids(thought))) if thought else 0,
            ),
            finish="stop" if said[-1] in self._end_tokens else "length",
            model=self._name,
        )

    def _ids(self, text: str) -> list[int]:
        with self._tokenizer_lock:
            ids: list[int] = self._tokenizer(text, add_special_tokens=False)["input_ids"]
        return ids


def _grids_by_digest(kept: CachedTurns | None) -> dict[str, torch.Tensor]:
    """The grids of the pictures that were processed in earlier turns, (1, 3) each."""
    if kept is None or kept.grids is None:
        return {}
    return dict(zip(kept.pictures, kept.grids.split(1), strict=True))


def _without_thought(text: str, thinking: bool) -> tuple[str, str]:
    """The thought and the reply; ``thinking`` says that the text begins inside a thought."""
    thought, found, words = text.partition(_THOUGHT)
    begun = thought.lstrip().startswith(_THINK)
    if not (found or begun or thinking):
        return "", text
    return thought.strip().removeprefix(_THINK).strip(), words.lstrip()


def _explained(error: RuntimeError, rows: Sequence[EncodedPrompt]) -> Exception:
    """Torch's error as the exception that the batcher expects."""
    if _says_memory_is_short(error):
        tokens = max(len(row.ids) for row in rows)
        return MemoryError(
            f"{len(rows)} conversations of up to {tokens} tokens do not fit into memory; lower "
            "local.batch or pictures.keep"
        )
    if isinstance(error, getattr(torch, "AcceleratorError", ())):
        return CannotGoOn(
            f"the device failed, and this process cannot use it again: {error_summary(error)}"
        )
    return error


def _says_memory_is_short(error: RuntimeError) -> bool:
    if isinstance(error, torch.cuda.OutOfMemoryError) or "DefaultCPUAllocator" in str(error):
        return True
    # Libraries that find no memory for their workspace fail in words of their own.
    unsaid = any(name in str(error) for name in _LIBRARIES_OF_CUDA)
    return unsaid and torch.cuda.mem_get_info()[0] < _ENOUGH_FOR_LIBRARIES
