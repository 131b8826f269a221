"""What a worker elsewhere must have, and what travels with it."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import pytest

from er_gym.rollout.cluster.modules import modules_of
from er_gym.rollout.cluster.origin import Origin, missing_there
from er_gym.rollout.cluster.session import RayUnavailable, ray_backend
from er_gym.rollout.cluster.settings import RaySettings


def test_a_worker_with_another_version_is_told_apart():
    here = Origin("driver", "3.11", "0.1.0")
    there = replace(here, host="node7")
    assert here.misfit(there) == ""
    assert here.misfit(replace(there, python="3.12")) == (
        "node node7 has Python 3.12, this machine has 3.11; install the same on all nodes"
    )
    assert "node7 has er-gym 0.2.0" in here.misfit(replace(there, er_gym="0.2.0"))
    error = ImportError(name="panda3d")
    assert "node7 cannot import panda3d; install er-gym 0.1.0" in missing_there(there, error)


def test_modules_that_are_not_installed_travel(tmp_path, monkeypatch):
    (tmp_path / "mine.py").touch()
    (tmp_path / "ours" / "inner").mkdir(parents=True)
    (tmp_path / "ours" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    names = [
        "mine:Agent",
        "ours.inner.more:Agent",
        "ours:Other",
        "oracle",
        "rl:runs/x",
        "no_such:A",
    ]
    names += ["numpy:array", "json:loads", "agents.scripted.oracle:OracleAgent"]
    assert modules_of(names) == [tmp_path / "mine.py", tmp_path / "ours"]


@pytest.mark.parametrize("given", [{"cpus": -1}, {"cpus": float("nan")}, {"memory": 1}])
def test_impossible_workers_are_refused(given):
    with pytest.raises(ValueError, match="give"):
        RaySettings(**given)


@pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed")
@pytest.mark.parametrize("address", ["127.0.0.1:1", "ray://127.0.0.1:1", "nowhere", "1.2.3.4:x"])
def test_an_address_without_a_cluster_is_one_line(address):
    with (
        pytest.raises(RayUnavailable, match="give the address that `ray status` accepts"),
        ray_backend(RaySettings(address), print),
    ):
        pass
