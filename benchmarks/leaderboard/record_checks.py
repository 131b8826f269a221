"""Checks a submission by its records alone, and by the suite that it names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from agents.vlm.record import ConversationRecord
from benchmarks.leaderboard.packing import claims, texts_of
from benchmarks.leaderboard.problems import Problem
from benchmarks.leaderboard.secrets import known_secrets, secrets_in
from benchmarks.leaderboard.submission import Costs, Header, Submission
from er_gym.envs.protocol import DEFAULT
from er_gym.rollout.judgement import judged, judged_by_step
from er_gym.rollout.outcomes import succeeded
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import PERSON, EpisodeRecord, record_episode
from er_gym.rollout.runner import episodes_of
from er_gym.rollout.selection import select
from er_gym.tasks.suites import Suite
from er_gym.tasks.task import Task

HUMAN = "human"
"""The agent's name in runs of a person."""
PARTS = (10, 20, 50, 100, 200, 500)
"""How many tasks a submission may have that does not have all: those of ``--limit N --spread``."""
_OF_TASK = (
    *("task_type", "scene", "instruction", "name", "key_actions", "search_targets", "max_steps"),
)
_FREE = frozenset({"obs_mode", "width", "height", "annotate", "faults", "instances", "light"})
"""Arguments of the environment that a submission may choose."""
_MOST_NAMED = 3


def by_records(submission: Submission) -> Iterator[Problem]:
    """The problems that the file itself shows."""
    header = submission.header
    yield from (Problem("rules", "", words) for words in _against_rules(header))
    counts = (len(submission.episodes), len(submission.conversations))
    if counts != (header.episodes, header.conversations):
        yield Problem(
            "dropped",
            "",
            f"the header says {header.episodes} episodes and {header.conversations} conversations, "
            f"and the file has {counts[0]} and {counts[1]}",
        )
    yield from (Problem("mixed", key, "it is there twice") for key in submission.repeated)
    for record in submission.episodes:
        yield from (Problem("mixed", record.key, words) for words in _foreign(header, record))
        yield from (Problem("verdict", record.key, words) for words in _misjudged(record))
    yield from _talks(submission)
    if Costs.of(submission.conversations.values()) != header.costs:
        yield Problem("cost", "", "the costs are not the sums over the conversations")
    try:
        agrees = claims(submission) == header.results
    except (ValueError, LookupError) as error:  # a type of task that nobody has
        yield Problem("claim", "", f"the records cannot be scored: {error}")
    else:
        if not agrees:
            yield Problem("claim", "", "the results are not those of the records")
    values = known_secrets()
    for where, text in texts_of(submission):
        yield from (Problem("secret", "", f"{where} holds {w}") for w in secrets_in(text, values))


def _against_rules(header: Header) -> Iterator[str]:
    env, manifest = header.manifest.env, header.manifest
    if env.get("backend", "embedded") != "embedded":
        yield "it was not played on the embedded engine, which alone repeats itself"
    if manifest.protocol != DEFAULT.name:
        yield f"it was played by the protocol {manifest.protocol!r:.40}"
    if manifest.set_aside:
        yield "tasks were set aside"
    observed = str(env.get("obs_mode", ""))
    if ":" in observed:
        yield f"it was played with the observation {observed!r:.60} of another package"


def _foreign(header: Header, record: EpisodeRecord) -> Iterator[str]:
    manifest = header.manifest
    seed = episode_seed(manifest.seed, record.key)
    told = {
        "run": (record.run, manifest.digest),
        "agent": (record.agent, manifest.agent),
        "seed": (record.seed, seed),
    }
    for name, (its, ours) in told.items():
        if its != ours:
            yield f"its {name} is {its!r:.60}, not {ours!r:.60}"
            return
    if manifest.agent != HUMAN and any(step.by == PERSON for step in record.steps):
        yield "a person decided a step"


def _misjudged(record: EpisodeRecord) -> Iterator[str]:
    try:
        verdict, by_step = judged(record), judged_by_step(record)
    except (ValueError, LookupError) as error:
        yield f"it cannot be judged: {error}"
        return
    success = succeeded(verdict.success, record.error or record.gave_up)
    if record.success != success:
        yield f"it says success={record.success}, and by its steps it is {success}"
    earned = sum(key.reward for key in verdict.done)
    if abs(earned - record.total_reward) > 1e-6 and not record.error:
        yield f"it says a reward of {record.total_reward:g}, and by its steps it is {earned:g}"
    if len(by_step) != len(record.steps) or not record.steps:
        yield "it has no steps"
    if record.error:
        yield "it crashed; the same command of er-gym bench plays it again"


