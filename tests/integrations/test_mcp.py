"""The MCP server, asked by the SDK's own client."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conformance import SETTINGS, Answer, Course, differences

pytest.importorskip("mcp.server.mcpserver", reason="the extra mcp is not installed")

from anyio.from_thread import BlockingPortal, start_blocking_portal
from mcp.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

from er_gym.envs.actions import parse
from er_gym.integrations.mcp import META, Episodes, make_server
from er_gym.tasks import verbs

ROOT = Path(__file__).resolve().parents[2]
TASK = "FloorPlan2-single_pickup_from_closerep-Lettuce"
SOLVE = ("navigate to Fridge", "open Fridge", "pickup Lettuce", "close Fridge", "end")


def tool_of(text: str) -> tuple[str, dict[str, str]]:
    """The tool of a verb, or the one for any text."""
    action = parse(text)
    if action is None:
        return "act", {"action": text}
    return action.verb.replace(" ", "_"), {
        "object": action.object_type
    } if action.object_type else {}


class OfClient:
    """Plays by a client, one call at a time."""

    def __init__(self, portal: BlockingPortal, client: Client) -> None:
        self.portal, self.client, self.episode = portal, client, ""

    def call(self, tool: str, **arguments: Any) -> Any:
        return self.portal.call(self.client.call_tool, tool, arguments)

    def reset(self, task_id: str) -> Answer:
        result = self.call("begin", task_id=task_id)
        assert not result.is_error, result.content
        self.episode = result.content[0].text.split()[1].rstrip(".")
        return _answer(result, 1)

    def step(self, text: str) -> Answer:
        tool, arguments = tool_of(text)
        result = self.call(tool, **arguments, episode=self.episode)
        assert not result.is_error, result.content
        return _answer(result, 0)


def _answer(result: Any, block: int) -> Answer:
    told = result.meta[META]
    return Answer(result.content[block].text, told["reward"], told["done"], told["success"])


@pytest.fixture(scope="module")
def portal() -> Iterator[BlockingPortal]:
    with start_blocking_portal() as opened:
        yield opened


@pytest.fixture
def episodes() -> Iterator[Episodes]:
    made = Episodes(most=2, width=32, height=24, **SETTINGS)
    yield made
    made.close()


@pytest.fixture
def player(portal: BlockingPortal, episodes: Episodes) -> Iterator[OfClient]:
    with portal.wrap_async_context_manager(Client(make_server(episodes))) as client:
        yield OfClient(portal, client)


def test_it_answers_as_gymnasium_make(portal: BlockingPortal, courses: tuple[Course, ...]) -> None:
    server = make_server(**SETTINGS)
    with portal.wrap_async_context_manager(Client(server)) as client:
        assert differences(OfClient(portal, client), courses) == []


def test_the_tools_are_the_verbs(player: OfClient) -> None:
    tools = {each.name: each for each in player.portal.call(player.client.list_tools).tools}
    named = {verb.name.replace(" ", "_") for verb in verbs.table()}
    assert tools.keys() == named | {"begin", "act"}
    assert tools["navigate_to"].input_schema["required"] == ["object", "episode"]
    assert tools["end"].input_schema["required"] == ["episode"]


def test_a_client_in_another_process_plays_a_task_to_success(portal: BlockingPortal) -> None:
    """By ``er-gym mcp``, over its standard input and output, with pictures."""
    command = ["-m", "benchmarks.cli", "mcp", "--suite", "er-1k", "--pictures"]
    server = StdioServerParameters(
        command=sys.executable, args=[*command, "--width", "32", "--height", "24"], cwd=ROOT
    )
    with portal.wrap_async_context_manager(Client(stdio_client(server))) as client:
        player = OfClient(portal, client)
        player.reset(TASK)
        answers = [player.step(text) for text in SOLVE[:-1]]
        last = player.call("end", episode=player.episode)
    assert [answer.reward for answer in answers] == [1, 1, 1, 1]
    told, over, picture = last.content
    assert "Done: end." in told.text
    assert over.text == "The episode is over: the task is done."
    assert (picture.type, picture.mime_type, picture.data[:8]) == ("image", "image/png", "iVBORw0K")


def test_no_client_plays_in_the_episode_of_another(
    portal: BlockingPortal, episodes: Episodes, player: OfClient
) -> None:
    with portal.wrap_async_context_manager(Client(make_server(episodes))) as client:
        other = OfClient(portal, client)
        player.reset(TASK)
        other.reset("FloorPlan2-710812-single_search-Apple")
        assert player.episode != other.episode
        player.step("navigate to Fridge")
        assert "navigate to Fridge" not in other.step("observe").text
        refused = other.call("observe", episode=player.episode[:-1])
        assert refused.is_error
        assert "there is no episode" in refused.content[0].text


@pytest.mark.parametrize(
    ("tool", "arguments", "words"),
    [
        ("begin", {"task_id": "none such"}, "no task 'none such'"),
        ("begin", {"scene": "FloorPlan999"}, "FloorPlan999"),
        ("begin", {"seed": -1}, "greater or equal to zero"),
        ("begin", {"seed": "x"}, "valid integer"),
        ("observe", {}, "Field required"),
        ("open", {"object": 7, "episode": "x"}, "valid string"),
        ("open", {"object": "Fridge", "episode": "x" * 9000}, "there is no episode"),
        ("fly", {}, "Unknown tool"),
    ],
)
def test_bad_input_is_answered_in_words(
    player: OfClient, tool: str, arguments: dict[str, Any], words: str
) -> None:
    result = player.call(tool, **arguments)
    assert result.is_error
    assert words in result.content[0].text
    assert len(result.content[0].text) < 1000


def test_episodes_are_freed(episodes: Episodes) -> None:
    first, _ = episodes.begin(None, TASK, "")
    for text in SOLVE:
        episodes.step(first, text)
    assert len(episodes) == 0  # it has ended
    kept, forgotten = (episodes.begin(0, "", "")[0] for _ in range(2))
    with pytest.raises(Exception, match="2 episodes are under way, as many as may be"):
        episodes.begin(0, "", "")
    episodes._episodes[forgotten].used -= 601
    episodes.begin(0, "", "")
    assert len(episodes) == 2
    assert episodes.step(kept, "observe").steps == 2
    with pytest.raises(Exception, match="there is no episode"):
        episodes.step(forgotten, "observe")
    episodes.close()
    assert len(episodes) == 0
