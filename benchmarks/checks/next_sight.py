"""How much a policy's observation tells of where the thing is that it looks for.

    python -m benchmarks.checks.next_sight POLICY [--states 12000] [--without sightings]

It lets a policy of ``er-gym train-rl`` play tasks of ``train`` and, in some steps of its searches,
tries by branching what would let it see the thing clearly: each legal action that may show
something, and after each navigation to open or close something there. A network like the policy's,
which begins with the policy's weights, then learns from five rooms in six what each of these
actions is worth: 1 if it shows the thing, 0.6 if it takes a second one. It learns from what the
policy observes and nothing else. The table is of the other rooms (the policy has been trained in
these, too): what that action is worth which the policy finds likeliest among those tried, which
the network thinks best, and which is best. It is the next sight alone that counts: a policy that
looks farther ahead may do without it. Intervals are between rooms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from agents.rl.anchored import policy_folder
from agents.rl.config import EnvConfig, load_config
from agents.rl.envs import make_env
from agents.rl.network import TypeNetwork
from agents.rl.policy_file import CONFIG, load_network, policy_file
from agents.rl.subtasks import Subtask
from benchmarks.checks.out_of_sight import LOOKS
from benchmarks.harness.output import progress
from benchmarks.scoring.metrics import between
from benchmarks.scoring.tables import NONE
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tables import Table, as_markdown
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF

SECOND = 0.6
"""What a sight is worth that takes two actions."""
_IS_LOOK = np.array([action.verb in LOOKS for action in ACTIONS])
_UNCOVERS = np.array([action.verb in (verbs.OPEN, verbs.CLOSE) for action in ACTIONS])
_SHARE, _EARLY, _EARLY_SHARE = 0.3, 4, 0.12
"""Of the steps of a search that are kept; of its first steps, of which there are more."""
_BATCH, _RATE = 256, 1.5e-3
_PART = 250
"""Steps that one process gathers at once."""
_SINCE = ((0, 3), (4, 7), (8, 12), (13, 99))
"""The steps since the search began, by which the table counts."""


class SearchStates(NamedTuple):
    """Steps of searches.

    Attributes:
        obs: by name, (n, …) float16, what the policy observed.
        worth: (n, A) float32, 1 if the action shows the thing, :data:`SECOND` if another after it
            does, else 0; NaN if it was not tried.
        since: (n,) the steps since the search began.
        scene: (n,) the room.
    """

    obs: dict[str, NDArray[Any]]
    worth: NDArray[Any]
    since: NDArray[Any]
    scene: NDArray[Any]

    @staticmethod
    def joined(parts: Sequence[SearchStates]) -> SearchStates:
        """All of them."""
        obs = {key: np.concatenate([part.obs[key] for part in parts]) for key in parts[0].obs}
        rest = (
            np.concatenate(column) for column in zip(*(part[1:] for part in parts), strict=True)
        )
        return SearchStates(obs, *rest)


def worth_of(env: EmbodiedEnv, snapshot: bytes, legal: NDArray[Any], kind: int) -> NDArray[Any]:
    """What each action is worth for seeing a type of thing; see :class:`SearchStates`.

    Args:
        env: for trying.
        snapshot: of the episode.
        legal: (A,) the actions to choose from.
        kind: the index of the type.
    """
    worth = np.full(len(ACTIONS), np.nan, np.float32)
    for action in np.flatnonzero((legal > 0) & _IS_LOOK).tolist():
        env.restore(snapshot)
        info: Mapping[str, Any] = env.step(action)[4]
        worth[action] = is_seen(kind, info)
        if worth[action] or info["end_reason"] or ACTIONS[action].verb != verbs.NAVIGATE:
            continue
        there = env.snapshot()
        for second in np.flatnonzero((info["action_mask"] > 0) & _UNCOVERS).tolist():
            env.restore(there)
            if is_seen(kind, env.step(second)[4]):
                worth[action] = SECOND
                break
    return worth


def is_seen(kind: int, info: Mapping[str, Any]) -> bool:
    """Whether the agent sees a type clearly enough to go there, or reaches it."""
    return bool(info["navigable_mask"][kind] or info["interactable_mask"][kind])


def gathered(file: Path, options: EnvConfig, count: int, seed: int) -> SearchStates:
    """So many steps of the searches of a policy that chooses by its probabilities.

    Args:
        file: the policy's model file.
        options: of the environment; with ``subtasks``.
        count, seed: how many, and of all random choices.
    """
    torch.set_num_threads(1)
    rows = list(islice(_searches(load_network(file), options, seed), count))
    obs = {key: np.stack([row[0][key] for row in rows]) for key in rows[0][0]}
    rest = (np.array([row[place] for row in rows]) for place in range(1, len(rows[0])))
    return SearchStates(obs, *rest)


def _searches(
    network: TypeNetwork, options: EnvConfig, seed: int
) -> Iterator[tuple[dict[str, NDArray[Any]], NDArray[Any], int, str]]:
    """The values of :class:`SearchStates`, one step after the other."""
    env: Any = make_env(options)
    trying = EmbodiedEnv(
        obs_mode="state",
        instances=options.instances,
        max_steps=options.max_steps,
        width=options.width,
        height=options.height,
    )
    random = np.random.default_rng(seed)
    obs, info = env.reset(seed=seed)
    since = 0
    while True:
        memory, legal = env.policy_observation.subtasks, info["action_mask"]
        kind = _sought(memory.progress.at(), info)
        share = _EARLY_SHARE if since < _EARLY else _SHARE
        if kind is not None and random.random() < share:
            worth = worth_of(trying, env.unwrapped.snapshot(), legal, kind)
            kept = {key: array.astype(np.float16) for key, array in obs.items()}
            yield kept, worth, since, env.unwrapped.task.scene
        seen = {key: torch.as_tensor(array)[None] for key, array in obs.items()}
        with torch.no_grad():
            numbers = _numbers(network, seen)[0].masked_fill(
                torch.from_numpy(legal == 0), -torch.inf
            )
        chances = torch.softmax(numbers.double(), 0).numpy()
        obs, _, terminated, truncated, info = env.step(int(random.choice(len(chances), p=chances)))
        since = 0 if memory.moved_on else since + 1
        if terminated or truncated:
            obs, info = env.reset()
            since = 0


def _sought(now: Subtask | None, info: Mapping[str, Any]) -> int | None:
    """The index of the type that is looked for; None if it is seen already, or none is."""
    if now is None or info["end_reason"]:
        return None
    kind = KIND_OF.get(now.place if now.verb == verbs.PUT else now.thing)
    return None if kind is None or is_seen(kind, info) else kind


def _numbers(network: TypeNetwork, obs: Mapping[str, Tensor]) -> Tensor:
    """(B, A) the logits of actions."""
    numbers: Tensor = network({key: array.float() for key, array in obs.items()})[0].mean(dim=2)
    return numbers


class Prediction(nn.Module):
    """What each action is worth: a policy's network, with a scale and an offset of its logits."""

    def __init__(self, network: TypeNetwork) -> None:
        super().__init__()
        self.network = network.requires_grad_(True)
        self.scale, self.offset = (nn.Parameter(torch.tensor(each)) for each in (0.3, -3.0))

    def forward(self, obs: Mapping[str, Tensor]) -> Tensor:
        """(B, A) logits."""
        return _numbers(self.network, obs) * self.scale + self.offset


