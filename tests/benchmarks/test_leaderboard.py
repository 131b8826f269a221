"""Submissions: an honest one passes, and forged ones are found, each by its name."""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from click.testing import CliRunner

from agents import OracleAgent
from agents.vlm.agent import VLMAgent
from agents.vlm.clients.scripted import ScriptedClient
from agents.vlm.matching import Matcher
from agents.vlm.prompts import prompts_for
from agents.vlm.record import ConversationRecord
from agents.vlm.settings import AgentSettings
from benchmarks.cli import leaderboard as command
from benchmarks.leaderboard import submission as files
from benchmarks.leaderboard.board import row
from benchmarks.leaderboard.checking import Checked, check
from benchmarks.leaderboard.months import fresh_of, month_seed
from benchmarks.leaderboard.packing import CannotSubmit, claims, pack, without_folders
from benchmarks.leaderboard.page import page
from benchmarks.leaderboard.problems import KINDS
from benchmarks.leaderboard.secrets import FORMS, secrets_in
from benchmarks.leaderboard.submission import Costs, Submission, packed, read_submission
from benchmarks.leaderboard.suites import board_suite
from er_gym import __version__
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import StepRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import jsonl_format
from er_gym.tasks.suites import Suite, own_tasks
from er_gym.tasks.task import Task
from er_gym.tasks.types import GROUPS
from er_gym.writing import file_stem

SCENE = "FloorPlan301"
TYPES = ("single_search", "single_pickup", "single_toggle", "pickup_and_put")
KEY = "sk-proj-abcdefghijklmnopqrstuvwxyz0123456789"
SAID = ("observe", "navigate to Bed", "end")
COST = 0.25


class HalfOracle(OracleAgent):
    """The oracle, which says at once that every second task is done."""

    played = 0

    def reset(self, task: Task, obs: Any, info: Any) -> None:
        super().reset(task, obs, info)
        HalfOracle.played += 1
        self._lazy = HalfOracle.played % 2 == 0

    def act(self, obs: Any, info: Any) -> Decision:
        return Decision("end") if self._lazy else super().act(obs, info)


class Runs(NamedTuple):
    """Two honest runs: the submissions, and the suite that they play."""

    suite: Suite
    script: Submission
    model: Submission
    directory: Path

    def find(self, name: str) -> Suite:
        if name != self.suite.name:
            raise ValueError(f"{name} is no suite")
        return self.suite

    def checked(self, told: Submission | bytes, folder: Path, **options: Any) -> Checked:
        file = folder / "told.jsonl.gz"
        file.write_bytes(told if isinstance(told, bytes) else packed(told))
        return check(file, self.find, **options)


def manifest_of(suite: Suite, agent: str, **env: Any) -> Manifest:
    return Manifest(
        suite=suite.name,
        suite_digest=suite.digest,
        suite_size=len(suite.tasks),
        agent=agent,
        agent_settings={"sees": "pictures"} if agent.startswith("scripted") else {},
        env={"instances": "explore", **suite.env, **env},
        seed=3,
        er_gym=__version__,
    )


def play_all(
    directory: RunDirectory, tasks: tuple[Task, ...], make: Callable[[], Any], **env: Any
) -> None:
    """Play tasks into a run directory, in this process."""
    manifest = directory.manifest
    played_in = EmbodiedEnv((), **manifest.env)
    for task in tasks:
        agent, seed = make(), episode_seed(manifest.seed, task.id)
        record = play_episode(played_in, agent, task, seed, agent_name=manifest.agent)
        if hasattr(agent, "attachments"):
            stem = file_stem(task.id)
            folders = ("conversations", "pictures")
            directory.attach(task.id, agent.attachments(record, stem), folders)
        directory.write(record)
    played_in.close()


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    there = [task for task in own_tasks("er-1k") if task.scene == SCENE]
    tasks = tuple(next(task for task in there if task.type.name == name) for name in TYPES)
    suite = Suite("bedroom", tasks, jsonl_format.digest(tasks), {"field_of_view": 80.0})
    folder = tmp_path_factory.mktemp("runs")
    HalfOracle.played = 0
    script = RunDirectory.create(folder / "script", manifest_of(suite, "half", obs_mode="text"))
    play_all(script, tasks, HalfOracle)
    size = {"width": 64, "height": 48}
    env = manifest_of(suite, "scripted:x", obs_mode="rgb+text", **size)
    model = RunDirectory.create(folder / "model", env)
    options = AgentSettings()
    prompts, matcher = prompts_for(options), Matcher(options.matching)

    def talker() -> VLMAgent:
        from agents.vlm.chat import Reply

        left = iter(f"<DecisionMaking>{each}</DecisionMaking>" for each in SAID)
        client = ScriptedClient(lambda _: Reply(next(left), model="x", cost=COST))
        return VLMAgent(client, options, prompts, matcher, 7, "scripted:x")

    play_all(model, tasks, talker)
    made = []
    for name in ("script", "model"):
        file = folder / f"{name}.jsonl.gz"
        file.write_bytes(pack(folder / name, name=name))
        made.append(read_submission(file))
    return Runs(suite, *made, folder)


