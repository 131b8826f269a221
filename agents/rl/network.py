"""A network over object types that shares its weights among all types.

The state observation is a table with a row of features for each object type. The network
processes only the types that are navigable, interactable, held or named by the instruction, some
20 of 124, since no other type can be acted on. Each type's row passes through the same layers,
with the type's embedding and AI2-THOR properties, its fit to the types that the instruction names,
and a summary of all other types. The output is one number for each verb with that type.

The observation ``subtask`` adds features to the rows and to the summary, and types that matter in
more roles: those of the subtask at hand and of the next. ``sightings`` adds features to the rows.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from gymnasium import spaces
from torch import Tensor, nn
from torch.nn import functional

from agents.rl.policy_observation import IMAGES
from agents.rl.sighting_memory import SIGHTING_FEATURES
from agents.rl.subtask_memory import ROLES, SUBTASK_FEATURES, SUBTASK_SCALARS
from er_gym.envs.actions import ACTIONS, INDEX, INDICES, Action
from er_gym.envs.observations import FEATURES, SCALARS
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

TYPES = tuple(OBJECT_TYPES)
_PROPERTIES = tuple(
    sorted({name for kind in OBJECT_TYPES.values() for name in kind.properties} - {"canBeUsedUp"})
)
"""Trained policies lack the excluded property; adding it would change layer sizes."""
_MATTERS = [FEATURES.index(name) for name in ("navigable", "interactable", "held", "goal")]
_GOAL = FEATURES.index("goal")
_ROLES = [SUBTASK_FEATURES.index(name) for name in ROLES]
_TABLES = ("state", "subtask", "sightings")
"""The observations that are scalars, if any, and a table of types."""
_MANY = 8
"""The approximate number of processed types, for scaling sums."""
_NOWHERE = len(ACTIONS)
"""The index for verbs that do not apply to a type; this column is dropped."""


class TypeNetwork(nn.Module):
    """Outputs numbers for every action, and a summary for a value head.

    Args:
        space: with a key ``state``; optionally ``subtask``, ``sightings``, ``instruction`` (E,),
            and ``rgb`` and ``depth`` (channels, H, W), as Stable-Baselines3 turns pictures; a
            ``mask`` is not looked at.
        width: of the layers.
        kind: length of the learnt vector of a type.
        outputs: numbers per action: 1 for a logit or a value, more for quantiles.
    """

    properties: Tensor
    """Whether each type has each property, (T, P)."""
    index: Tensor
    """The action of each type and verb, (T, V)."""
    bare_index: Tensor
    """The actions without a type."""

    def __init__(
        self, space: spaces.Dict, width: int = 64, kind: int = 16, outputs: int = 1
    ) -> None:
        super().__init__()
        self.width, self.outputs, self.actions = width, outputs, len(ACTIONS)
        properties = torch.tensor(
            [[float(p in OBJECT_TYPES[name].properties) for p in _PROPERTIES] for name in TYPES]
        )
        self.register_buffer("properties", properties, persistent=False)
        places = [INDICES[verb].tolist() for verb in verbs.OBJECT_VERBS]
        index = torch.tensor(places).T  # (T, V)
        self.register_buffer("index", index.where(index >= 0, _NOWHERE), persistent=False)
        self.kinds = nn.Parameter(torch.randn(len(TYPES), kind) * 0.3)
        known = kind + len(_PROPERTIES)
        extras = {
            key: box
            for key, box in space.spaces.items()
            if key not in (*_TABLES, "mask") and isinstance(box, spaces.Box)
        }
        self._subtasks = "subtask" in space.spaces
        roles = 2 + len(ROLES) * self._subtasks
        self._sightings = "sightings" in space.spaces
        features = len(FEATURES) + len(SUBTASK_FEATURES) * self._subtasks
        self._features = features + len(SIGHTING_FEATURES) * self._sightings
        scalars = len(SCALARS) + len(SUBTASK_SCALARS) * self._subtasks
        self._images = [key for key in extras if key in IMAGES]
        self._told = [key for key in extras if key not in IMAGES]
        channels = sum(int(extras[key].shape[0]) for key in self._images)
        self.eye = _eye(width, channels) if channels else None
        told = sum(int(extras[key].shape[0]) for key in self._told) + width * bool(channels)
        self.is_a = nn.Linear(known, width, bias=False)
        self.offers = nn.Linear(known, kind)
        self.asks = nn.Linear(roles * known, kind)
        self.row = nn.Linear(self._features + kind, width, bias=False)
        self.room = nn.Linear(scalars + told + roles * known, width)
        self.gather = nn.Linear((2 + roles) * width, width)
        self.row2 = nn.Linear(width, width, bias=False)
        self.room2 = nn.Linear(width, width)
        self.each = nn.Linear(width, len(verbs.OBJECT_VERBS) * outputs)
        self.summary_width = (2 + roles) * width
        self.bare = nn.Linear(self.summary_width, len(verbs.BARE_VERBS) * outputs)
        bare = [INDEX[Action(verb)] for verb in verbs.BARE_VERBS]
        self.register_buffer("bare_index", torch.tensor(bare), persistent=False)

    def add_sightings(self) -> None:
        """Take ``sightings``, too, from now on, and do the same as before until it learns; nothing
        changes if it takes them already."""
        if self._sightings:
            return
        features, fit = self.row.weight.split([self._features, self.kinds.shape[1]], dim=1)
        new = features.new_zeros(self.width, len(SIGHTING_FEATURES))
        self.row.weight = nn.Parameter(torch.cat([features, new, fit], dim=1).detach())
        self.row.in_features += len(SIGHTING_FEATURES)
        self._features += len(SIGHTING_FEATURES)
        self._sightings = True

    def forward(self, obs: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """(B, A, outputs) for the actions, 0 for those that cannot be legal; (B, summary_width)."""
        state = obs["state"]
        size = len(state)
        scalars, table = _split(state, len(SCALARS), len(FEATURES))
        goal = table[:, _GOAL]
        matters = (table[:, _MATTERS] > 0).any(dim=1)  # (B, T)
        # By its roles, a type's weight: named first, named later, and in the subtasks.
        weights = torch.stack([(goal == 1).to(state), goal * (goal < 1)], dim=2)  # (B, T, R)
        if self._subtasks:
            more, rows = _split(obs["subtask"], len(SUBTASK_SCALARS), len(SUBTASK_FEATURES))
            in_role = rows[:, _ROLES]
            matters = matters | (in_role > 0).any(dim=1)
            weights = torch.cat([weights, in_role.transpose(1, 2)], dim=2)
            scalars, table = torch.cat([scalars, more], dim=1), torch.cat([table, rows], dim=1)
        if self._sightings:
            _, rows = _split(obs["sightings"], 0, len(SIGHTING_FEATURES))
            table = torch.cat([table, rows], dim=1)
        at, which = matters.nonzero(as_tuple=True)  # (M,), (M,)
        kinds = torch.cat([self.kinds, self.properties], dim=1)  # (T, K)
        wanted = (weights.transpose(1, 2) @ kinds).flatten(1)  # (B, R K)
        # How well a type fits the instruction's types: a fridge is a good place for an apple.
        fit = functional.embedding(which, self.offers(kinds)) * self.asks(wanted).index_select(
            0, at
        )
        told = [obs[key] for key in self._told]
        if self.eye is not None:
            told.append(self.eye(torch.cat([obs[key] for key in self._images], dim=1)))
        room = self.room(torch.cat([scalars, *told, wanted], dim=1))  # (B, W)
        row = self.row(torch.cat([table[at, :, which], fit], dim=1))  # (M, W)
        row = row + functional.embedding(which, self.is_a(kinds))
        hidden = torch.relu(row + room.index_select(0, at))
        named = weights[at, which]  # (M, R)
        room = torch.relu(self.gather(torch.cat([room, _pooled(hidden, at, named, size)], dim=1)))
        hidden = torch.relu(self.row2(hidden) + self.room2(room).index_select(0, at))
        summary = torch.cat([room, _pooled(hidden, at, named, size)], dim=1)
        each = self.each(hidden).view(len(at), len(verbs.OBJECT_VERBS), self.outputs)
        numbers = state.new_zeros(size, len(ACTIONS) + 1, self.outputs)
        numbers = numbers.index_put((at[:, None], self.index[which]), each)
        bare = self.bare(summary).view(size, len(verbs.BARE_VERBS), self.outputs)
        numbers = numbers.index_copy(1, self.bare_index, bare)
        return numbers[:, :-1], summary


def _split(vector: Tensor, scalars: int, features: int) -> tuple[Tensor, Tensor]:
    """(B, scalars) and (B, features, T): the parts of an observation of types."""
    return vector[:, :scalars], vector[:, scalars:].view(len(vector), features, len(TYPES))


def _pooled(rows: Tensor, at: Tensor, weights: Tensor, size: int) -> Tensor:
    """(B, (1 + R) W) of the rows (M, W) that belong to each of B: their sum, scaled to be about 1,
    and for each role their sum by their weights (M, R) in it."""
    parts, width = 1 + weights.shape[1], rows.shape[1]
    pooled = rows.new_zeros(size * parts, width).index_add(0, at * parts, rows / _MANY)
    row, role = weights.nonzero(as_tuple=True)  # most rows have no role
    in_role = rows.index_select(0, row) * weights[row, role][:, None]
    return pooled.index_add(0, at[row] * parts + 1 + role, in_role).view(size, parts * width)


def _eye(width: int, channels: int) -> nn.Module:
    """A small convolutional network for pictures (B, channels, H, W) in 0 to 1."""
    return nn.Sequential(
        nn.Conv2d(channels, 16, 5, stride=3),
        nn.ReLU(),
        nn.Conv2d(16, 32, 3, stride=2),
        nn.ReLU(),
        nn.Conv2d(32, 32, 3, stride=2),
        nn.ReLU(),
        nn.AdaptiveAvgPool2d(3),
        nn.Flatten(),
        nn.Linear(32 * 9, width),
        nn.ReLU(),
    )
