"""Sources of episodes: every registered id, the options of reset, every kind of source."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from er_gym.envs.embodied_env import EmbodiedEnv, verification_env
from er_gym.envs.generated_source import TRAINING, GeneratedSource
from er_gym.envs.sources import EpisodeSource, TaskList, make_source
from er_gym.rollout.verification import make_verifier
from er_gym.tasks import TASK_TYPES, Task, TaskType, jsonl_format, load_suite, paper_format, suites
from er_gym.tasks.splits import TRAINING_SCENES, UNSEEN_TYPES, subject_types
from er_gym.tasks.suite_spec import SuiteSpec

IDS = [task_type.env_id for task_type in TASK_TYPES]
MINI = load_suite("mini").tasks
PICKUPS = [task for task in MINI if task.type.name == "single_pickup"]
TOGGLES = [task for task in MINI if task.type.name == "single_toggle"]
REARRANGED = next(task for task in load_suite("er-1k").tasks if task.arrangement.poses)


def drawn(env: gymnasium.Env[Any, Any], seed: int | None = None, **options: Any) -> Task:
    """The task that an episode begins with."""
    env.reset(seed=seed, options=options)
    task: Task = env.unwrapped.task  # type: ignore[attr-defined]
    return task


@pytest.fixture
def make() -> Iterator[Callable[..., EmbodiedEnv]]:
    """Makes environments that see no pictures, and closes them in the end."""
    made = []

    def make(*source: Any, **settings: Any) -> EmbodiedEnv:
        made.append(EmbodiedEnv(*source, obs_mode="state", **settings))
        return made[-1]

    yield make
    for env in made:
        env.close()


# -- drawing ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("env_id", IDS)
def test_an_id_draws_tasks_of_its_type_by_seed(env_id: str) -> None:
    env = gymnasium.make(env_id, obs_mode="state")
    tasks = [drawn(env, seed) for seed in (0, 1, 2, 3)]
    assert {task.type.env_id for task in tasks} == {env_id}
    assert len({task.id for task in tasks}) > 1
    again = gymnasium.make(env_id, obs_mode="state")
    assert [drawn(again, seed) for seed in (3, 0)] == [tasks[3], tasks[0]]
    env.close()
    again.close()


def test_every_type_is_drawn_where_none_is_asked_for() -> None:
    source, rng = make_source("mini", verification_env), np.random.default_rng(0)
    drawn_types = {source.draw(rng, None, None).type for _ in range(200)}
    assert drawn_types == set(TASK_TYPES)


def test_all_types_that_are_asked_for_are_drawn(make: Callable[..., EmbodiedEnv]) -> None:
    types = ["single_search", "single_pickup"]
    env = make("mini", task_type=types)
    assert {drawn(env, seed).type.name for seed in range(12)} == {*types}


def test_without_a_seed_episodes_go_on_from_the_last_one(make: Callable[..., EmbodiedEnv]) -> None:
    one, other = make("mini"), make("mini")
    rows = [[drawn(env, 7), *(drawn(env) for _ in range(5))] for env in (one, other)]
    assert rows[0] == rows[1]
    assert len({task.id for task in rows[0]}) > 3


# -- what reset may be told ------------------------------------------------------------------------


def test_a_task_is_pinned_by_itself_or_by_its_id(make: Callable[..., EmbodiedEnv]) -> None:
    env = make("mini", task_type="single_pickup")
    assert drawn(env, 0, task=TOGGLES[0]) is TOGGLES[0]
    assert drawn(env, 0, task=PICKUPS[3].id) == PICKUPS[3]
    # Pinning says what is played, whatever the environment draws otherwise.
    assert drawn(env, 0, task=TOGGLES[1].id) == TOGGLES[1]
    assert drawn(env, 0, task=REARRANGED) is REARRANGED
    assert drawn(env, 0).type.name == "single_pickup"


def test_a_scene_is_pinned(make: Callable[..., EmbodiedEnv]) -> None:
    scene = PICKUPS[2].scene
    of_any, of_one = make("mini"), make("mini", task_type="single_pickup")
    assert {drawn(of_any, seed, scene=scene).scene for seed in range(4)} == {scene}
    mine = [task for task in PICKUPS if task.scene == scene]
    assert all(drawn(of_one, seed, scene=scene) in mine for seed in range(4))
    assert drawn(of_any, 0, task=PICKUPS[2].id, scene=scene) == PICKUPS[2]


def test_a_suite_is_drawn_from_this_once(make: Callable[..., EmbodiedEnv], tmp_path: Path) -> None:
    env = make(PICKUPS)
    file = tmp_path / "two.jsonl.gz"
    jsonl_format.write_tasks(file, TOGGLES[:2])
    assert all(drawn(env, seed, suite=str(file)) in TOGGLES[:2] for seed in range(3))
    assert drawn(env, 0, suite=file, scene=TOGGLES[1].scene) == TOGGLES[1]
    assert drawn(env, 0, suite="er-1k", task=REARRANGED.id) == REARRANGED
    in_er_1k = drawn(env, 0, suite="er-1k", scene="FloorPlan1")
    assert in_er_1k.scene == "FloorPlan1"
    assert in_er_1k in load_suite("er-1k").tasks
    assert drawn(env, 0, suite=file, task=TOGGLES[0].id, scene=TOGGLES[0].scene) == TOGGLES[0]
    assert drawn(env, 0) in PICKUPS


def test_nothing_pinned_is_the_same_as_no_options(make: Callable[..., EmbodiedEnv]) -> None:
    env = make("mini")
    env.reset(seed=5)
    task = env.task
    assert drawn(env, 5) == drawn(env, 5, task=None, scene=None, suite=None) == task


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "unknown option": ({"scenery": "x"}, r"unknown option 'scenery'.*: task, scene, suite"),
    "no such task": ({"task": "nope"}, r"no task 'nope' among the \d+ of the suite mini"),
    "task elsewhere": (
        {"task": PICKUPS[0].id, "scene": "FloorPlan430"},
        rf"task {PICKUPS[0].id} plays in {PICKUPS[0].scene}, not in FloorPlan430",
    ),
    "Task elsewhere": (
        {"task": PICKUPS[0], "scene": "FloorPlan430"},
        rf"task {PICKUPS[0].id} plays in {PICKUPS[0].scene}, not in FloorPlan430",
    ),
    "task of another suite": ({"task": REARRANGED.id}, "no task .* of the suite mini"),
    "not in that suite": (
        {"task": PICKUPS[0].id, "suite": "er-1k"},
        r"no task .* among the 1000 of the suite er-1k",
    ),
    "no task there": (
        {"scene": "FloorPlan999"},
        r"the suite mini has no single_pickup tasks in FloorPlan999 among its 132 tasks",
    ),
    "no such suite": (
        {"suite": "maxi"},
        r"unknown suite 'maxi'; choose one of: er-1k, er-val, houses-1k, mini",
    ),
    "no such file": ({"suite": "no/such.jsonl"}, r"no/such\.jsonl: no such file"),
    "another kind of file": ({"suite": "some/tasks.csv"}, r"a task file ends in \.json"),
}


@pytest.mark.parametrize(("options", "message"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_is_told_in_one_line(
    options: dict[str, Any], message: str, make: Callable[..., EmbodiedEnv]
) -> None:
    env = make("mini", task_type="single_pickup")
    with pytest.raises(ValueError, match=message) as caught:
        env.reset(seed=0, options=options)
    assert "\n" not in str(caught.value)
    assert drawn(env, 0) in PICKUPS  # and nothing is broken


# -- kinds of source -------------------------------------------------------------------------------


def test_a_list_a_suite_and_a_file_of_the_same_tasks_are_drawn_alike(
    make: Callable[..., EmbodiedEnv], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, packed, paper = (tmp_path / f"own{end}" for end in (".jsonl", ".jsonl.gz", ".json"))
    jsonl_format.write_tasks(plain, MINI)
    jsonl_format.write_tasks(packed, MINI)
    paper_format.write_tasks(paper, MINI)
    monkeypatch.chdir(tmp_path)
    sources = ["mini", MINI, list(MINI), plain, str(packed), "own.jsonl", TaskList(MINI)]
    rows = [[drawn(make(source), seed) for seed in (0, 1)] for source in sources]
    assert all(row == rows[0] for row in rows)
    assert drawn(make(paper), 0).instruction == rows[0][0].instruction


def test_shares_of_a_list_have_every_type_and_no_room_in_common() -> None:
    shares = [TaskList(MINI).share(index, 3) for index in range(3)]
    assert sorted(task.id for share in shares for task in share.tasks) == sorted(
        task.id for task in MINI
    )
    rooms = [{task.scene for task in share.tasks} for share in shares]
    assert not rooms[0] & rooms[1] | rooms[1] & rooms[2] | rooms[0] & rooms[2]
    assert all({task.type for task in share.tasks} == set(TASK_TYPES) for share in shares)


def test_a_list_too_small_to_be_shared_is_everyones() -> None:
    few = TaskList(MINI[:5])
    assert few.share(1, 40) is few


def test_a_list_without_what_is_asked_for_says_so(make: Callable[..., EmbodiedEnv]) -> None:
    env = make(PICKUPS, task_type="single_toggle")
    with pytest.raises(ValueError, match=rf"no single_toggle tasks among its {len(PICKUPS)} tasks"):
        env.reset()
    with pytest.raises(ValueError, match="this environment has no tasks"):
        make([]).reset()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("maxi", "unknown suite 'maxi'; choose one of"),
        ("nowhere/tasks.jsonl", "no such file"),
        (Path("tasks.json"), "no such file"),
        ("train", "er-gym tasks generate --suite train"),
    ],
)
def test_a_source_that_is_not_there_is_told_at_once(
    source: str | Path, message: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ER_GYM_HOME", str(tmp_path))
    monkeypatch.setattr(suites, "_DATA", tmp_path)  # as if no suite came with er-gym
    with pytest.raises(ValueError, match=message):
        EmbodiedEnv(source)


class Counting:
    """A source of one's own: pickups in turn, and a note of what was asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[TaskType | None, str | None]] = []

    def draw(self, rng: np.random.Generator, task_type: TaskType | None, scene: str | None) -> Task:
        self.asked.append((task_type, scene))
        return replace(PICKUPS[len(self.asked) % len(PICKUPS)], id=f"mine-{rng.integers(1000)}")

    def find(self, task_id: str) -> Task:
        return replace(PICKUPS[0], id=task_id)