def consistent(told: Submission) -> Submission:
    """The submission with a header that fits what it now holds, as a careful forger leaves it."""
    header = told.header.model_copy(
        update={
            "episodes": len(told.episodes),
            "conversations": len(told.conversations),
            "results": claims(told),
            "costs": Costs.of(told.conversations.values()),
        }
    )
    return replace(told, header=header)


def with_episode(told: Submission, number: int, **fields: Any) -> Submission:
    """The submission with another episode in place of one."""
    episodes = [*told.episodes]
    episodes[number] = episodes[number].model_copy(update=fields)
    return replace(told, episodes=tuple(episodes))


def failed(told: Submission) -> int:
    return next(n for n, each in enumerate(told.episodes) if not each.success)


def solved(told: Submission) -> int:
    return next(n for n, each in enumerate(told.episodes) if each.success)


def with_step(told: Submission, number: int, step: int, **fields: Any) -> Submission:
    steps = [*told.episodes[number].steps]
    steps[step] = steps[step].model_copy(update=fields)
    return with_episode(told, number, steps=steps)


def with_talk(told: Submission, change: Callable[[dict[str, Any]], None]) -> Submission:
    key, *_ = told.conversations
    talk = json.loads(told.conversations[key].model_dump_json())
    change(talk)
    talks = {**told.conversations, key: ConversationRecord.model_validate(talk)}
    return replace(told, conversations=talks)


def with_manifest(told: Submission, **fields: Any) -> Submission:
    manifest = told.header.manifest.model_copy(update=fields)
    header = told.header.model_copy(update={"manifest": manifest})
    digest = manifest.digest
    records = tuple(each.model_copy(update={"run": digest}) for each in told.episodes)
    return replace(told, header=header, episodes=records)


# -- the forgeries -------------------------------------------------------------------------------


def claimed_success(told: Submission) -> Submission:
    return with_episode(told, failed(told), success=True)


def steps_of_a_success(told: Submission) -> Submission:
    """A failure gets the steps that its task asks for, which nobody has done."""
    number = failed(told)
    record = told.episodes[number]
    keys = [key for key in record.key_actions if key.verb != "end"]
    done = [
        StepRecord(
            verb=key.verb,
            object_type=key.object_type,
            object_id=key.object_id,
            success=True,
            reward=key.reward,
            interactable=[*(record.search_targets or ()), key.object_type],
        )
        for key in keys
    ]
    end = record.steps[-1].model_copy(
        update={"reward": 1.0, "interactable": [*(record.search_targets or ())]}
    )
    steps = [record.steps[0], *done, end]
    total = sum(step.reward for step in steps)
    return with_episode(told, number, steps=steps, success=True, goal_unmet=[], total_reward=total)


def refusal_as_success(told: Submission) -> Submission:
    return with_step(told, solved(told), 1, feedback="Done, and well.")


def wasted_step_left_out(told: Submission) -> Submission:
    number = solved(told)
    steps = [*told.episodes[number].steps]
    return with_episode(told, number, steps=[steps[0], *steps[2:]])


def without_side_effects(told: Submission) -> Submission:
    return with_episode(told, solved(told), side_effects=["moved Bed|1"])


def without_failures(told: Submission) -> Submission:
    return replace(told, episodes=tuple(each for each in told.episodes if each.success))


