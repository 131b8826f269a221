"""Copies of a real, tiny model in Ray actors."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")
pytest.importorskip("ray", reason="needs the extra ray")

import ray
from tiny_qwen import make_tiny_qwen

from agents.vlm.chat import Message, ModelError
from agents.vlm.clients.local import LocalClient
from agents.vlm.clients.model_actors import ModelActors
from agents.vlm.settings import AgentSettings
from er_gym.rollout.cluster.session import ray_backend
from er_gym.rollout.cluster.settings import RaySettings


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return str(make_tiny_qwen(tmp_path_factory.mktemp("qwen2"), family="qwen2"))


def settings(**local):
    return AgentSettings.model_validate(
        {
            "sees": "text",
            "sampling": {"max_tokens": 12, "temperature": 1.0},
            "local": {"dtype": "float32", "device_map": "cpu", **local},
        }
    )


def test_copies_reply_as_a_model_here_also_after_one_has_died(model, tmp_path):
    talks = [(Message("user", (f"Where is the mug, {n}?",)),) for n in range(6)]
    here = LocalClient(model, settings())
    wanted = [here.reply(talk, seed) for seed, talk in enumerate(talks)]
    with ray_backend(RaySettings(), print):
        actors = ModelActors(model, settings(actors=2, actor_cpus=0.1))
        assert actors.identity == here.identity
        here.close()

        def reply(seed):
            return actors.reply(talks[seed], seed)

        with ThreadPoolExecutor(4) as pool:
            for is_first in (True, False):
                replies = list(pool.map(reply, range(6)))
                assert [each.text for each in replies] == [each.text for each in wanted]
                assert [each.usage.total for each in replies] == [
                    each.usage.total for each in wanted
                ]
                if is_first:
                    ray.kill(actors._actors[0], no_restart=False)
        with pytest.raises(ModelError, match=r"lower pictures\.keep"):
            actors.reply((Message("user", ("mug " * 50_000,)),), 0)
        actors.close()
        with pytest.raises(ValueError, match="empty"):  # what stands in the way is one line
            ModelActors(str(tmp_path / "empty"), settings(actors=1, actor_cpus=0.1))


def test_actors_need_a_cluster(model):
    with pytest.raises(ValueError, match=r"local\.actors needs a cluster: give --executor ray"):
        ModelActors(model, settings(actors=1))
