"""Suites as tasks of Inspect (https://inspect.aisi.org.uk), with its models, limits and log viewer.

``inspect eval benchmarks/inspect_task.py@er_gym --model openai/gpt-4o -T suite=mini``, or
``er-gym inspect``. Needs the extra ``inspect``. Prompts, parsing, matching and scores are those of
``er-gym bench``; the replies come from Inspect's model.
"""

from __future__ import annotations

import base64
import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

import anyio
import anyio.to_thread
from inspect_ai import Task as InspectTask
from inspect_ai import task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import (
    ChatMessage,
    ChatMessageAssistant,
    ChatMessageSystem,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentReasoning,
    ContentText,
    GenerateConfig,
    Model,
    ModelOutput,
    ModelUsage,
    ResponseSchema,
    get_model,
)
from inspect_ai.scorer import Score, Scorer, Target, mean, scorer, stderr
from inspect_ai.solver import Generate, Solver, TaskState, solver
from inspect_ai.tool import ToolFunction, ToolInfo
from inspect_ai.util import JSONSchema

from agents.factory import load_settings
from agents.vlm.agent import VLMAgent
from agents.vlm.chat import (
    ConversationRefused,
    Message,
    ModelError,
    Part,
    Picture,
    Reply,
    Usage,
)
from agents.vlm.clients.decision_schema import REQUEST_FIELDS
from agents.vlm.matching import Matcher
from agents.vlm.prompts import prompts_for
from agents.vlm.settings import AgentSettings
from benchmarks.inspect_secrets import without_secrets
from benchmarks.scoring.metrics import METRICS, score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.causes import CONTEXT, causes_in, count_causes
from er_gym.rollout.env_pool import EnvPool
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

_Result = TypeVar("_Result")

EPISODE = "er_gym:episode"
"""Where a sample's store keeps the :class:`~er_gym.rollout.records.EpisodeRecord`."""


@task
def er_gym(
    suite: str = "mini",
    limit: int | None = None,
    agent_config: str | None = None,
    overrides: str | Sequence[str] = (),
    seed: int = 0,
) -> InspectTask:
    """A suite; each of its tasks is a sample, played as one conversation.

    Args:
        suite: its name.
        limit: the number of tasks, from the first; all by default.
        agent_config: the agent's settings: a file, or the name of one that comes with er-gym. Its
            server and prices have no effect, since the model is Inspect's. overrides: settings that
            override it, such as ``sees=text``.
        seed: of the run; each episode's, and each epoch's, is derived from it.
    """
    given = (overrides,) if isinstance(overrides, str) else tuple(overrides)
    settings = load_settings(agent_config, given)
    asked = load_suite(suite)
    env = {"backend": "embedded", **asked.env, **settings.env}
    tasks = resolve_tasks(asked.tasks, env["backend"]).tasks
    chosen = {each.id: each for each in tasks[:limit]}
    return InspectTask(
        dataset=MemoryDataset([_sample(each) for each in chosen.values()], name=asked.name),
        solver=episode(chosen, settings, env, seed),
        scorer=episode_scores(),
        config=_generation(settings),
        metadata={"suite": asked.name, "suite_digest": asked.digest, "env": env},
    )


def _sample(each: Task) -> Sample:
    return Sample(
        id=each.id,
        input=each.instruction,
        target="; ".join(f"{key.verb} {key.object_type}".strip() for key in each.key_actions),
        metadata={"type": each.type.name, "group": each.type.group, "scene": each.scene},
    )


def _generation(settings: AgentSettings) -> GenerateConfig:
    """Sampling arguments that the command line does not set."""
    sampling = settings.sampling
    return GenerateConfig(
        temperature=sampling.temperature,
        # Some models accept only one of the two.
        top_p=None if sampling.top_p == 1 else sampling.top_p,
        max_tokens=sampling.max_tokens,
        reasoning_effort=settings.reasoning.effort or None,
        reasoning_history="all" if settings.reasoning.in_history else "none",
    )


# -- playing -------------------------------------------------------------------------------------


