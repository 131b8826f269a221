"""Lets a model learn from the rewards of its own episodes, or continues where it was.

Read it from top to bottom: :func:`reinforce` is the whole run. In each update the ordinary agent
plays tasks of the suite, several times each, many conversations at once, with the model as it is.
What each turn earned is compared (:mod:`agents.reinforce.advantages`), and the tokens that the
model said in it become likelier or rarer (:mod:`agents.reinforce.objective`).

TRL's ``GRPOTrainer`` takes a rollout function, too. It has one advantage for an episode, where ours
has one for a turn; pads all conversations of an update to the longest; and computes the scores of
all tokens after the first prompt, learnt or not (TRL 1.16; docs/reinforcement.md has the figures).
"""

from __future__ import annotations

import hashlib
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

import accelerate
import torch
from accelerate.utils import (
    DistributedDataParallelKwargs,
    InitProcessGroupKwargs,
    gather_object,
)
from torch.utils.tensorboard import SummaryWriter
from transformers.trainer_utils import set_seed

import er_gym
from agents.finetune import machine
from agents.finetune.batches import Collator
from agents.finetune.feedback import FEEDBACK
from agents.finetune.libraries import flush_denormals, quiet_libraries
from agents.finetune.model_files import (
    History,
    ModelFiles,
    StageRecord,
    open_model,
    settings_as_json,
    write_agent_files,
)
from agents.finetune.network import (
    chosen_dtype,
    keep_learning_part_exact,
    learning_part,
    load_network,
    put_back,
    save_network,
    with_learning_part,
)
from agents.finetune.run_files import LOGS, METRICS, RunFiles, replaced_folder
from agents.reinforce.advantages import ADVANTAGES, spread, widest
from agents.reinforce.branches import with_values
from agents.reinforce.checks import (
    agent_settings,
    check_suite,
    eyes_learn,
    greedy,
    tasks_of_types,
    validation_tasks,
)
from agents.reinforce.curriculum import chosen_tasks, with_results
from agents.reinforce.episodes import Episode, scored
from agents.reinforce.learner import Learner
from agents.reinforce.log_lines import line_of, lines_of, means_of
from agents.reinforce.player import ANCHOR, Sampler, group_jobs
from agents.reinforce.playing_copy import PlayingCopy
from agents.reinforce.rewards import REWARDS, rewards_of
from agents.reinforce.rows import Row, rows_of
from agents.reinforce.run_files import (
    EPISODES,
    REINFORCING,
    Checkpoint,
    ReinforceManifest,
    State,
    append_lines,
    rewind,
)
from agents.reinforce.settings import ReinforceSettings
from agents.reinforce.starts import after_refusals, insists
from agents.vlm.clients.checkpoint import checkpoint_in_memory
from agents.vlm.clients.local import LocalClient
from agents.vlm.matching import Matcher
from agents.vlm.prompts import prompts_for
from agents.vlm.settings import AgentSettings
from er_gym.activity import begin
from er_gym.rollout.env_pool import EnvPool
from er_gym.rollout.run_directory import Manifest
from er_gym.tasks.suites import Suite
from er_gym.tasks.task import Task

