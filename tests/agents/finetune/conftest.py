"""A small collection, its conversations in few words, and tiny models that know these words."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it
sys.path.append(str(Path(__file__).parents[1] / "vlm"))  # for tiny_qwen

pytest.importorskip("torch", reason="needs the extra finetune")
pytest.importorskip("transformers", reason="needs the extra finetune")
pytest.importorskip("peft", reason="needs the extra finetune")
pytest.importorskip("tensorboard", reason="needs the extra finetune")

from played_collection import make_collection
from support import one_torch_thread
from tiny_models import make_model

from agents.finetune.samples import open_samples
from agents.finetune.settings import DataSettings
from er_gym.data.chat import Chat
from er_gym.data.collection import Collection

DIALECT = """
thoughts: tags
system: "Do the task. {actions}"
first: "{picture}Task: {task}"
after: "{picture}Now?"
forward: "{picture}Closer. Now?"
observed: "Right{picture}behind{picture}left{picture}Now?"
failed: "<|feedback|>{action} failed. {feedback}"
astray: "{picture}{action} went astray."
actions: {navigate to: go, pickup: take, put in: put, toggle: switch, open: open, close: close,
  observe: look, move forward: step, end: stop}
item: "{form}"
reply_told: "It said: {reply}"
"""
Models = Callable[..., Path]


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    """Eight short episodes; some have a mistake that is not to be learnt, and feedback on it."""
    folder = tmp_path_factory.mktemp("finetune") / "played"
    made = make_collection(folder, parts=["mixed"], width=128, height=72)
    made.write(list(made.trajectories())[:8])
    return made


@pytest.fixture(scope="session")
def blind(played: Collection, tmp_path_factory: pytest.TempPathFactory) -> Collection:
    """The same without pictures."""
    seen = [
        each.model_copy(
            update={"turns": [turn.model_copy(update={"pictures": []}) for turn in each.turns]}
        )
        for each in played.trajectories()
    ]
    made = Collection.create(tmp_path_factory.mktemp("finetune") / "blind", played.manifest)
    made.write(seen)
    return made


@pytest.fixture(scope="session")
def dialect(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("finetune") / "brief"
    folder.mkdir()
    for language in ("en", "zh"):
        (folder / f"{language}.yaml").write_text(DIALECT, encoding="utf-8")
    return str(folder)


@pytest.fixture(scope="session")
def chats(played: Collection, dialect: str) -> tuple[Chat, ...]:
    return open_samples([played.path], DataSettings(dialect=dialect)).chats


@pytest.fixture(scope="session")
def models(chats: tuple[Chat, ...], tmp_path_factory: pytest.TempPathFactory) -> Models:
    """The directory of a family's model."""
    made: dict[tuple[str, int], Path] = {}

    def directory(family: str = "qwen2_5_vl", spare: int = 0) -> Path:
        if (family, spare) not in made:
            to = tmp_path_factory.mktemp(family) / "model"
            made[family, spare] = make_model(to, chats, family, spare)
        return made[family, spare]

    return directory