@solver
def episode(
    tasks: Mapping[str, Task], settings: AgentSettings, env: Mapping[str, Any], seed: int
) -> Solver:
    """Plays the sample's task with the model, in an environment in its own process."""
    prompts, matcher = prompts_for(settings), Matcher(settings.matching)
    matcher.prepare()

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        model, exchange = without_secrets(get_model()), _ReplyExchange()
        played = tasks[str(state.sample_id)]
        number = episode_seed(seed + state.epoch - 1, played.id)

        def play() -> EpisodeRecord:
            agent = VLMAgent(exchange, settings, prompts, matcher, seed=number, name=str(model))
            try:
                with EnvPool(1, 1, env) as engines:
                    return play_episode(
                        engines.env(0),
                        agent,
                        played,
                        number,
                        agent_name=str(model),
                    )
            finally:
                exchange.questions.put(None)

        conversation = _Conversation(model, state, settings)
        with ThreadPoolExecutor(1) as thread:
            playing = thread.submit(play)
            try:
                while (question := await _in_thread(exchange.questions.get)) is not None:
                    # Whatever ends a sample, a limit or the model's failure, is raised here.
                    exchange.answers.put(await conversation.reply(*question))
            finally:
                exchange.answers.put(None)
                with anyio.CancelScope(shield=True):
                    record = await _in_thread(playing.result)
                state.store.set(EPISODE, record.model_dump(mode="json"))
        if record.error:
            raise RuntimeError(record.error)
        state.completed = True
        return state

    return solve


async def _in_thread(wait: Callable[[], _Result]) -> _Result:
    # Its own limiter: the default one is for threads that end soon.
    return await anyio.to_thread.run_sync(wait, limiter=anyio.CapacityLimiter(1))