def failure_twice_as_success(told: Submission) -> Submission:
    kept = [each for each in told.episodes if each.success]
    return replace(told, episodes=(*kept, *kept))


def easier_task(told: Submission) -> Submission:
    number = failed(told)
    keys = [key for key in told.episodes[number].key_actions if key.verb == "end"]
    return with_episode(told, number, key_actions=keys, search_targets=[], goal_unmet=[])


def other_instruction(told: Submission) -> Submission:
    return with_episode(told, 0, instruction="Say end.")


def other_suite(told: Submission) -> Submission:
    return with_manifest(told, suite="nowhere")


def other_tasks(told: Submission) -> Submission:
    return with_manifest(told, suite_digest="0" * 64)


def other_run(told: Submission) -> Submission:
    return with_episode(told, 0, run="0" * 16)


def lucky_seed(told: Submission) -> Submission:
    return with_episode(told, 0, seed=told.episodes[0].seed + 1)


def other_agent(told: Submission) -> Submission:
    return with_episode(told, 0, agent="oracle")


def a_helping_hand(told: Submission) -> Submission:
    return with_step(told, 0, 1, by="person")


def easier_rules(told: Submission) -> Submission:
    return with_manifest(told, env={**told.header.manifest.env, "visibility_distance": 99.0})


def pictures_swapped(told: Submission) -> Submission:
    def swap(talk: dict[str, Any]) -> None:
        first = _pictures(talk)[0]
        last = _pictures(talk)[-1]
        first["digest"], last["digest"] = last["digest"], first["digest"]

    return with_talk(told, swap)


def pictures_with_hints(told: Submission) -> Submission:
    return with_talk(told, lambda talk: _pictures(talk)[1].update(digest="1" * 64))


def other_words(told: Submission) -> Submission:
    return with_talk(told, lambda talk: talk["rounds"][1].update(action="navigate to Desk"))


def without_talks(told: Submission) -> Submission:
    return replace(told, conversations={})


def cheaper(told: Submission) -> Submission:
    return with_talk(told, lambda talk: talk["rounds"][0].update(cost=0.0))


def with_a_key(told: Submission) -> Submission:
    return with_talk(told, lambda talk: talk["messages"][0].update(parts=[f"key {KEY}"]))


def better_results(told: Submission) -> Submission:
    results = {name: dict(each) for name, each in told.header.results.items()}
    mean = results["corrected"]["success"]
    results["corrected"]["success"] = mean.model_copy(update={"mean": mean.mean + 1e-15})
    return replace(told, header=told.header.model_copy(update={"results": results}))


def cheaper_header(told: Submission) -> Submission:
    costs = told.header.costs.model_copy(update={"usd": 0.01})
    return replace(told, header=told.header.model_copy(update={"costs": costs}))


def _pictures(talk: dict[str, Any]) -> list[dict[str, Any]]:
    parts = [part for message in talk["messages"] for part in message["parts"]]
    return [part for part in parts if isinstance(part, dict)]


FORGED = {
    claimed_success: ("script", "verdict"),
    steps_of_a_success: ("script", "replay"),
    refusal_as_success: ("script", "replay"),
    wasted_step_left_out: ("script", "replay"),
    without_side_effects: ("script", "replay"),
    without_failures: ("script", "dropped"),
    failure_twice_as_success: ("script", "dropped"),
    easier_task: ("script", "task"),
    other_instruction: ("script", "task"),
    other_suite: ("script", "suite"),
    other_tasks: ("script", "suite"),
    other_run: ("script", "mixed"),
    lucky_seed: ("script", "mixed"),
    other_agent: ("script", "mixed"),
    a_helping_hand: ("script", "mixed"),
    easier_rules: ("script", "rules"),
    pictures_swapped: ("model", "picture"),
    pictures_with_hints: ("model", "picture"),
    other_words: ("model", "talk"),
    without_talks: ("model", "talk"),
    cheaper: ("model", "talk"),
    with_a_key: ("model", "secret"),
}
"""By what was forged: the run, and the kind of problem under which it is found."""
CARELESS = {better_results: ("script", "claim"), cheaper_header: ("model", "cost")}
"""Those whose header does not fit."""


