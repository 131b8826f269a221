"""What a model is told when it plays is what its training file says, pixel by pixel."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.expert.course import Intent
from agents.expert.recorder import FOLDERS, OBS_MODE, TrajectoryHeader, TrajectoryRecorder
from agents.vlm.agent import VLMAgent
from agents.vlm.chat import Message, Picture
from agents.vlm.clients.scripted import ScriptedClient
from agents.vlm.dialect_prompts import digest_of
from agents.vlm.matching import Matcher
from agents.vlm.pictures import encode
from agents.vlm.prompts import load_prompts, prompts_for
from agents.vlm.settings import AgentSettings, Pictures, Prompts
from agents.vlm.tuned_model import recorded_pictures
from er_gym import EmbodiedEnv
from er_gym.data.chat import Chat
from er_gym.data.dialects import load_dialect
from er_gym.data.pictures import encode_picture
from er_gym.data.trajectory import Language, Subgoal, ThoughtRecord, Trajectory
from er_gym.envs.actions import Action
from er_gym.envs.info import action_of
from er_gym.envs.solver import Solver
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks import Task, load_suite, verbs

SIZE = {"width": 160, "height": 90}
PICTURES = Pictures(quality=90, max_pixels=10_000)
"""Smaller than what is rendered: they are scaled alike on both sides."""
TASKS = [load_suite("mini").tasks[place] for place in (30, 84, 100, 110)]
LOOK, WALK = Action(verbs.OBSERVE), Action(verbs.MOVE_FORWARD)
FIRST: Sequence[Sequence[Action]] = (
    (LOOK, Action(verbs.CLOSE, "Fridge"), WALK),
    (Action(verbs.NAVIGATE, "Boots"), Action(verbs.NAVIGATE, "Boots"), LOOK),
    (WALK, LOOK),
    (),
)
"""What is done before the task: looking, walking, and what cannot be done."""
FAULTS = (0.0, 0.0, 0.3, 0.5)


class Recorded:
    """Does some actions, then the task; again what failed. Leaves a trajectory."""

    obs_mode = OBS_MODE
    attachment_folders = FOLDERS

    def __init__(self, first: Sequence[Action], language: Language) -> None:
        self._todo, self._language, self._solver = list(first), language, Solver()

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        header = TrajectoryHeader(task_id=task.id, kind="a", language=self._language)
        self.recorder = TrajectoryRecorder(task, header, PICTURES, lambda trajectory: "")

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        self.recorder.take_result(info)
        if info["fault"]:
            action = action_of(info)
        else:
            action = self._todo.pop(0) if self._todo else self._solver.next(info)[0]
        goal = Subgoal(verb="pickup", thing="Mug", place="Sink")
        self.recorder.begin_turn(Intent(action, "search", goal, ("Sink", "Shelf")), obs, info)
        text = f"I think that I should {action}."
        self.recorder.think(
            len(self.recorder.turns) - 1,
            [ThoughtRecord(kind="planning", text=text), ThoughtRecord(kind="reflection", text="M")],
        )
        return Decision(action)

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        return self.recorder.attachments(episode, stem)


class Played:
    """A task, the faults, and the trajectory that was recorded, with its pictures by path."""

    def __init__(self, number: int, env: Callable[..., EmbodiedEnv]) -> None:
        self.task, self.faults = TASKS[number], FAULTS[number]
        language: Language = "zh" if number == 1 else "en"
        agent = Recorded(FIRST[number], language)
        made = env(OBS_MODE, self.faults)
        episode = play_episode(made, agent, self.task, 5)
        self.files = agent.attachments(episode, "x")
        [record] = [data for name, data in self.files.items() if name.endswith(".json")]
        self.trajectory = Trajectory.model_validate_json(record)


@pytest.fixture(scope="module")
def env() -> Iterator[Callable[..., EmbodiedEnv]]:
    made: dict[tuple[str, float], EmbodiedEnv] = {}

    def make(obs_mode: str, faults: float = 0.0) -> EmbodiedEnv:
        if (obs_mode, faults) not in made:
            made[obs_mode, faults] = EmbodiedEnv((), obs_mode=obs_mode, faults=faults, **SIZE)
        return made[obs_mode, faults]

    yield make
    for each in made.values():
        each.close()


@pytest.fixture(scope="module")
def played(env: Callable[..., EmbodiedEnv]) -> list[Played]:
    return [Played(number, env) for number in range(len(TASKS))]


def settings(dialect: str, language: Language = "en") -> AgentSettings:
    return AgentSettings(
        sees=load_dialect(dialect).texts[language].sees,
        prompts=Prompts(dialect=dialect, language=language),
        pictures=PICTURES,
    )


def told(
    env: Callable[..., EmbodiedEnv], one: Played, options: AgentSettings, replies: Sequence[str]
) -> list[Message]:
    """The messages of the last request, when a model gives these replies."""
    sent: list[Message] = []

    def answer(messages: Sequence[Message]) -> str:
        sent[:] = messages
        return replies[sum(each.role == "assistant" for each in messages)]

    prompts, matcher = prompts_for(options), Matcher(options.matching)
    agent = VLMAgent(ScriptedClient(answer), options, prompts, matcher, 5)
    play_episode(env(options.obs_mode, one.faults), agent, one.task, 5)
    return sent


def spoken(chat: Chat) -> list[str]:
    return [turn.text for turn in chat.turns if turn.role == "assistant"]


def as_sent(messages: Sequence[Message]) -> list[Any]:
    return [
        (each.role, [part.data if isinstance(part, Picture) else part for part in each.parts])
        for each in messages
    ]


def as_trained(chat: Chat, files: Mapping[str, bytes]) -> list[Any]:
    return [
        (turn.role, [part if isinstance(part, str) else files[part.path] for part in turn.parts])
        for turn in chat.turns
    ]


@pytest.mark.parametrize("dialect", ["paper", "sight", "tags", "text", "text-recall"])
def test_a_model_is_told_what_it_was_tuned_on(
    dialect: str, env: Callable[..., EmbodiedEnv], played: list[Played]
) -> None:
    kinds = set()
    for one in played:
        chat = load_dialect(dialect).chat(one.trajectory)
        options = settings(dialect, one.trajectory.language)
        sent = told(env, one, options, spoken(chat))
        assert as_sent(sent) == as_trained(chat, one.files)[:-1]
        if options.prompts.language == "zh":  # it has been told of a failed step, in its language
            told_words = "".join(
                part for each in sent for part in each.parts if isinstance(part, str)
            )
            assert "看清过" in told_words
            assert "You could" not in told_words
        for before, turn in zip(one.trajectory.turns, one.trajectory.turns[1:], strict=False):
            kinds.add((before.verb if before.success else "", len(turn.pictures)))
    wanted = {(verbs.OBSERVE, 3), (verbs.MOVE_FORWARD, 1), (verbs.NAVIGATE, 1), ("", 0), ("", 1)}
    assert kinds >= wanted, "the episodes no longer have all kinds of turns"


def test_a_blind_copy_is_shown_noise_where_it_would_be_shown_pictures(
    env: Callable[..., EmbodiedEnv], played: list[Played]
) -> None:
    one = played[1]  # of which one action is not done, so that no picture follows
    options = settings("sight", one.trajectory.language)
    blind = options.model_copy(update={"pictures": PICTURES.model_copy(update={"noise": True})})
    replies = spoken(load_dialect("sight").chat(one.trajectory))
    seen, noise, again = (told(env, one, each, replies) for each in (options, blind, blind))
    assert as_sent(noise) == as_sent(again)
    shown = set()
    for mine, theirs in zip(seen, noise, strict=True):
        for part, other in zip(mine.parts, theirs.parts, strict=True):
            if isinstance(part, Picture):
                assert isinstance(other, Picture)
                assert (part.width, part.height) == (other.width, other.height)
                assert part.data != other.data
                shown.add(other.data)
            else:
                assert part == other
    assert len(shown) > 3, "each picture has noise of its own"


def test_a_task_that_needs_another_verb_lists_it_from_the_beginning(
    env: Callable[..., EmbodiedEnv],
) -> None:
    cut = next(t for t in load_suite("mini").tasks if any(k.verb == "slice" for k in t.key_actions))
    sent: list[Message] = []

    def answer(messages: Sequence[Message]) -> str:
        sent[:] = messages
        return "<DecisionMaking>end</DecisionMaking>"

    options = settings("paper")
    agent = VLMAgent(
        ScriptedClient(answer), options, prompts_for(options), Matcher(options.matching)
    )
    play_episode(env("rgb"), agent, cut, 0)
    assert all("slice <object>" in str(message.parts) for message in sent)


@pytest.mark.parametrize("dialect", ["paper", "text"])
def test_a_reply_that_cannot_be_used_is_answered_with_feedback(
    dialect: str, env: Callable[..., EmbodiedEnv], played: list[Played]
) -> None:
    replies = [
        "Well, well.",
        "<DecisionMaking>open Flibbertigibbet</DecisionMaking>",
        "<DecisionMaking>observe</DecisionMaking>",
        "<DecisionMaking>end</DecisionMaking>",
    ]
    sent = told(env, played[0], settings(dialect), replies)
    user = [each.parts for each in sent if each.role == "user"]
    for parts, words in ((user[1], "no decision"), (user[2], "Flibbertigibbet")):
        [text] = parts
        assert str(text).startswith("<|feedback|>")
        assert words in str(text)
    if dialect == "paper":
        assert "Your last action, open Flibbertigibbet, could not be done." in str(user[2])
        assert sum(isinstance(part, Picture) for part in user[3]) == 3


def test_an_action_that_no_object_allows_is_told_as_it_is_recorded(
    env: Callable[..., EmbodiedEnv], played: list[Played]
) -> None:
    replies = [f"<DecisionMaking>{each}</DecisionMaking>" for each in ("open Bread", "end")]
    sent = told(env, played[0], settings("paper"), replies)
    [text] = sent[-1].parts
    assert "'open Bread' names no action" in str(text)  # as the environment answers


def test_pictures_are_sent_as_a_collection_has_them() -> None:
    collection = {"pictures": {"format": "jpeg", "quality": 80}, "env": {"width": 800}}
    found = Pictures.model_validate(recorded_pictures(collection, 3_136, 50_000))
    drawn = np.random.default_rng(0).integers(0, 256, (450, 800, 3), dtype=np.uint8)
    assert encode(drawn, found).data == encode_picture(drawn, quality=80)
    assert (found.model_bounds, found.width) == ((3_136, 50_000), 800)
    with pytest.raises(ValueError, match="model_min_pixels 9 is more than model_max_pixels 8"):
        Pictures(model_min_pixels=9, model_max_pixels=8)


def test_settings_that_do_not_fit_a_dialect(tmp_path: Path) -> None:
    needs = "needs decide: tags and sees: "
    for given, message in (
        ({"prompts": {"dialect": "paper"}, "sees": "text"}, needs + "pictures"),
        ({"prompts": {"dialect": "text"}}, needs + "text"),
        ({"prompts": {"dialect": "paper"}, "decide": "json"}, needs + "pictures"),
        ({"prompts": {"dialect": "pirate"}}, "there is no dialect 'pirate'"),
    ):
        with pytest.raises(ValueError, match=message):
            prompts_for(AgentSettings.model_validate(given))
    with pytest.raises(ValueError, match="dataset and dialect are both given"):
        Prompts(dataset="x.json", dialect="paper")
    english = (Path("configs/dialects/paper/en.yaml")).read_text()
    (tmp_path / "en.yaml").write_text(english)
    mine = partial(Prompts, dialect=str(tmp_path))
    with pytest.raises(ValueError, match="lacks the language 'zh'"):
        load_prompts(mine(language="zh"))
    digest = load_prompts(Prompts(dialect="paper")).digest
    # Runs in this dialect can be continued as long as nothing that it does not use counts.
    texts = load_dialect("text").texts["en"]
    assert load_prompts(Prompts(dialect="text")).digest == digest_of(texts)
    assert digest_of(texts).startswith("fc28417354fc")
    assert texts.named is not None
    assert texts.notes is not None
    named = texts.named.model_copy(update={"seen": "seen"})
    notes = [texts.notes.model_copy(update={word: "at"}) for word in ("at", "at_far")]
    for more in ({"named": named}, *({"notes": each} for each in notes)):
        assert digest_of(texts.model_copy(update=more)) != digest_of(texts)
    recall = load_dialect("text-recall").texts["en"]
    none = {"at_far": "", "opened": ""}  # as it was before it had these words
    before = recall.model_copy(
        update={
            name: words.model_copy(update={k: v for k, v in none.items() if hasattr(words, k)})
            for name in ("named", "notes", "places")
            if (words := getattr(recall, name))
        }
    )
    assert digest_of(before).startswith("4ed776f5e723")
    for name, word in (("named", "at_far"), ("notes", "at_far"), ("places", "opened")):
        one = getattr(before, name).model_copy(update={word: "x"})
        assert digest_of(before.model_copy(update={name: one})) != digest_of(before)
    assert load_prompts(mine()).digest == digest
    (tmp_path / "en.yaml").write_text(english.replace("Task:", "Job:"))
    assert load_prompts(mine()).digest != digest