class _ReplyExchange:
    """A :class:`agents.vlm.chat.Client` whose replies come from another thread.

    Attributes:
        questions: the conversation and seed of each reply that an agent waits for; None at the end.
            answers: the replies, or why this conversation gets none; None if there will be none.
    """

    def __init__(self) -> None:
        self.questions: SimpleQueue[tuple[Sequence[Message], int] | None] = SimpleQueue()
        self.answers: SimpleQueue[Reply | ConversationRefused | None] = SimpleQueue()

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it."""
        self.questions.put((messages, seed))
        answer = self.answers.get()
        if answer is None:
            raise ModelError("Inspect has ended the sample")
        if isinstance(answer, ConversationRefused):
            raise answer
        return answer

    def close(self) -> None:
        """Do nothing: nothing is open."""


class _Conversation:
    """An episode's conversation with a model of Inspect.

    Args:
        model: the model.
        state: of the sample; its messages become the conversation.
        settings: of the agent.
    """

    def __init__(self, model: Model, state: TaskState, settings: AgentSettings) -> None:
        self._model, self._state, self._settings = model, state, settings
        state.messages = []
        self._known: list[tuple[Message, ChatMessage]] = []
        self._said: ChatMessageAssistant | None = None

    async def reply(self, messages: Sequence[Message], seed: int) -> Reply | ConversationRefused:
        """The model's next turn, or why this conversation gets none: it is too long.

        Raises:
            ModelError: there is none.
            Exception: what Inspect raises.
        """
        start = time.monotonic()
        sent = [self._message(place, message) for place, message in enumerate(messages)]
        how = _GENERATE_ARGUMENTS[self._settings.decide]()
        if self._settings.seed is not None:
            how["config"].seed = (self._settings.seed + seed) % 2**31
        output = await self._model.generate(sent, **how)
        if not output.choices:
            raise ModelError(f"{self._model} gave no reply: {output.error or 'no choices'}")
        used = output.usage or ModelUsage()
        if output.stop_reason == "model_length" and not used.output_tokens:
            why = " ".join((output.error or output.completion).split())[:400]
            return ConversationRefused(f"{self._model}: it is too long: {why}", CONTEXT)
        self._said = output.message
        self._state.messages.append(output.message)
        self._state.output = output
        return _reply(output, time.monotonic() - start)

    def _message(self, place: int, message: Message) -> ChatMessage:
        """A message in Inspect's terms; a new one is also put into the sample's conversation.

        A message keeps its object, so the log has it once; only a message that is now sent without
        its pictures gets a new one.
        """
        if place < len(self._known):
            before, known = self._known[place]
            return known if before == message else _inspect_message(message)
        made = _inspect_message(message)
        if message.role != "assistant":
            self._state.messages.append(made)
        elif self._said is not None and not self._said.tool_calls:
            # Unchanged, for models that need their signed thoughts back. A tool call has no result
            # here, so it becomes text.
            made = self._said
        self._known.append((message, made))
        return made


_KINDS: Mapping[str, Callable[..., ChatMessage]] = {
    "system": ChatMessageSystem,
    "user": ChatMessageUser,
    "assistant": ChatMessageAssistant,
}


def _inspect_message(message: Message) -> ChatMessage:
    texts = [part for part in message.parts if isinstance(part, str)]
    if len(texts) == len(message.parts):
        return _KINDS[message.role](content="\n".join(texts))
    return _KINDS[message.role](content=[_content(part) for part in message.parts])


def _content(part: Part) -> Content:
    if isinstance(part, Picture):
        letters = base64.b64encode(part.data).decode()
        return ContentImage(image=f"data:{part.media_type};base64,{letters}")
    return ContentText(text=part)


def _reply(output: ModelOutput, seconds: float) -> Reply:
    said, used = output.message, output.usage or ModelUsage()
    thoughts = [part.reasoning for part in said.content_list if isinstance(part, ContentReasoning)]
    cached = max(0, used.input_tokens_cache_read or 0)
    prompt = max(0, used.input_tokens) + max(0, used.input_tokens_cache_write or 0) + cached
    return Reply(
        text=said.text,
        reasoning="\n".join(thoughts),
        call=json.dumps(said.tool_calls[0].arguments) if said.tool_calls else "",
        usage=Usage(prompt, max(0, used.output_tokens), cached, max(0, used.reasoning_tokens or 0)),
        cost=max(0.0, used.total_cost or 0.0),
        finish=output.stop_reason,
        model=output.model,
        seconds=seconds,
    )


# -- how a decision is requested: arguments of Model.generate --------------------------------------


def _tags_arguments() -> dict[str, Any]:
    return {"config": GenerateConfig()}


def _tool_arguments() -> dict[str, Any]:
    function = REQUEST_FIELDS["tools"]["tools"][0]["function"]
    return {
        "tools": [ToolInfo.model_validate(function)],
        "tool_choice": ToolFunction(name=function["name"]),
        "config": GenerateConfig(),
    }


def _json_arguments() -> dict[str, Any]:
    form = REQUEST_FIELDS["json"]["response_format"]["json_schema"]
    schema = ResponseSchema(
        name=form["name"],
        json_schema=JSONSchema.model_validate(form["schema"]),
        strict=form["strict"],
    )
    return {"config": GenerateConfig(response_schema=schema)}


_GENERATE_ARGUMENTS = {"tags": _tags_arguments, "tools": _tool_arguments, "json": _json_arguments}


# -- scoring -------------------------------------------------------------------------------------


@scorer(metrics={"*": [mean(), stderr()]})
def episode_scores() -> Scorer:
    """The metrics of ``er-gym bench`` under its corrected scorer; a success is 1."""

    async def score(state: TaskState, target: Target) -> Score | None:
        kept = state.store.get(EPISODE)
        if kept is None:
            return None
        record = EpisodeRecord.model_validate(kept)
        result = score_episode(record, CORRECTED)
        missing = f"; not done: {', '.join(result.missing)}" if result.missing else ""
        unmet = f"; not so: {', '.join(record.goal_unmet)}" if record.goal_unmet else ""
        return Score(
            value={metric: float(getattr(result, metric)) for metric in METRICS},
            answer="; ".join(step.text for step in record.steps[1:]),
            explanation=(record.error or record.gave_up or f"ended by {record.end_reason}")
            + missing
            + unmet,
            metadata={"causes": [each.sentence() for each in count_causes([causes_in(record)])]},
        )

    return score