def test_an_honest_submission_passes(runs: Runs, tmp_path: Path) -> None:
    for told in (runs.script, runs.model):
        found = runs.checked(told, tmp_path)
        assert [*map(str, found.problems)] == []
        assert (found.replayed, found.notes) == (len(told.episodes), ())
    assert {each.success for each in runs.script.episodes} == {True, False}
    assert runs.model.header.costs.usd == len(SAID) * len(runs.suite.tasks) * COST
    # The same run gives the same bytes.
    assert pack(runs.directory / "script", name="script") == packed(runs.script)


@pytest.mark.parametrize("forge", [*FORGED, *CARELESS], ids=lambda each: each.__name__)
def test_a_forged_submission_is_found_and_named(
    runs: Runs, tmp_path: Path, forge: Callable[[Submission], Submission]
) -> None:
    name, kind = {**FORGED, **CARELESS}[forge]
    told = forge(getattr(runs, name))
    assert told != getattr(runs, name)
    found = runs.checked(consistent(told) if forge in FORGED else told, tmp_path)
    assert kind in {each.kind for each in found.problems}, found.problems
    if kind != "dropped":  # the records that are left are right
        assert {each.kind for each in found.problems} <= {kind, "replay", "verdict", "claim"}


def test_the_kinds_are_at_least_ten() -> None:
    kinds = {kind for _, kind in {**FORGED, **CARELESS}.values()}
    assert len(kinds) >= 10
    assert kinds | {"file"} == set(KINDS)
    assert len({**FORGED, **CARELESS}) >= 20


def test_other_versions_draw_other_pictures_so_they_are_not_compared(
    runs: Runs, tmp_path: Path
) -> None:
    older = {**runs.model.header.versions, "pillow": "1.0"}
    header = runs.model.header.model_copy(update={"versions": older})
    found = runs.checked(replace(runs.model, header=header), tmp_path)
    assert not found.problems
    assert found.notes[0].startswith("the pictures are not compared: pillow is ")


def test_what_a_stranger_invents_is_a_problem_and_no_error(runs: Runs, tmp_path: Path) -> None:
    told = with_episode(runs.script, 0, task_type="juggling")
    told = with_step(told, 1, 1, verb="juggle", text="")
    kinds = {each.kind for each in runs.checked(told, tmp_path).problems}
    assert kinds == {"verdict", "claim", "task", "replay"}

    def huge(talk: dict[str, Any]) -> None:
        talk["settings"]["pictures"].update(min_pixels=10**12, max_pixels=10**12)

    (problem,) = runs.checked(with_talk(runs.model, huge), tmp_path).problems
    assert problem.kind == "picture"
    assert "1,000,000,000,000 pixels" in problem.words
    env = {**runs.script.header.manifest.env, "width": "wide"}
    found = runs.checked(with_manifest(runs.script, env=env), tmp_path)
    assert {each.kind for each in found.problems} == {"replay"}


HEADER = b'{"format": "er-gym/submission/1"}\n'


# Named here: a gzip's bytes hold the time, and pytest would make ids of them.
NO_SUBMISSION = {
    "no gzip": (b"no gzip", "not a whole gzip file"),
    "nothing": (gzip.compress(b""), "empty"),
    "no name": (gzip.compress(HEADER), "the first line lacks field 'name'"),
    "no JSON": (gzip.compress(b"{"), "not JSON"),
    "a long line": (gzip.compress(b"[" * 5_000_000), "line 1 is longer than 4 MiB"),
    "nested": (gzip.compress(b"[" * 3000), "nested too deeply"),
}


@pytest.mark.parametrize(("data", "words"), NO_SUBMISSION.values(), ids=NO_SUBMISSION)
def test_a_file_that_is_no_submission_is_one_line(
    runs: Runs, tmp_path: Path, data: bytes, words: str
) -> None:
    found = runs.checked(data, tmp_path)
    (problem,) = found.problems
    assert problem.kind == "file"
    assert words in problem.words
    assert "\n" not in problem.words


