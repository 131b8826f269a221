"""TRL: rooms whose verbs are the tools of ``GRPOTrainer``'s ``environment_factory``.

::

    GRPOTrainer(
        "Qwen/Qwen3-1.7B",
        args=GRPOConfig(max_completion_length=6000),
        train_dataset=Dataset.from_list(rows(load_suite("mini").tasks)),
        environment_factory=room_class("mini"),
        reward_funcs=[episode_reward, success],
    )

The model gets one tool for each verb: ``navigate_to(object)``, ``open(object)``, ``end()`` … For a
model whose chat template knows no tools, see :mod:`er_gym.integrations.trl_text`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from jinja2 import TemplateError
from PIL import Image

from er_gym.envs.sources import Source
from er_gym.integrations.session import Session, Turn
from er_gym.integrations.verb_tools import as_methods
from er_gym.tasks.task import Task

PROMPT = (
    "You are in a room of a house and have a task to do there. Act by calling a tool, one at a "
    "time, until the task is done; then call end.\n\n"
)
"""What the model is told before the first observation, which TRL appends to it."""
_PROBE = "reply-of-a-tool"


class Room:
    """One rollout's environment, as TRL wants it; :func:`room_class` adds the tools.

    TRL makes one for each simultaneous rollout and reuses them. It calls ``reset`` with a row of
    the data set. Every other method whose name has no underscore in front is a tool.

    Attributes:
        reward: the sum of the episode's rewards.
        success: whether the task is done.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.reward, self.success = 0.0, False

    def reset(self, task_id: str | None = None, **_: Any) -> str | list[dict[str, Any]]:
        """Begin the task, or one that is drawn.

        Returns:
            The first observation: a text; or a picture and a text, as parts of a message.
        """
        self.reward, self.success = 0.0, False
        return _content(self._session.reset(task_id))

    def _do(self, action: str) -> str | list[dict[str, Any]]:
        turn = self._session.step(action)
        self.reward += turn.reward
        self.success = turn.success
        return _content(turn)


def room_class(
    episode_source: Source = "mini", *, pictures: bool = False, **settings: Any
) -> type[Room]:
    """The class to give as ``environment_factory``.

    Args:
        episode_source: where the tasks are, as :class:`~er_gym.integrations.session.Session` takes
            it.
        pictures: whether the model is shown what the agent sees, at the start and in each reply of
            a tool. Its chat template must show them: :func:`shows_pictures`.
        settings: further arguments of ``Session``, such as ``scaffold``.

    Raises:
        ValueError: an argument is out of its range.
    """
    made = {"pictures": pictures, **settings}
    Session(episode_source, **made).close()  # says at once what is wrong with them

    def begin(self: Room) -> None:
        Room.__init__(self, Session(episode_source, **made))

    methods = as_methods(Room._do, list if pictures else str)
    return type("Room", (Room,), {"__init__": begin, **dict(methods)})


def rows(tasks: Iterable[Task], prompt: str = PROMPT) -> list[dict[str, Any]]:
    """The rows of a data set, a task each; all rollouts of a group play the same task."""
    return [{"prompt": [{"role": "user", "content": prompt}], "task_id": task.id} for task in tasks]


def episode_reward(environments: Sequence[Room], **_: Any) -> list[float]:
    """A reward function: the sum of each episode's rewards."""
    return [room.reward for room in environments]


def success(environments: Sequence[Room], **_: Any) -> list[float]:
    """A reward function: 1 for each episode that ended in success, else 0."""
    return [float(room.success) for room in environments]


def shows_pictures(processor: Any) -> bool:
    """Whether a model's chat template shows a picture that a tool replies with.

    Args:
        processor: what ``AutoProcessor.from_pretrained`` gives for the model.
    """
    if not hasattr(processor, "image_processor"):
        return False
    call = {"type": "function", "function": {"name": "observe", "arguments": {}}}
    said = {"role": "assistant", "content": "", "tool_calls": [call]}
    parts = [{"type": "image"}, {"type": "text", "text": _PROBE}]
    try:
        with_picture, without = (
            processor.apply_chat_template(
                [{"role": "user", "content": "go"}, said, {"role": "tool", "content": content}],
                tokenize=False,
            )
            for content in (parts, parts[1:])
        )
    except (TemplateError, TypeError):
        return False
    return _PROBE in with_picture and with_picture != without


def _content(turn: Turn) -> str | list[dict[str, Any]]:
    if turn.picture is None:
        return turn.text
    picture = Image.fromarray(turn.picture)
    return [{"type": "image", "image": picture}, {"type": "text", "text": turn.text}]