def test_a_source_of_ones_own_is_asked(make: Callable[..., EmbodiedEnv]) -> None:
    source = Counting()
    assert isinstance(source, EpisodeSource)
    env = make(source, task_type="single_pickup")
    first, second = drawn(env, 4), drawn(env, 4, scene="FloorPlan3")
    assert first.id == second.id  # drawn with the environment's own generator
    assert first.scene != second.scene
    assert source.asked == [(PICKUPS[0].type, None), (PICKUPS[0].type, "FloorPlan3")]
    assert drawn(env, task="whatever").id == "whatever"
    assert drawn(make(TOGGLES), 4, suite=source).id == first.id


@pytest.mark.parametrize("source", ["mini", "generate", "file", "list", "own"])
def test_a_pickled_environment_keeps_its_source(
    source: Any, make: Callable[..., EmbodiedEnv], tmp_path: Path
) -> None:
    file = tmp_path / "tasks.jsonl"
    jsonl_format.write_tasks(file, PICKUPS)
    chosen = {"file": file, "list": PICKUPS, "own": Pickups()}.get(source, source)
    env = make(chosen, task_type="single_pickup")
    first = drawn(env, 3)
    again = pickle.loads(pickle.dumps(env))
    assert drawn(again, 3) == first
    again.close()


class Pickups(TaskList):
    def __init__(self) -> None:
        super().__init__(PICKUPS)


