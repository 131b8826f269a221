"""Packs a run directory into a submission."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Mapping
from hashlib import sha256
from importlib import metadata
from pathlib import Path

from pydantic import ValidationError

from agents.vlm.record import ConversationRecord, PictureRecord
from benchmarks.leaderboard.secrets import known_secrets, secrets_in
from benchmarks.leaderboard.submission import Claim, Costs, Header, Submission, packed
from benchmarks.scoring.metrics import score_episode, summarise
from benchmarks.scoring.report import RunReport, load_run
from benchmarks.scoring.scorers import SCORERS
from er_gym import __version__
from er_gym.rollout.run_directory import CONVERSATIONS
from er_gym.tasks.errors import first_problem
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem, inside

_PACKAGES = ("numpy", "pillow", "panda3d", "gymnasium", "ai2thor")
"""Whose versions may decide what an agent sees."""
_FOLDER = re.compile(r"(^|:)(?:~|\.{0,2})/(?:.*/)?([^/]+?)/*$")
"""Where a model lies: what stands before the folder, and the folder's name."""


class CannotSubmit(ValueError):
    """The run cannot be submitted; the message says why and what to do."""


def claims(submission: Submission | RunReport) -> dict[str, dict[str, Claim]]:
    """Scorer to metric to its mean over all episodes, from the records alone."""
    found = {}
    for name, scorer in SCORERS.items():
        summary = summarise([score_episode(each, scorer) for each in submission.episodes])
        found[name] = {
            metric: Claim(mean=each.mean, low=each.low, high=each.high)
            for metric, each in summary.metrics.items()
        }
    return found


def pack(
    run: Path, *, name: str = "", by: str = "", hardware: Mapping[str, str] | None = None
) -> bytes:
    """The bytes of the submission of a run.

    Args:
        run: a run directory of ``er-gym bench``, or of a person who played.
        name: of the agent on the board; by default the agent's spec.
        by: who submits.
        hardware: what else the run was played on, in words, such as the GPU.

    Raises:
        RunDirectoryError: the directory holds no run.
        CannotSubmit: an episode crashed, a file is not usable, a picture is not the one that the
            model was shown, or a text holds what looks like a secret.
    """
    report = load_run(run)
    spec = without_folders(report.manifest.agent)
    manifest = report.manifest.model_copy(update={"agent": spec})
    if report.crashed or report.unusable or not report.episodes:
        raise CannotSubmit(
            f"{run} has {len(report.episodes)} episodes, of which {report.crashed} crashed, and "
            f"{len(report.unusable)} files that are none; the same command of er-gym bench plays "
            "what is missing"
        )
    conversations = {
        each.key: found
        for each in report.episodes
        if (found := _conversation(run, each.key)) is not None
    }
    header = Header(
        name=name or spec,
        by=by,
        manifest=manifest,
        episodes=len(report.episodes),
        conversations=len(conversations),
        results=claims(report),
        costs=Costs.of(conversations.values()),
        versions=versions(),
        hardware={**machine(), **(hardware or {})},
    )
    # A record in a run directory names its run; outside of it, that shows where it comes from.
    episodes = tuple(
        each.model_copy(update={"run": manifest.digest, "agent": without_folders(each.agent)})
        for each in report.episodes
    )
    submission = Submission(header, episodes, conversations)
    sought = _refuse_secrets(run, submission)
    header = header.model_copy(update={"secrets": sought})
    return packed(Submission(header, episodes, conversations))


def without_folders(spec: str) -> str:
    """The spec of an agent or the name of a model without the folders in which it lies,
    ``hf:/home/me/it`` as ``hf:it``: they mean nothing elsewhere, and may name a person."""
    return _FOLDER.sub(r"\1\2", spec)


def _conversation(run: Path, key: str) -> ConversationRecord | None:
    """The conversation of an episode, each of whose pictures has been looked at; None for none."""
    path = inside(run, f"{CONVERSATIONS}/{file_stem(key)}.json")
    if not path.exists():
        return None
    try:
        found = ConversationRecord.model_validate_json(read_bytes(path))
    except ValidationError as error:
        raise CannotSubmit(f"{path} is damaged: {first_problem(error)}") from None
    for part in (part for message in found.messages for part in message.parts):
        if isinstance(part, PictureRecord):
            file = inside(run, part.path)
            if sha256(read_bytes(file)).hexdigest() != part.digest:
                raise CannotSubmit(f"{file} is not the picture that the model was shown")
    rounds = [
        each.model_copy(update={"model": without_folders(each.model)}) for each in found.rounds
    ]
    return found.model_copy(update={"agent": without_folders(found.agent), "rounds": rounds})


def _refuse_secrets(run: Path, submission: Submission) -> int:
    """Refuse what looks like a secret; the number of known values that were looked for."""
    settings = submission.header.manifest.agent_settings.get("server", {})
    values = known_secrets([str(settings.get("key_from", ""))])
    for where, told in texts_of(submission):
        for what in secrets_in(told, values):
            raise CannotSubmit(
                f"{run}: {where} holds {what}, so it is not packed; remove it from the file, and "
                "take the secret out of use if anybody else has the run"
            )
    return len(values)


def texts_of(submission: Submission) -> list[tuple[str, str]]:
    """All texts of a submission, each with where it is."""
    header = submission.header.model_dump_json(exclude={"results"})
    return [
        ("the header", header),
        *((f"the record of {each.key}", each.model_dump_json()) for each in submission.episodes),
        *(
            (f"the conversation of {key}", each.model_dump_json())
            for key, each in submission.conversations.items()
        ),
    ]


def versions() -> dict[str, str]:
    """The versions of what decides what an agent sees."""
    found = {"er-gym": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # an optional one
            continue
    return found


def machine() -> dict[str, str]:
    """This machine in words; nothing that names it."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "cores": str(os.cpu_count() or 0),
    }