def test_a_stream_has_an_end(runs: Runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("er_gym.tasks.reading.stream_json_lines.__defaults__", (1000,))
    (problem,) = runs.checked(runs.script, tmp_path).problems
    assert "larger than er-gym reads" in problem.words


def test_a_stranger_names_no_module_and_no_file(tmp_path: Path) -> None:
    for name in ("small_suite:small", "/etc/passwd", "../er-1k", "er-1k-fresh-x", "os:system"):
        with pytest.raises(ValueError, match="none of er-gym's own suites"):
            board_suite(name)
    with pytest.raises(ValueError, match="this makes them: er-gym bench --suite mini --fresh 77"):
        board_suite("mini-fresh-77")
    assert board_suite("mini").name == "mini"


def test_a_run_with_a_key_in_it_is_not_packed(
    runs: Runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = sorted((runs.directory / "script" / "episodes").glob("*.json"))[0]
    before = file.read_text(encoding="utf-8")
    try:
        file.write_text(before.replace('"thought": "', f'"thought": "{KEY} ', 1), encoding="utf-8")
        with pytest.raises(CannotSubmit, match=r"the record of .* holds an API key, so it is not"):
            pack(runs.directory / "script")
    finally:
        file.write_text(before, encoding="utf-8")
    # The value of a variable is found whatever its form.
    monkeypatch.setenv("MY_TOKEN", runs.script.episodes[0].instruction)
    with pytest.raises(CannotSubmit, match="environment variable") as caught:
        pack(runs.directory / "script")
    assert runs.script.episodes[0].instruction not in str(caught.value)


def test_secrets_are_known_by_their_form() -> None:
    told = {
        "an API key": KEY,
        "a token of Hugging Face": "hf_" + "a1" * 17,
        "a token of GitHub": "ghp_" + "a1" * 18,
        "a key of Google": "AIza" + "a1" * 18,
        "a key of Amazon": "AKIA" + "A1" * 8,
        "a header with a key": "Authorization: Bearer " + "a1" * 12,
        "a web token": "eyJ" + "a" * 12 + ".eyJ" + "b" * 12,
        "a private key": "-----BEGIN RSA PRIVATE KEY-----",
        "an address with a password": "http://me:secret@host/v1",
    }
    assert {name: [*secrets_in(text)] for name, text in told.items()} == {
        name: [name] for name in FORMS
    }
    plain = "Go to the desk-lamp; task-by-task, see http://localhost:8000/v1 at risk-free-and-more."
    assert not [*secrets_in(plain)]


def test_a_month_has_a_seed_that_nobody_knows_before() -> None:
    beacon = "0123456789abcdef" * 4
    seed = month_seed("er-1k", "2026-12", beacon)
    assert 0 <= seed < 2**31
    others = [
        month_seed("er-1k", "2027-01", beacon),
        month_seed("mini", "2026-12", beacon),
        month_seed("er-1k", "2026-12", beacon[::-1]),
    ]
    assert len({seed, *others}) == 4
    for wrong in (("2026-13", beacon), ("2026-12", "abc"), ("2026-12", beacon.upper())):
        with pytest.raises(ValueError, match=r"is no (month|beacon)"):
            month_seed("er-1k", *wrong)
    assert fresh_of(f"er-1k-fresh-{seed}") == ("er-1k", seed)
    assert fresh_of("er-1k") is None


def test_the_page_shows_a_row_for_each_and_trusts_no_name(runs: Runs, tmp_path: Path) -> None:
    header = runs.script.header.model_copy(update={"name": "<script>x</script>", "by": "me & you"})
    honest = runs.checked(replace(runs.script, header=header), tmp_path)
    costly = runs.checked(runs.model, tmp_path, replay=False)
    forged = runs.checked(consistent(without_failures(runs.script)), tmp_path, replay=False)
    assert (honest.problems, costly.problems) == ((), ())
    rows = [row(honest, {"bedroom": "2026-12"}), row(costly, {})]
    told = rows[0]
    assert (told["Success, %"].text, told["95 %"].text) == ("25.0", "4.6 to 69.9")
    assert told["Tidy success, %"].text == "25.0"
    assert (told.suite, told.instances) == ("bedroom (held out, 2026-12)", "explore")
    assert told["Unseen room, %"].text == "25.0 (4)"
    assert [told[f"{group}, %"].text for group in GROUPS[:3]] == ["0.0 (1)", "50.0 (2)", "0.0 (1)"]
    assert told["US$ per solved task"].text == "-"
    assert (told["Tasks"].text, told["Replayed"].text) == ("4 of 4", "4")
    assert rows[1]["Replayed"].text == "no"
    assert rows[1].suite == "bedroom (no month's)"
    text = page(rows, [forged])
    assert "<script>x" not in text
    assert "&lt;script&gt;x" in text
    assert "me &amp; you" in text
    assert "80.96" in text
    assert text.index("Measured elsewhere") < text.index("80.96")
    assert "Not listed" in text
    assert "dropped: " in text
    assert "http" not in text.replace("arXiv", "")


def test_rows_that_do_not_compare_are_apart_and_references_are_marked(
    runs: Runs, tmp_path: Path
) -> None:
    honest = row(runs.checked(runs.script, tmp_path, replay=False), {})
    env = {**runs.script.header.manifest.env, "instances": "target"}
    oracle = with_manifest(runs.script, env=env, agent="oracle")
    helped = row(runs.checked(oracle, tmp_path, replay=False), {})
    assert (honest.reference, helped.reference) == (False, True)
    assert (honest["Kind"].text, helped["Kind"].text) == ("agent", "reference")
    text = page([helped, honest], [])
    explore, target = re.findall(r"<table id='board-\d'>.*?</table>", text, re.DOTALL)
    assert text.index("instances explore</h2>") < text.index("instances target</h2>")
    assert ("class=reference" in explore, "class=reference" in target) == (False, True)
    assert "knows the key actions" in target
    # What no row has is no column, and each is explained.
    assert "US$" not in explore
    assert "<dt>US$ per solved task</dt>" in text
    assert explore.count("aria-sort=descending") == 1


def test_the_engine_tells_the_side_effects_that_an_older_record_does_not(
    runs: Runs, tmp_path: Path
) -> None:
    told = runs.script
    for number in range(len(told.episodes)):
        told = with_episode(told, number, side_effects=None)
    told = consistent(told)
    unplayed = runs.checked(told, tmp_path, replay=False)
    assert row(unplayed, {})["Tidy success, %"].text == "-"
    played = runs.checked(told, tmp_path)
    assert not played.problems
    assert played.episodes == runs.script.episodes
    assert row(played, {})["Tidy success, %"].text == "25.0"


def test_a_submission_does_not_say_where_a_model_lay() -> None:
    told = {
        "hf:/home/me/my models/it/": "hf:it",
        "rl:~/runs/a-0": "rl:a-0",
        "rl:../a-0": "rl:a-0",
        "human+hf:/x/it": "human+hf:it",
        "/home/me/it": "it",
        "hf:org/model": "hf:org/model",
        "zoo:all": "zoo:all",
        "module:NAME": "module:NAME",
    }
    assert {spec: without_folders(spec) for spec in told} == told


def test_the_commands_pack_check_and_build(
    runs: Runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.leaderboard.suites.board_suite", runs.find)
    assert command.SUFFIX == files.SUFFIX

    def said(group: Any, *words: str) -> tuple[int, str]:
        done = CliRunner().invoke(group, words, standalone_mode=False)
        assert done.exception is None or words[0] == "refused", done.exception
        return int(done.return_value or 0), done.output

    file = tmp_path / "x.jsonl.gz"
    assert said(command.submit, str(runs.directory / "script"), "--out", str(file))[0] == 0
    code, output = said(command.leaderboard, "check", str(file))
    assert (code, output) == (0, f"{file}: as it says: 4 episodes, 4 played again\n")
    (tmp_path / "y.jsonl.gz").write_bytes(packed(consistent(claimed_success(runs.script))))
    code, output = said(command.leaderboard, "check", "--no-replay", str(tmp_path / "y.jsonl.gz"))
    assert code == 1
    assert "refused, 1 problem\n  verdict: " in output
    code, output = said(command.leaderboard, "build", str(tmp_path), "--no-replay")
    assert output == f"{tmp_path / 'index.html'}: 1 submissions listed, 1 not\n"
    beacon = "0f" * 32
    code, output = said(command.leaderboard, "month", "er-1k", "2026-12", beacon)
    assert f"--fresh {month_seed('er-1k', '2026-12', beacon)} " in output