# -- live ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def live() -> Iterator[EmbodiedEnv]:
    env = EmbodiedEnv("generate", obs_mode="state")
    yield env
    env.close()


@pytest.fixture(scope="module")
def live_tasks(live: EmbodiedEnv) -> list[Task]:
    return [drawn(live, seed) for seed in range(6)]


def test_live_tasks_differ_and_can_be_done(live_tasks: list[Task]) -> None:
    assert len({task.id for task in live_tasks}) == 6
    assert len({task.scene for task in live_tasks}) > 3
    assert len({task.type for task in live_tasks}) > 2
    assert any(task.arrangement.poses for task in live_tasks)
    with closing(make_verifier()) as verifier:
        for task in live_tasks:
            verdict = verifier(task)
            assert verdict.solved, (task.id, verdict)


def test_live_tasks_play_in_training_rooms(live_tasks: list[Task]) -> None:
    assert {task.scene for task in live_tasks} <= set(TRAINING_SCENES)


def test_a_live_task_depends_on_the_seed_alone(
    live: EmbodiedEnv, live_tasks: list[Task], make: Callable[..., EmbodiedEnv]
) -> None:
    assert drawn(live, 2) == live_tasks[2]  # after others have been drawn
    other = make("generate")
    assert [drawn(other, 5), drawn(other, 0)] == [live_tasks[5], live_tasks[0]]