def learn(
    model: Prediction, states: SearchStates, rows: NDArray[np.intp], epochs: int
) -> Prediction:
    """Fit a prediction to some of the states."""
    random = np.random.default_rng(0)
    optimizer = torch.optim.AdamW(model.parameters(), weight_decay=1e-3)
    batches = max(1, len(rows) // _BATCH)
    rates = torch.optim.lr_scheduler.OneCycleLR(optimizer, _RATE, total_steps=epochs * batches)
    for _ in progress(range(epochs), "learning", epochs):
        for batch in np.array_split(random.permutation(rows), batches):
            worth = torch.from_numpy(states.worth[batch])
            tried = ~worth.isnan()
            loss = functional.binary_cross_entropy_with_logits(
                model(_taken(states.obs, batch))[tried], worth[tried]
            )
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimizer.step()
            rates.step()
    return model


def _taken(obs: Mapping[str, NDArray[Any]], rows: NDArray[np.intp]) -> dict[str, Tensor]:
    return {key: torch.from_numpy(array[rows]) for key, array in obs.items()}


def worth_of_first(
    score: Callable[[Mapping[str, Tensor]], Tensor], states: SearchStates, rows: NDArray[np.intp]
) -> NDArray[Any]:
    """(n,) what the tried action with the highest score is worth, in some of the states."""
    found = []
    with torch.no_grad():
        for part in np.array_split(rows, max(1, len(rows) // _BATCH)):
            worth = torch.from_numpy(states.worth[part])
            scores = score(_taken(states.obs, part)).masked_fill(worth.isnan(), -torch.inf)
            found.append(worth.nan_to_num().gather(1, scores.argmax(dim=1, keepdim=True))[:, 0])
    return torch.cat(found).numpy()


def without(states: SearchStates, names: Sequence[str]) -> SearchStates:
    """The same states, with nothing to see in some of the observations."""
    hidden = {key: array * (key not in names) for key, array in states.obs.items()}
    return states._replace(obs=hidden)


def _row(name: str, worth: NDArray[Any], tested: SearchStates, policy: NDArray[Any]) -> list[str]:
    """The mean worth by the steps since the search began; from :data:`_EARLY` on also how much more
    than the policy's, with the interval between rooms."""
    parts = [worth[(tested.since >= first) & (tested.since <= last)] for first, last in _SINCE]
    later = tested.since >= _EARLY
    cells = [f"{100 * part.mean():.1f}" if len(part) else NONE for part in parts]
    if worth is policy or not later.any():
        return [name, *cells, NONE]
    more = between(tested.scene[later].tolist(), (worth - policy)[later].tolist())
    shown = f"{100 * more.mean:.1f}"
    if more.low is not None and more.high is not None:
        shown += f" ({100 * more.low:.1f} to {100 * more.high:.1f})"
    return [name, *cells, shown]


def _asked(policy: str, hidden: Sequence[str]) -> tuple[Path, EnvConfig]:
    """The model file of a policy, and what it observes.

    Raises:
        ValueError: there is none, or it cannot be asked.
    """
    file = policy_file(policy_folder(policy))
    config = load_config(file.parent / CONFIG)
    options = config.env
    if not options.subtasks:
        raise ValueError(f"{policy} does not observe subtasks, so it seeks nothing")
    if options.obs_mode != "state" or config.algorithm.name != "ppo":
        raise ValueError(
            f"{policy} is a policy of {config.algorithm.name} on {options.obs_mode}; give one of "
            "ppo on state"
        )
    given = ["subtask", *["sightings"] * options.sightings]
    for name in hidden:
        if name not in given:
            raise ValueError(f"--without {name}: {policy} observes {' and '.join(given)}")
    load_network(file)
    return file, options.model_copy(update={"episodes": "train", "faults": 0.0})


@click.command(help=__doc__)
@click.argument("policy")
@click.option("--states", "count", default=12_000, show_default=True, type=click.IntRange(20))
@click.option("--epochs", default=4, show_default=True, type=click.IntRange(1))
@click.option("--without", "hidden", multiple=True, help="An observation to do without, too.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=7, show_default=True, type=click.IntRange(0))
def main(
    policy: str, count: int, epochs: int, hidden: tuple[str, ...], workers: int, seed: int
) -> None:
    try:
        file, options = _asked(policy, hidden)
    except ValueError as error:
        raise click.ClickException(str(error)) from error
    parts = -(-count // _PART)
    gather = partial(gathered, file, options, min(_PART, count))
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        found = pool.map(gather, range(seed * parts, (seed + 1) * parts))
        states = SearchStates.joined(list(progress(found, "trying", parts)))
    rooms = sorted(set(states.scene.tolist()))
    others = np.random.default_rng(0).choice(rooms, max(1, len(rooms) // 6), replace=False)
    apart = np.isin(states.scene, others)
    learnt, kept = np.flatnonzero(~apart), np.flatnonzero(apart)
    tested = SearchStates({}, *(column[kept] for column in states[1:]))
    begin = partial(load_network, file)
    own = worth_of_first(partial(_numbers, begin()), states, kept)
    rows = [_row("the policy", own, tested, own)]
    for names in dict.fromkeys([(), hidden]):
        seen = without(states, names)
        worth = worth_of_first(learn(Prediction(begin()), seen, learnt, epochs), seen, kept)
        name = ", without ".join(["a network that has learnt it", *names])
        rows.append(_row(name, worth, tested, own))
    rows.append(_row("the best", np.nanmax(tested.worth, axis=1), tested, own))
    steps = [f"{first} to {last} steps" for first, last in _SINCE[:-1]]
    columns = (
        *("First action of", *steps, f"{_SINCE[-1][0]} and more"),
        f"From {_EARLY} on, more than the policy",
    )
    title = (
        f"The thing seen next, in %, by the steps since the search began: {len(kept)} steps in "
        f"{len(others)} rooms; {len(learnt)} in {len(rooms) - len(others)} rooms to learn from"
    )
    click.echo(as_markdown([Table(title, columns, tuple(map(tuple, rows)), 1)]))


if __name__ == "__main__":
    main()
