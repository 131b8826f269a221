"""The models that come with the package: what their folders hold, and that they play."""

from __future__ import annotations

import json
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from agents.rl.config import config_names
from agents.zoo import index
from agents.zoo.card import LICENCE
from agents.zoo.index import CARD, FOLDER, MOST_BYTES, SUFFIXES, files_of, find_model, model_names
from benchmarks.cli.main import cli
from er_gym.envs.actions import INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.tasks import load_suite
from er_gym.tasks.types import GROUPS

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MODELS = [find_model(name) for name in model_names()]
NAMED = pytest.mark.parametrize("model", MODELS, ids=model_names())


def test_all_models_together_are_small() -> None:
    assert sum(file.stat().st_size for file in files_of(FOLDER)) <= MOST_BYTES
    assert {folder.name for folder in FOLDER.iterdir()} == set(model_names())


def header(file: Path) -> dict[str, Any]:
    """What a file of safetensors says of its tensors; nothing else of it is read."""
    data = file.read_bytes()
    length = int.from_bytes(data[:8], "little")
    found = json.loads(data[8 : 8 + length])
    found.pop("__metadata__", None)
    assert len(data) == 8 + length + max(each["data_offsets"][1] for each in found.values())
    return dict(found)


@NAMED
def test_a_folder_holds_weights_and_text_alone(model: index.ZooModel) -> None:
    files = list(files_of(model.folder))
    assert not any(file.is_symlink() for file in files)
    assert {file.suffix for file in files} <= {*SUFFIXES}
    for file in files:
        if file.suffix != ".safetensors":
            words = file.read_text(encoding="utf-8")
            assert not any(place in words for place in ("/tmp", "/home", "/root", "/work"))


@NAMED
def test_a_card_is_true(model: index.ZooModel) -> None:
    card = model.card
    files = [file for file in files_of(model.folder) if file.name != CARD]
    assert card.bytes == sum(file.stat().st_size for file in files)
    [weights] = [header(file) for file in files if file.suffix == ".safetensors"]
    assert card.parameters == sum(math.prod(each["shape"]) for each in weights.values())
    short = {"float16": "F16", "bfloat16": "BF16", "float32": "F32"}[card.dtype]
    assert {each["dtype"] for each in weights.values()} == {short}
    assert card.figures
    for figure in card.figures:
        groups = figure.groups
        assert list(groups) == [name for name in GROUPS if name in groups]
        assert sum(each.n for each in groups.values()) == figure.success.n
        assert sum(each.successes for each in groups.values()) == figure.success.successes


@NAMED
def test_the_commands_of_a_card_exist(model: index.ZooModel) -> None:
    for line in model.card.made_by:
        program, name, *words = shlex.split(line)
        assert program == "er-gym"
        command = cli.commands[name]
        with click.Context(command) as context:
            given, _, _ = command.make_parser(context).parse_args(list(words))
        if name == "train-rl":
            assert given["config"] in config_names()


def test_the_licence_is_the_projects(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())
    assert project["project"]["license"] == LICENCE
    assert {model.card.licence for model in MODELS} == {LICENCE}


def test_the_wheel_takes_the_folders_of_the_models(repository: Path) -> None:
    """Nothing of them is left out of the package, by the project's file or by git's."""
    told = tomllib.loads((repository / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    wheel, sdist = told["targets"]["wheel"], told["targets"]["sdist"]
    assert repository / "agents" / "zoo" / "models" == FOLDER
    assert "agents" in wheel["packages"]
    assert "/agents" in sdist["include"]
    assert not any(rule.startswith("/agents") or ("*." in rule and "build_" not in rule)
                   for rule in wheel["exclude"])  # fmt: skip
    files = [str(file.relative_to(repository)) for file in files_of(FOLDER)]
    asked = ["git", "check-ignore", "--no-index", "--stdin"]
    done = subprocess.run(asked, input="\n".join(files), cwd=repository, capture_output=True,
                          text=True)  # fmt: skip
    if done.returncode not in (0, 1):
        pytest.skip("this is no checkout of git")
    assert done.stdout == ""


def test_the_page_lists_the_models_as_they_are(repository: Path) -> None:
    listed = CliRunner().invoke(cli, ["zoo", "--format", "md"]).stdout
    rows = [line for line in listed.splitlines() if line.startswith("|")]
    assert len(rows) >= 2 + len(MODELS)
    page = (repository / "docs" / "zoo.md").read_text()
    assert "\n".join(rows) in page, "put the table of `er-gym zoo --format md` into docs/zoo.md"


@pytest.mark.parametrize("name", [each.name for each in MODELS if each.card.kind == "policy"])
def test_a_policy_plays_at_once(name: str) -> None:
    pytest.importorskip("torch", reason="needs the extra rl")
    from agents import make_agent

    agent = make_agent(f"zoo:{name}")
    task = next(each for each in load_suite("mini").tasks if each.type.name == "single_search")
    env = EmbodiedEnv((), obs_mode=agent.obs_mode, instances="explore", width=128, height=72)
    obs, info = env.reset(options={"task": task})
    agent.reset(task, obs, with_details(env, info))
    for _ in range(3):
        action = agent.act(obs, with_details(env, info)).action
        assert info["action_mask"][INDEX[action]]
        obs, _, ended, cut, info = env.step(action)
        if ended or cut:
            break
    env.close()


def test_the_pages_program_plays(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("torch", "transformers"):
        pytest.importorskip(name, reason="needs the extra local")
    page = (repository / "docs" / "zoo.md").read_text()
    (program,) = re.findall(r"```python\n(.*?)```", page, re.S)
    exec(program, {})
    *steps, end = capsys.readouterr().out.splitlines()
    assert sum(" -> " in line for line in steps) > 2
    assert end in ("success: True", "success: False")


@pytest.mark.parametrize("kind", ["policy", "language model"])
def test_an_environment_with_other_observations_is_refused(kind: str) -> None:
    for name in ("torch", "transformers"):
        pytest.importorskip(name, reason="needs the extras rl and local")
    from agents import make_agent

    name = next(each.name for each in MODELS if each.card.kind == kind)
    agent = make_agent(f"zoo:{name}")
    env = EmbodiedEnv("mini", obs_mode="depth", width=64, height=36)
    obs, info = env.reset(seed=0)
    wanted = f"needs the observation '{agent.obs_mode}', and the environment gives 'depth'"
    with pytest.raises(ValueError, match=re.escape(wanted)):
        agent.reset(env.task, obs, info)
    env.close()


PROGRAM = """
import sys
sys.modules.update(dict.fromkeys(("torch", "transformers")))  # as if they were not installed
from benchmarks.cli.main import main
main(["bench", "--suite", "mini", "--limit", "1", "--agent", "zoo:" + sys.argv[1], "--out", sys.argv[2]])
"""  # noqa: E501


@pytest.mark.parametrize(
    ("kind", "what"), [("policy", "torch"), ("language model", r"t(orch|ransformers)")]
)
def test_a_missing_package_is_one_line_that_says_what_to_install(
    kind: str, what: str, tmp_path: Path
) -> None:
    model = next((each for each in MODELS if each.card.kind == kind), None)
    if model is None:
        pytest.skip(f"the zoo has no {kind} yet")
    asked = [sys.executable, "-c", PROGRAM, model.name, str(tmp_path / "out")]
    done = subprocess.run(asked, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    problem = done.stderr.splitlines()[-1]
    assert f"zoo:{model.name} needs t" in problem
    assert f"pip install 'er-gym[{model.player.extra}]'" in problem