ROOM = "FloorPlan218"
"""A living room with a Newspaper and a Statue: training is about neither."""


def test_live_tasks_are_of_the_type_and_in_the_room_that_are_asked_for() -> None:
    env = gymnasium.make("ER-SinglePickup-v0", obs_mode="state", episode_source="generate")
    tasks = [drawn(env, seed, scene=ROOM) for seed in range(8)]
    assert {(task.type.env_id, task.scene) for task in tasks} == {("ER-SinglePickup-v0", ROOM)}
    assert len({task.id for task in tasks}) > 3
    env.close()


def test_live_tasks_are_about_what_training_may_see(make: Callable[..., EmbodiedEnv]) -> None:
    def abouts(spec: SuiteSpec) -> set[str]:
        with closing(GeneratedSource(EmbodiedEnv((), obs_mode="state"), spec)) as source:
            env = make(source, task_type="single_pickup")
            tasks = [drawn(env, seed, scene=ROOM) for seed in range(8)]
        return {name for task in tasks for name in subject_types(task)}

    everything = TRAINING.model_copy(update={"unseen_objects": True})
    assert abouts(everything) & UNSEEN_TYPES
    assert abouts(TRAINING).isdisjoint(UNSEEN_TYPES)


def test_a_live_source_keeps_to_its_making(make: Callable[..., EmbodiedEnv]) -> None:
    spec = SuiteSpec(
        total=1,
        scenes=("FloorPlan301", "FloorPlan401"),
        types=("pickup_and_put", "single_pickup"),
        layouts=2,
        distance=(2, 4.5),
    )
    with closing(GeneratedSource(EmbodiedEnv((), obs_mode="state"), spec)) as source:
        env = make(source)
        tasks = [drawn(env, seed) for seed in range(8)]
        # Nothing opens in this bathroom.
        with pytest.raises(
            ValueError, match=r"no single_pickup_from_closerep .* FloorPlan401"
        ) as e:
            make(source, task_type="single_pickup_from_closerep").reset(
                seed=0, options={"scene": "FloorPlan401"}
            )
    assert "\n" not in str(e.value)
    assert {task.scene for task in tasks} == set(spec.rooms)
    assert {task.type.name for task in tasks} == set(spec.types)
    assert all(2 <= task.extra["difficulty"]["distance"] <= 4.5 for task in tasks)
    layouts = {f"{scene}-{number}" for scene in spec.rooms for number in (1, 2)}
    assert {task.arrangement.layout for task in tasks} <= {"", *layouts}