def _talks(submission: Submission) -> Iterator[Problem]:
    """Conversations fit the records: one for each episode or none at all, with the same actions."""
    if not submission.conversations:
        if submission.header.manifest.agent_settings:
            yield Problem("talk", "", "a model played, and its conversations are missing")
        return
    records = {each.key: each for each in submission.episodes}
    for key in sorted(records.keys() ^ submission.conversations.keys()):
        yield Problem("talk", key, "there is not one record and one conversation of it")
    for key, talk in submission.conversations.items():
        if key in records:
            yield from (Problem("talk", key, words) for words in _talk(records[key], talk))


def _talk(record: EpisodeRecord, talk: ConversationRecord) -> Iterator[str]:
    stated = (talk.scene, talk.instruction, talk.agent)
    if stated != (record.scene, record.instruction, record.agent):
        yield "it is of another episode"
    decided = [each for each in record.steps[1:] if not each.appended]
    if len(talk.rounds) != len(decided):
        yield f"it has {len(talk.rounds)} replies, and the record {len(decided)} steps"
        return
    for number, (reply, step) in enumerate(zip(talk.rounds, decided, strict=True), 1):
        if reply.action and reply.action != f"{step.verb} {step.object_type}".rstrip():
            yield f"reply {number} decides on {reply.action!r:.60}, and the record has another step"
            return
        if reply.by != step.by or not 0 <= reply.message < len(talk.messages):
            yield f"reply {number} is not that of step {number}"
            return
    sums = Costs.of([talk])
    if (sums.prompt_tokens, sums.completion_tokens) != (
        talk.prompt_tokens,
        talk.completion_tokens,
    ) or sums.usd != talk.cost:
        yield "its costs are not the sums over its replies"


# -- by the suite --------------------------------------------------------------------------------


def by_suite(submission: Submission, suite: Suite) -> Iterator[Problem]:
    """The problems that the suite shows which the submission names."""
    manifest = submission.header.manifest
    if suite.digest != manifest.suite_digest or len(suite.tasks) != manifest.suite_size:
        words = f"the tasks of {suite.name} are others here; play it with this version of er-gym"
        yield Problem("suite", "", words)
        return
    env = manifest.env
    for name in sorted((env.keys() | suite.env.keys()) - _FREE - {"backend", "protocol"}):
        if env.get(name) != suite.env.get(name):
            words = f"the environment was made with {name} {env.get(name)!r:.60}"
            yield Problem("rules", "", f"{words}, and {suite.name} has {suite.env.get(name)!r}")
    tasks = {task.id: task for task in suite.tasks}
    for record in submission.episodes:
        if record.task_id in tasks:
            yield from _other_task(record, tasks[record.task_id])
    yield from _selection(submission.episodes, suite)


def _other_task(record: EpisodeRecord, task: Task) -> Iterator[Problem]:
    blank = record_episode(task, agent="", seed=0)
    for name in _OF_TASK:
        if getattr(record, name) != getattr(blank, name):
            yield Problem("task", record.key, f"its {name} is not that of the suite's task")
            return


def _selection(episodes: Sequence[EpisodeRecord], suite: Suite) -> Iterator[Problem]:
    """All tasks were played, or a part that does not depend on how they came out."""
    played = {each.task_id for each in episodes}
    samples = max((each.sample for each in episodes), default=1)
    size = len(played)
    if size in PARTS and size < len(suite.tasks):
        wanted = select(suite.tasks, limit=size, spread=True)
    else:
        wanted = [*suite.tasks]
    expected = Counter(episodes_of(wanted, samples).keys())
    found = Counter(each.key for each in episodes)
    missing, more = expected - found, found - expected
    if missing:
        yield Problem("dropped", "", f"{_some(missing)} missing")
    if more:
        yield Problem("dropped", "", f"{_some(more)} too many")


def _some(keys: Counter[str]) -> str:
    names = sorted(keys)
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return f"{', '.join(names[:_MOST_NAMED])}{more} {'is' if len(names) == 1 else 'are'}"