_CPU_LENGTHS = 32  # lengths of batches are multiples, as in fine-tuning


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        update, updates: how many are done, and of how many.
        success: of the update's episodes, a fraction.
        reward: what they earned on average.
        validation: the last success in validation, a fraction; None before the first.
        seconds_left: estimated from the last update.
    """

    update: int
    updates: int
    success: float
    reward: float
    validation: float | None
    seconds_left: float


@dataclass(frozen=True)
class Result:
    """A finished run.

    Attributes:
        path: the run directory.
        episodes: how many were played to learn from.
        updates: how many there were in all.
        kept: after which update the model is as it is in the result.
        validation: the first and the last success in validation, fractions; empty without one.
        new: whether anything was left to do.
    """

    path: Path
    episodes: int
    updates: int
    kept: int
    validation: tuple[float, ...]
    new: bool


def reinforce(
    settings: ReinforceSettings,
    model: Path,
    suite: Suite,
    out: Path,
    *,
    report: Callable[[Progress], None] = lambda progress: None,
    say: Callable[[str], None] = lambda text: None,
) -> Result:
    """Let a model learn from its own episodes, or continue the same run.

    Args:
        settings: of the run.
        model: a model directory with ``agent.yaml``, or a finished run.
        suite: the tasks that it plays.
        out: the run directory.
        report: is told after each update.
        say: is told in a sentence what goes on; both in the first process of several.

    Raises:
        ValueError: settings, model and suite do not go together.
        FolderConflict: the directory holds another run.
        Locked: another process trains in the directory.
        KeyboardInterrupt: Ctrl-C; what was learnt since the last checkpoint is lost.
    """
    # -- files alone: what is wrong with them is said before anything is written or loaded --
    begin(f"reading the model {model}")
    files = open_model(model)
    agent = agent_settings(files, settings)
    row = ADVANTAGES.get(settings.advantage.row)
    for name in settings.rewards:
        REWARDS.get(name)
    if row.compares and settings.play.group < 2:
        raise ValueError(
            f"advantage.row={settings.advantage.row} compares the episodes of a task, and "
            "play.group is 1; set play.group=8"
        )
    if row.values and settings.play.starts == "refusal":
        raise ValueError(
            f"advantage.row={settings.advantage.row} continues episodes from their states itself, "
            "so it does not go with play.starts=refusal; set play.starts=beginning"
        )
    check_suite(suite, settings)
    suite = replace(suite, tasks=tasks_of_types(suite, settings))
    validation_tasks(settings)  # played later, but what is wrong with them is said now
    manifest = ReinforceManifest(
        settings=settings_as_json(settings),
        model=str(files.path),
        model_digest=files.digest,
        suite=suite.name,
        suite_digest=suite.digest,
        history=files.history,
        er_gym=er_gym.__version__,
    )
    run, first = RunFiles(out), machine.is_first()
    with ExitStack() as stack:
        if first:
            stack.enter_context(REINFORCING.locked(out, manifest))
        else:
            REINFORCING.check(out, manifest)
        stack.enter_context(quiet_libraries())
        if run.finished:
            return _result(run, new=False)
        return _reinforce(settings, files, agent, suite, run, manifest, stack, report, say)


def _reinforce(
    settings: ReinforceSettings,
    files: ModelFiles,
    agent: AgentSettings,
    suite: Suite,
    run: RunFiles,
    manifest: ReinforceManifest,
    stack: ExitStack,
    report: Callable[[Progress], None],
    say: Callable[[str], None],
) -> Result:
    training, first = settings.training, machine.is_first()

    # -- the model: one that learns, and a copy with the same weights that plays --
    begin("loading the weights")
    set_seed(training.seed)
    dtype = chosen_dtype(settings.model)
    # Another run in this process may have left its own, as transformers' trainer knows, too.
    accelerate.state.AcceleratorState._reset_state()
    sees = agent.sees == "pictures"
    # A batch without pictures leaves eyes that learn without gradients.
    handlers: list[Any] = [
        DistributedDataParallelKwargs(find_unused_parameters=eyes_learn(files, settings))
    ]
    if machine.share_gpus():
        handlers.append(InitProcessGroupKwargs(backend="gloo"))  # NCCL wants a GPU for each
    accelerator = accelerate.Accelerator(
        cpu=not machine.on_gpu(), mixed_precision="no", kwargs_handlers=handlers
    )
    lora = settings.model.lora is not None
    network = load_network(files, settings.model, dtype if lora else "float32")
    network.to(accelerator.device)
    start = deepcopy(network).eval() if settings.objective.kl and not lora else None
    feedback = FEEDBACK in files.tokenizer.get_vocab()
    network = with_learning_part(network, settings.model, files, files.tokenizer, feedback)
    keep_learning_part_exact(network)
    # On a CPU, tokens are generated faster in float32.
    rounded = dtype == "bfloat16" and machine.on_gpu() and not lora
    playing = PlayingCopy(network, rounded=rounded)
    if training.checkpointing:
        network.gradient_checkpointing_enable({"use_reentrant": False})
        network.enable_input_require_grads()
    padding = files.tokenizer.pad_token_id
    learner = Learner(
        network,
        start,
        settings,
        accelerator,
        Collator(
            files.image_processor if sees else None,
            files.config.image_token_id if sees else None,
            agent.pictures.model_bounds,
            padding if padding is not None else (files.tokenizer.eos_token_id or 0),
            multiple=1 if machine.on_gpu() else _CPU_LENGTHS,
        ),
        rounded=dtype == "bfloat16",
    )

    # -- where the run is --
    state, best = State(), dict[str, torch.Tensor]()
    if first:
        run.clear()
    accelerator.wait_for_everyone()
    last = run.last_checkpoint()
    if last is not None:
        saved = Checkpoint.read(last)
        put_back(network, saved.trained, str(last))
        learner.optimizer.load_state_dict(saved.optimizer)
        state, best = saved.state, saved.best
        playing.refresh()
        say(f"continues after update {state.update:,}")
    if first:
        rewind(run, state.update if last is not None else -1)
        board = SummaryWriter(str(run.path / LOGS), purge_step=state.update + 1)
        stack.callback(board.close)

    # -- who plays: the ordinary agent with the copy, in environments that stay open --
    observed = {"obs_mode": f"{agent.obs_mode}+{ANCHOR}"}
    env = {**suite.env, **agent.env, **settings.play.env, **observed}
    pool = stack.enter_context(EnvPool(settings.play.workers, settings.play.concurrency, env))
    samplers = {}
    for name, how in {"play": agent, "validate": greedy(agent)}.items():
        chatting = checkpoint_in_memory(
            PlayingCopy(playing.network, rounded=False).network,
            files.tokenizer,
            files.image_processor if sees else None,
            files.template,
            how,
        )
        client = LocalClient(str(files.path), how, loaded=chatting, scored=name == "play")
        stack.enter_context(closing(client))
        samplers[name] = Sampler(
            pool, client, how, prompts_for(how), Matcher(how.matching), _played(suite, env, files)
        )
    stack.enter_context(flush_denormals())

    # -- the loop --
    process, processes = accelerator.process_index, accelerator.num_processes
    row = ADVANTAGES.get(settings.advantage.row)
    checked = validation_tasks(settings)
    validation = state.best
    if checked and not state.update:
        begin("validation before the first update")
        line: dict[str, Any] = {"update": 0}
        line |= _validated(samplers["validate"], checked[process::processes])
        validation = line["validation/success"]
        state, best = _with_best(state, best, validation, settings, network)
        if first:
            append_lines(run.path / METRICS, [line])
    for update in range(state.update + 1, training.updates + 1):
        began = time.monotonic()

        # episodes: tasks that the model sometimes does, each played several times
        begin(f"playing: update {update:,} of {training.updates:,}")
        tasks = chosen_tasks(
            suite.tasks, state.success, settings.play.tasks, settings.curriculum,
            (training.seed, update),
        )  # fmt: skip

        def seed(key: str, update: int = update) -> int:
            return _seed(training.seed, update, key)

        mine = tasks[process::processes]
        whole, jobs = (
            after_refusals(samplers["play"], mine, settings.play, seed)
            if settings.play.starts == "refusal"
            else (None, group_jobs(mine, settings.play.group, seed))
        )
        played = samplers["play"].play(jobs, forks=row.values)
        episodes, continued = [episode for _, episode, _ in played], 0
        if row.values:
            episodes, continued = with_values(samplers["play"], played, settings, seed)
        at_learning = time.monotonic()
        _forget(samplers["play"])

        # advantages: each group by itself, then tokens
        begin(f"learning: update {update:,} of {training.updates:,}")
        rows, lines, skipped = _rows(episodes, settings, update)
        figures = learner.learn(rows, update)
        playing.refresh()

        # what all processes have seen
        from_beginning, on = (
            (lines, []) if whole is None else (lines_of(whole, settings, update), lines)
        )
        lines, on = gather_object(from_beginning), gather_object(on)
        skipped = gather_object(skipped)
        continued = sum(gather_object([continued])) + len(on)
        seconds = time.monotonic() - began
        state = state.model_copy(
            update={
                "update": update,
                "success": with_results(
                    state.success,
                    [(each["type"], each["success"]) for each in lines],
                    settings.curriculum.memory,
                ),
                "episodes": state.episodes + len(lines),
                "continued": state.continued + continued,
                "tokens": state.tokens + int(figures.get("learnt_tokens", 0)),
                "seconds": state.seconds + seconds,
            }
        )
        line = {
            "update": update,
            **means_of(lines),
            **{f"continued/{name}": value for name, value in means_of(on).items() if on},
            "groups_skipped": fmean(skipped) if skipped else 1.0,
            **figures,
            **{f"success/{name}": value for name, value in sorted(state.success.items())},
            "episodes": state.episodes,
            "continued": state.continued,
            "seconds": round(state.seconds, 1),
            "seconds_playing": round(at_learning - began, 2),
            "seconds_learning": round(time.monotonic() - at_learning, 2),
            "memory": machine.used_memory(),
        }
        ends = update == training.updates
        if checked and (update % settings.validation.every == 0 or ends):
            begin(f"validation after update {update:,}")
            line |= _validated(samplers["validate"], checked[process::processes])
            validation = line["validation/success"]
            state, best = _with_best(state, best, validation, settings, network)
        if first:
            append_lines(run.path / EPISODES, [*lines, *on])
            append_lines(run.path / METRICS, [line])
            for name, value in line.items():
                board.add_scalar(name, value, update)
            board.flush()
            left = seconds * (training.updates - update)
            report(
                Progress(
                    update, training.updates, line["success"], line["reward"], validation, left
                )
            )
            if update % training.save_every == 0 or ends:
                Checkpoint(
                    state=state,
                    trained=learning_part(network),
                    optimizer=learner.optimizer.state_dict(),
                    best=best,
                ).write(run, training.keep)

    # -- the result --
    if first:
        begin("writing the model")
        kept = state.best_update if best else training.updates
        if best:
            put_back(network, best, "the best model")
        _write_result(run, files, network, manifest, state, kept)
    accelerator.wait_for_everyone()
    return _result(run, new=True)


# -- what is played ------------------------------------------------------------------------------


def _played(suite: Suite, env: dict[str, Any], files: ModelFiles) -> Manifest:
    """What is played, for the records."""
    return Manifest(
        suite=suite.name,
        suite_digest=suite.digest,
        suite_size=len(suite.tasks),
        agent=f"hf:{files.path}",
        env=env,
        seed=0,
        er_gym=er_gym.__version__,
    )


def _seed(seed: int, update: int, key: str) -> int:
    """The seed of an episode, in [0, 2**31)."""
    told = hashlib.sha256(f"{seed}/{update}/{key}".encode()).digest()
    return int.from_bytes(told[:4], "big") >> 1


# -- episodes to rows ------------------------------------------------------------------------------


def _rows(
    episodes: Sequence[Episode], settings: ReinforceSettings, update: int
) -> tuple[list[Row], list[dict[str, Any]], list[float]]:
    """What is learnt of some episodes, a line for the log of each, and which groups are
    left out."""
    row = ADVANTAGES.get(settings.advantage.row)
    objective = settings.objective
    groups: dict[tuple[str, int], list[Episode]] = defaultdict(list)
    for episode in episodes:
        groups[episode.group].append(episode)
    rows: list[Row] = []
    lines: list[dict[str, Any]] = []
    skipped: list[float] = []
    for members in groups.values():
        earned = [rewards_of(each.record, settings.rewards) for each in members]
        lines += [line_of(e, rewards, update) for e, rewards in zip(members, earned, strict=True)]
        group = [scored(e, rewards) for e, rewards in zip(members, earned, strict=True)]
        within = objective.skip_within
        skipped.append(float(row.compares and within is not None and spread(group) <= within))
        if skipped[-1]:
            continue
        places = widest(group, objective.most or len(group))
        some = [group[place] for place in places]
        for place, advantages in zip(places, row.of(some, settings.advantage), strict=True):
            rows += rows_of(
                members[place].turns,
                advantages,
                objective.mean,
                keep_all=bool(objective.entropy or objective.kl),
            )
    return rows, lines, skipped


# -- validation and the result ---------------------------------------------------------------------


def _validated(sampler: Sampler, tasks: Sequence[Task]) -> dict[str, float]:
    """Success by the likeliest tokens, why episodes ended, and how often the model insisted on
    what was refused, of all processes."""
    jobs = group_jobs(tasks, 1, lambda key: _seed(0, 0, key))
    records = [episode.record for _, episode, _ in sampler.play(jobs)]
    _forget(sampler)
    found = gather_object([(each.success, each.end_reason, insists(each)) for each in records])
    ended = Counter(reason for _, reason, _ in found)
    insisted = [each for _, _, of_episode in found for each in of_episode]
    return {
        "validation/success": fmean(done for done, _, _ in found),
        **{f"validation/ended/{name}": n / len(found) for name, n in sorted(ended.items())},
        "validation/refused": len(insisted) / len(found),
        "validation/insists": fmean(insisted) if insisted else 0.0,
    }


def _forget(sampler: Sampler) -> None:
    """Drop what was computed for conversations: the weights change, and learning needs memory."""
    sampler.client.forget()
    machine.give_memory_back()


def _with_best(
    state: State,
    best: dict[str, torch.Tensor],
    success: float,
    settings: ReinforceSettings,
    network: Any,
) -> tuple[State, dict[str, torch.Tensor]]:
    """The state after a validation, and the weights that did best if they are kept."""
    if state.best is not None and success <= state.best:
        return state, best
    if settings.validation.best:
        best = {name: weight.clone() for name, weight in learning_part(network).items()}
    return state.model_copy(update={"best": success, "best_update": state.update}), best


def _write_result(
    run: RunFiles,
    files: ModelFiles,
    network: Any,
    manifest: ReinforceManifest,
    state: State,
    kept: int,
) -> None:
    losses = [line["loss"] for line in run.metrics() if "loss" in line]
    record = StageRecord(
        stage=None,
        run=str(run.path.resolve()),
        data=[f"reinforcement on the suite {manifest.suite}"],
        data_digest=manifest.suite_digest,
        settings=manifest.settings,
        conversations=state.episodes,
        updates=kept,
        loss=losses[-1] if losses else 0.0,
    )
    with replaced_folder(run.model) as folder:
        save_network(network, files, folder)
        (folder / "README.md").unlink(missing_ok=True)
        files.tokenizer.save_pretrained(folder)
        history = History(runs=(*files.history.runs, record))
        write_agent_files(folder, history, files.agent, files)


def _result(run: RunFiles, *, new: bool) -> Result:
    lines = run.metrics()
    validation = [line["validation/success"] for line in lines if "validation/success" in line]
    updates = [line for line in lines if "reward" in line]
    history = open_model(run.model).history.runs[-1]
    return Result(
        path=run.path,
        episodes=history.conversations,
        updates=updates[-1]["update"],
        kept=history.updates,
        validation=(validation[0], validation[-1]) if validation else (),
        new=new,
    )
