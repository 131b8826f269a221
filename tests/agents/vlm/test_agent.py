"""The agent's loop: its requests, its reading of replies, and its record."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from agents.vlm.agent import VLMAgent
from agents.vlm.chat import (
    LEFT_OUT,
    ConversationRefused,
    Message,
    ModelError,
    Picture,
    Reply,
    Usage,
)
from agents.vlm.clients.scripted import RecordedClient, ScriptedClient
from agents.vlm.matching import Matcher
from agents.vlm.prompts import load_prompts
from agents.vlm.record import ConversationRecord
from agents.vlm.requests import as_sent
from agents.vlm.settings import AgentSettings
from er_gym import EmbodiedEnv
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import file_stem
from er_gym.tasks import Task, load_suite

PICKUP = next(
    task for task in load_suite("mini").tasks if task.type.name == "single_pickup_from_closerep"
)
WAY = [str(f"{key.verb} {key.actual_type}").strip() for key in PICKUP.key_actions]


def settings(**given: Any) -> AgentSettings:
    return AgentSettings.model_validate({"sees": "text", **given})


class Script:
    """Says one text after the other, and remembers what it was sent."""

    def __init__(self, *replies: str | Reply) -> None:
        self.replies = replies
        self.sent: list[list[Message]] = []

    def __call__(self, messages: Sequence[Message]) -> str | Reply:
        self.sent.append(list(messages))
        return self.replies[min(len(self.sent), len(self.replies)) - 1]


def decided(*actions: str) -> list[str]:
    return [
        f"<Observation>round {number}</Observation><DecisionMaking>{action}</DecisionMaking>"
        for number, action in enumerate(actions)
    ]


@pytest.fixture
def env() -> Iterator[Callable[..., EmbodiedEnv]]:
    made: list[EmbodiedEnv] = []

    def make(obs_mode: str = "text", **options: Any) -> EmbodiedEnv:
        made.append(EmbodiedEnv((), obs_mode=obs_mode, width=96, height=64, **options))
        return made[-1]

    yield make
    for each in made:
        each.close()


def agent_of(client: Any, options: AgentSettings) -> VLMAgent:
    matcher = Matcher(options.matching)
    return VLMAgent(client, options, load_prompts(options.prompts), matcher, 7, "scripted:x")


def play(env: EmbodiedEnv, script: Any, options: AgentSettings, task: Task = PICKUP) -> Any:
    agent = agent_of(ScriptedClient(script), options)
    return agent, play_episode(env, agent, task, 0)


def left_by(agent: VLMAgent, episode: EpisodeRecord) -> tuple[ConversationRecord, dict[str, bytes]]:
    """The conversation that an agent leaves, and its pictures."""
    files = agent.attachments(episode, file_stem(episode.task_id))
    *_, last = files
    return ConversationRecord.model_validate_json(files.pop(last)), files


def texts(message: Message) -> str:
    return "\n".join(part for part in message.parts if isinstance(part, str))


def pictures(messages: Sequence[Message]) -> list[Picture]:
    return [part for message in messages for part in message.parts if isinstance(part, Picture)]


# -- the loop --------------------------------------------------------------------------------------


def test_a_model_that_knows_the_way_solves_the_task(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script(*decided(*WAY))
    _, episode = play(env(), script, settings())
    assert episode.success
    assert not episode.error
    assert [step.text for step in episode.steps[1:]] == WAY
    assert episode.steps[1].thought == "Observation: round 0"
    assert PICKUP.instruction in texts(script.sent[0][-1])
    assert "You see:" in texts(script.sent[0][-1])


@pytest.mark.parametrize("sees", ["text", "pictures"])
def test_every_turn_states_the_task_once(env: Callable[..., EmbodiedEnv], sees: str) -> None:
    played = env({"text": "text", "pictures": "rgb"}[sees])
    for language in ("en", "zh"):
        for said in (PICKUP.instruction, "把苹果拿起来…\nStep 3 of 9.", "Task: find"):
            script = Script(*decided("observe", "open Fridge", "end"))
            options = settings(sees=sees, prompts={"language": language})
            play(played, script, options, replace(PICKUP, instruction=said))
            told = [texts(message) for message in script.sent[-1] if message.role != "assistant"]
            assert [text.count(said) for text in told] == [0, 1, 1, 1], (language, told)
            assert not any(f"Task: {said[:4]}" in text or "?????" in text for text in told)


def test_a_model_is_told_the_limit_that_the_environment_keeps(
    env: Callable[..., EmbodiedEnv],
) -> None:
    script = Script(*decided("observe", "move forward", "observe", "observe"))
    _, episode = play(env("rgb", max_steps=4), script, settings(sees="pictures"))
    told = [texts(sent[-1]) for sent in script.sent]
    assert "You have 3 actions." in told[0]
    assert ["Actions left: 2." in told[1], "Actions left: 1." in told[2]] == [True, True]
    assert len(told) == 3
    assert (episode.max_steps, episode.end_reason) == (4, "step limit")


def test_sent_messages_never_change(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script(*decided(*WAY))
    play(env("rgb"), script, settings(sees="pictures"))
    for before, after in zip(script.sent, script.sent[1:], strict=False):
        assert after[: len(before)] == before
        assert [message.role for message in after[len(before) :]] == ["assistant", "user"]
    assert len(pictures(script.sent[-1])) == len(script.sent)


def test_a_fork_goes_on_by_itself(env: Callable[..., EmbodiedEnv]) -> None:
    played = env()
    agent = agent_of(ScriptedClient(Script(*decided("observe", "move forward"))), settings())
    obs, info = played.reset(options={"task": PICKUP})
    agent.reset(PICKUP, obs, info)
    obs, _, _, _, info = played.step(agent.act(obs, info).action)
    fork = agent.fork(ScriptedClient(Script(*decided("end"))), seed=1)
    assert str(fork.act(obs, info).action) == "end"
    assert str(agent.act(obs, info).action) == "move forward"
    assert fork.messages[:-1] == agent.messages[:-1]
    assert len(fork.rounds) == len(agent.rounds) == 2


def test_observing_shows_all_sides(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script(*decided("observe", "end"))
    play(env("rgb"), script, settings(sees="pictures"))
    first, seen = pictures(script.sent[0]), pictures(script.sent[1][-1:])
    assert (len(first), len(seen)) == (1, 4)
    assert seen[-1] == first[0]  # straight ahead, as before
    assert len({picture.digest for picture in seen}) == 4

    script = Script(*decided("observe", "end"))
    play(env("rgb"), script, settings(sees="pictures", pictures={"views": False}))
    assert len(pictures(script.sent[1])) == 2


def test_only_the_last_pictures_are_kept_where_that_is_asked_for(
    env: Callable[..., EmbodiedEnv],
) -> None:
    script = Script(*decided("observe", *WAY))
    agent, episode = play(env("rgb"), script, settings(sees="pictures", pictures={"keep": 2}))
    check_requests(left_by(agent, episode)[0], script.sent)
    numbers = [len(pictures(sent)) for sent in script.sent]
    assert numbers == [1, 1 + 4, 2 + 1, 2 + 1, *[2 + 1] * (len(numbers) - 4)]
    left_out = [sum(part == LEFT_OUT for m in sent for part in m.parts) for sent in script.sent]
    assert left_out == [0, 0, 3, 4, *range(5, len(left_out) + 1)]


@pytest.mark.parametrize("given_back", [True, False])
def test_thoughts_of_reasoning_models_go_back_if_asked(
    env: Callable[..., EmbodiedEnv], given_back: bool
) -> None:
    script = Script(*(Reply(text, reasoning="hm") for text in decided("observe", "end")))
    agent, episode = play(env(), script, settings(reasoning={"in_history": given_back}))
    said = [message for message in script.sent[1] if message.role == "assistant"]
    assert [message.reasoning for message in said] == ["hm" if given_back else ""]
    record, _ = left_by(agent, episode)
    assert [m.reasoning for m in record.messages if m.role == "assistant"] == ["hm", "hm"]
    check_requests(record, script.sent)


def check_requests(record: ConversationRecord, sent: Sequence[Sequence[Message]]) -> None:
    """The record tells each request as it was."""

    def plain(messages: Sequence[Any]) -> list[Any]:
        return [
            (each.role, each.reasoning, [p if isinstance(p, str) else p.digest for p in each.parts])
            for each in messages
        ]

    assert len(record.rounds) == len(sent)
    for number, messages in enumerate(sent):
        assert plain(as_sent(record, number)) == plain(messages), number


# -- replies that are not as they should be --------------------------------------------------------


def test_three_replies_without_an_action_end_the_episode(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script("I would rather not.", "", "Really.")
    _, episode = play(env(), script, settings())
    assert episode.end_reason == "no known action"
    assert len(script.sent) == 3
    assert "no decision" in texts(script.sent[1][-1])
    assert script.sent[2][-2].parts == ("(nothing)",)
    assert [step.verb for step in episode.steps] == ["init", "error", "error", "error"]


def test_a_usable_reply_resets_the_count(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script("No.", "No.", *decided("observe"), "No.", "No.", *decided("end"))
    _, episode = play(env(), script, settings())
    assert episode.end_reason == "end"


def test_even_a_reply_that_reads_like_an_action_is_not_done_if_it_has_a_problem(
    env: Callable[..., EmbodiedEnv],
) -> None:
    script = Script(*decided("fly to Fridge", "end"))
    _, episode = play(env(), script, settings())
    assert [step.verb for step in episode.steps] == ["init", "error", "end"]
    assert "'fly to Fridge' is not an action" in texts(script.sent[1][-1])


def test_names_are_matched_to_types(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script(*decided("go to the refrigerator", "navigate to Unobtainium", "end"))
    agent, episode = play(env(), script, settings())
    assert episode.steps[1].text == "navigate to Fridge"
    record, _ = left_by(agent, episode)
    first, second, _ = record.rounds
    assert (first.name, first.matched, first.action) == (
        "refrigerator",
        "alias",
        "navigate to Fridge",
    )
    assert "no object type" in second.problem
    assert second.problem in texts(script.sent[2][-1])


def test_what_cannot_be_done_with_a_type_is_said(env: Callable[..., EmbodiedEnv]) -> None:
    script = Script(*decided("open Apple", "end"))
    play(env(), script, settings())
    assert "One cannot open an Apple." in texts(script.sent[1][-1])


def test_unusable_replies_reach_the_paper_protocol_as_its_runner_sees_them(
    env: Callable[..., EmbodiedEnv],
) -> None:
    script = Script(*decided("open Apple", "navigate to Unobtainium"), "No.", "No.", "I put in it.")
    agent, episode = play(env(protocol="paper"), script, settings())
    verbs = [f"{step.verb} {step.object_type}".rstrip() for step in episode.steps]
    assert verbs == [
        *("init", "open Apple", "navigate to No Suitable Object"),
        *("error", "error", "error", "end"),
    ]
    assert "One cannot open an Apple." in texts(script.sent[1][-1])
    record, _ = left_by(agent, episode)
    assert [each.action for each in record.rounds] == [""] * 5


def test_an_object_that_only_the_paper_protocol_knows_is_no_problem(
    env: Callable[..., EmbodiedEnv],
) -> None:
    """Its runner takes the last word that names a type."""
    script = Script(*decided("navigate to qwertz Fridge", "end"))
    fuzzy = settings(matching={"fuzzy": 100})
    task = replace(PICKUP, navigable_objects=("Fridge",), scene="FloorPlan1", target_objects=())
    agent, episode = play(env(protocol="paper"), script, fuzzy, task)
    assert episode.steps[1].success
    record, _ = left_by(agent, episode)
    first = record.rounds[0]
    assert (first.matched, first.action, first.problem) == ("none", "navigate to Fridge", "")


def test_a_tool_call_decides(env: Callable[..., EmbodiedEnv]) -> None:
    calls = [
        Reply("", call='{"action": "observe", "object": ""}'),
        Reply("", call='{"action":"end"}'),
    ]
    script = Script(*calls)
    _, episode = play(env(), script, settings(decide="tools"))
    assert [step.verb for step in episode.steps] == ["init", "observe", "end"]
    assert '"observe"' in texts(script.sent[1][-2])


def test_a_model_that_gives_no_reply_fails_the_episode(env: Callable[..., EmbodiedEnv]) -> None:
    def silent(messages: Sequence[Message]) -> str:
        raise ModelError("no reply after 6 tries")

    agent, episode = play(env(), silent, settings())
    assert episode.error.startswith("agents.vlm.chat.ModelError: no reply after 6 tries")
    record, _ = left_by(agent, episode)
    assert record.rounds == []
    assert record.error == episode.error


# -- a conversation over a limit -------------------------------------------------------------------


class Limited(Script):
    """A script for a server that takes so many pictures, and so many characters."""

    def __init__(self, *replies: str, pictures: int = 999, characters: int = 10**9) -> None:
        super().__init__(*replies)
        self.pictures, self.characters = pictures, characters
        self.tries = 0

    def __call__(self, messages: Sequence[Message]) -> str | Reply:
        self.tries += 1
        assert [each.role for each in messages][-1] == "user"
        if len(pictures(messages)) > self.pictures:
            raise ConversationRefused(f"400, at most {self.pictures} images", "pictures")
        if sum(len(texts(message)) for message in messages) > self.characters:
            raise ConversationRefused("400, maximum context length is 10 tokens", "context")
        return super().__call__(messages)


LONG = [f"<Planning>{'so ' * 400}</Planning>{each}" for each in decided(*WAY)]


def test_the_oldest_pictures_are_left_out_where_a_server_takes_no_more(
    env: Callable[..., EmbodiedEnv],
) -> None:
    script = Limited(*decided("observe", *WAY), pictures=4)
    agent, episode = play(env("rgb"), script, settings(sees="pictures"))
    assert episode.success
    numbers = [len(pictures(sent)) for sent in script.sent]
    assert numbers == [1, 4, 4, *[4] * (len(numbers) - 3)]
    record, files = left_by(agent, episode)
    assert len(files) == 1 + 4 + len(WAY) - 1  # the record keeps them all
    trimmed = [each.trimmed for each in record.rounds]
    assert trimmed[0] is None
    assert [each.pictures for each in trimmed if each] == [*range(1, len(numbers))]
    assert script.tries == len(script.sent) + 1  # it is refused once
    assert {each.why for each in trimmed if each} == {"400, at most 4 images"}
    assert [each.causes for each in episode.steps[1:]] == [[], *[["trimmed"]] * (len(numbers) - 1)]
    again = ConversationRecord.model_validate_json(record.model_dump_json())
    assert again == record
    check_requests(record, script.sent)
    assert "trimmed" not in record.rounds[0].model_dump()  # as older versions wrote it


@pytest.mark.parametrize("decide", ["tags", "json"])
def test_the_oldest_words_are_left_out_where_the_context_is_full(
    env: Callable[..., EmbodiedEnv], decide: str
) -> None:
    whole = Script(*LONG)
    play(env(), whole, settings(decide=decide))
    most = max(sum(map(len, map(texts, sent))) for sent in whole.sent)
    script = Limited(*LONG, characters=most - 100)
    options = settings(decide=decide, history={"trim": True})
    agent, episode = play(env(), script, options)
    assert episode.success
    last = script.sent[-1]
    assert len(last) == len(whole.sent[-1])
    form = {"tags": f"<DecisionMaking>{WAY[0]}</DecisionMaking>", "json": '"action": "navigate to"'}
    reply = next(each for each in last if each.role == "assistant")
    assert form[decide] in texts(reply)  # what it did stays
    assert "so so" not in texts(reply)
    assert [each.trimmed.messages for each in agent.rounds if each.trimmed] == [2]
    check_requests(left_by(agent, episode)[0], script.sent)


def test_an_episode_over_a_limit_ends_with_its_cause(env: Callable[..., EmbodiedEnv]) -> None:
    """Where the settings forbid to shorten it, and where it cannot be shorter."""
    for script, options, cause, replies in (
        (Limited(*LONG, characters=4000), settings(), "context", 1),
        (Limited(*LONG, characters=10), settings(history={"trim": True}), "context", 0),
        (Limited(*decided("observe", *WAY), pictures=2), settings(sees="pictures"), "pictures", 1),
        (
            Limited(*decided(*WAY), pictures=1),
            settings(sees="pictures", history={"trim": False}),
            "pictures",
            1,
        ),
    ):
        agent, episode = play(env(options.obs_mode), script, options)
        assert (episode.error, episode.success, episode.end_reason) == ("", False, "gave up")
        assert (episode.cause, len(episode.steps) - 1) == (cause, replies)
        assert episode.gave_up.startswith("400, ")
        assert left_by(agent, episode)[0].error == episode.gave_up
        assert EpisodeRecord.model_validate_json(episode.model_dump_json()) == episode


def test_what_is_amiss_with_a_reply_is_in_the_record(env: Callable[..., EmbodiedEnv]) -> None:
    good = decided("observe")[0]
    for reply, causes in (
        (Reply(good), []),
        (Reply(good, finish="length"), ["cut"]),
        (Reply("<Planning>I", finish="MAX_TOKENS"), ["cut"]),
        (Reply("", reasoning="I think", finish="length"), ["cut", "unfinished thought"]),
        (Reply("Well <think> I"), ["unfinished thought"]),
        (Reply("<think>a</think> " + good), []),
        (Reply(""), ["empty"]),
        (Reply(" \n"), ["empty"]),
        (Reply("I cannot help.", refused=True), ["refusal"]),
        (Reply("", finish="content_filter"), ["filtered", "empty"]),
        (Reply("Let us see."), ["unreadable"]),
        (Reply("<DecisionMaking>fly</DecisionMaking>"), ["unreadable"]),
        (Reply("<DecisionMaking>open Unicorn</DecisionMaking>"), []),
    ):
        _, episode = play(env(), Script(reply, *decided("end")), settings())
        assert episode.steps[1].causes == causes, reply


# -- the record ------------------------------------------------------------------------------------


def test_the_record_has_it_all(env: Callable[..., EmbodiedEnv]) -> None:
    usage = Usage(prompt=100, completion=10, cached=60, reasoning=4)
    replies = [Reply(text, usage=usage, cost=0.25, model="m-1") for text in decided(*WAY)]
    options = settings(
        sees="pictures", server={"base_url": "http://user:secret@127.0.0.1:1/v1?key=secret"}
    )
    agent, episode = play(env("rgb"), Script(*replies), options)
    record, files = left_by(agent, episode)
    assert [each.action for each in record.rounds] == WAY
    assert [each.feedback for each in record.rounds] == [s.feedback for s in episode.steps[1:]]
    assert all(each.success for each in record.rounds)
    assert [each.thoughts[0].kind for each in record.rounds] == ["Observation"] * len(WAY)
    assert record.cost == pytest.approx(0.25 * len(WAY))
    assert record.prompt_tokens == 100 * len(WAY)
    assert {each.model for each in record.rounds} == {"m-1"}
    assert len(files) == len(WAY)
    shown = [p.path for m in record.messages for p in m.parts if not isinstance(p, str)]
    assert shown == list(files)
    assert all(path.startswith(f"pictures/{PICKUP.id}/") for path in files)
    assert "secret" not in record.model_dump_json()
    assert record.settings["server"]["base_url"] == "http://127.0.0.1:1/v1"
    again = type(record).model_validate_json(record.model_dump_json())
    assert again == record


@pytest.mark.parametrize("keep", [None, 0])
def test_a_recorded_conversation_is_replayed(
    env: Callable[..., EmbodiedEnv], tmp_path: Path, keep: int | None
) -> None:
    options = settings(sees="pictures", pictures={"keep": keep})
    agent, episode = play(env("rgb"), Script("Nothing.", *decided("observe", *WAY)), options)
    record, _ = left_by(agent, episode)
    (tmp_path / "conversations").mkdir()
    (tmp_path / "conversations" / f"{file_stem(PICKUP.id)}.json").write_text(
        record.model_dump_json()
    )

    replay = agent_of(RecordedClient(tmp_path), options)
    again = play_episode(env("rgb"), replay, PICKUP, 0)
    assert not again.error
    assert [step.text for step in again.steps] == [step.text for step in episode.steps]

    other = next(task for task in load_suite("mini").tasks if task.scene != PICKUP.scene)
    stranger = play_episode(env("rgb"), agent_of(RecordedClient(tmp_path), options), other, 0)
    assert "no conversation in" in stranger.error


def test_a_directory_without_conversations_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no conversations"):
        RecordedClient(tmp_path)
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(ValueError, match="cannot be read as a conversation"):
        RecordedClient(tmp_path / "x.json")