def test_a_live_task_that_cannot_be_is_told(live: EmbodiedEnv) -> None:
    with pytest.raises(ValueError, match="cannot be asked for by id; pass the Task itself"):
        live.reset(options={"task": "nope"})
    assert drawn(live, 0, task=PICKUPS[0]) is PICKUPS[0]
    assert drawn(live, 0, suite="mini") in MINI


def test_live_tasks_can_be_kept_in_a_file(
    live_tasks: list[Task], make: Callable[..., EmbodiedEnv], tmp_path: Path
) -> None:
    file = tmp_path / "kept.jsonl"
    jsonl_format.write_tasks(file, live_tasks)
    assert drawn(make(file), 0, task=live_tasks[4].id) == live_tasks[4]


# -- a room that is rearranged ---------------------------------------------------------------------


def test_a_rearranged_task_begins_as_it_says(make: Callable[..., EmbodiedEnv]) -> None:
    env = make([REARRANGED])
    for _ in range(2):  # after an episode, too
        drawn(env, 0)
        there = {entry["name"]: entry["position"] for entry in env.objects}
        for name, pose in REARRANGED.arrangement.poses.items():
            found = (there[name]["x"], there[name]["y"], there[name]["z"])
            assert found == pytest.approx((pose.x, pose.y, pose.z), abs=1e-3), name
        ids = {entry["objectId"] for entry in env.objects}
        assert {key.object_id for key in REARRANGED.key_actions} - {""} <= ids
        recorded = drawn(env, 0, task=replace(PICKUPS[0], scene=REARRANGED.scene))
        assert recorded.arrangement.poses == {}
        assert {entry["name"]: entry["position"] for entry in env.objects} != there


@pytest.mark.parametrize("obs_mode", ["state", "rgb+text"])
def test_check_env_has_nothing_to_say_of_a_rearranged_task(obs_mode: str) -> None:
    env = EmbodiedEnv([REARRANGED], obs_mode=obs_mode, width=96, height=64)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)
    env.close()


# -- files of which some tasks are no use ----------------------------------------------------------


def ghostly(task: Task) -> Task:
    ghost = replace(task.key_actions[0], object_id="Mug|+09.00|+09.00|+09.00")
    return replace(task, id=f"ghost-{task.id}", key_actions=(ghost, *task.key_actions[1:]))


def test_what_does_not_fit_its_scene_is_not_drawn(
    make: Callable[..., EmbodiedEnv], tmp_path: Path
) -> None:
    file = tmp_path / "some.jsonl"
    jsonl_format.write_tasks(file, [ghostly(PICKUPS[0]), PICKUPS[1], REARRANGED])
    with pytest.warns(UserWarning, match=r"some\.jsonl: 1 of 3 tasks set aside: ghost-.*no object"):
        env = make(str(file))
    assert {drawn(env, seed).id for seed in range(12)} == {PICKUPS[1].id, REARRANGED.id}
    with pytest.raises(ValueError, match="no task 'ghost-"):
        drawn(env, task=ghostly(PICKUPS[0]).id)
    with pytest.warns(UserWarning, match="1 of 3 tasks set aside"):
        gymnasium.make("ER-SinglePickup-v0", episode_source=file, obs_mode="state").close()
    jsonl_format.write_tasks(file, [ghostly(PICKUPS[0])])
    with pytest.raises(ValueError, match=r"some\.jsonl: no task can be played: ghost-"):
        make(file)


def test_a_good_file_warns_of_nothing(make: Callable[..., EmbodiedEnv], tmp_path: Path) -> None:
    jsonl_format.write_tasks(tmp_path / "good.jsonl", [PICKUPS[1], REARRANGED])
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        make(tmp_path / "good.jsonl")
