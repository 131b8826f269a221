"""The README and the launch script beside printed files."""

from __future__ import annotations

import shlex

from agents.finetune.launchers.expected import models_table, run_table
from agents.finetune.launchers.plan import DATA, LauncherFiles, LaunchPlan
from er_gym.writing import MARKDOWN_MARK

SCRIPT = "train.sh"
_WHOLE_EMBEDDINGS = ("llama-factory", "ms-swift")
"""Programs that, with LoRA, train the embeddings as a whole if a token is new."""


def script(files: LauncherFiles) -> str:
    """The launch script: it runs the command in its own folder."""
    lines = ["#!/usr/bin/env bash", "set -euo pipefail", 'cd "$(dirname "$0")"']
    lines += [
        f"export {name}=${{{name}:-{shlex.quote(value)}}}"
        for name, value in files.environment.items()
    ]
    lines.append(f'exec {shlex.join(files.command)} "$@"')
    return "\n".join(lines) + "\n"


def readme(plan: LaunchPlan, files: LauncherFiles, program: str) -> str:
    """What is in the folder, how to start it, and how much memory it is expected to take."""
    settings, facts = plan.settings, plan.facts
    how = "full fine-tuning" if settings.model.lora is None else "LoRA"
    left_out = (
        f"; {facts.left_out:,} without a turn to learn are left out" if facts.left_out else ""
    )
    lines = [
        f"{MARKDOWN_MARK}# {plan.name}: {plan.model.weights}, {how}, with {program}",
        "",
        f"Written by er-gym for {files.made_with}. Copy this folder to the cluster and run "
        f"`bash {SCRIPT}` there.",
        "",
        f"- `{DATA}/`: {facts.chats:,} conversations, {facts.pictures:,} pictures{left_out}",
        *(f"- `{name}`" for name in (*files.texts, SCRIPT)),
        "",
        *(line for note in files.notes for line in (note, "")),
        "## Memory",
        "",
        f"Estimated, not measured: {how} on {plan.gpus} GPU{'s' * (plan.gpus > 1)}"
        + (", ZeRO-3" if plan.sharded else "")
        + f", batch {settings.training.batch}. The longest conversation is `{facts.longest}`, with "
        f"{facts.shown} pictures; its text is counted by rule, for want of a tokenizer. These "
        "programs compute scores for every token at once, which at great length is most of it.",
        "",
        run_table(plan, whole_embeddings=program in _WHOLE_EMBEDDINGS).markdown(),
        "",
        "Other models at the length of the longest conversation, in GiB on each GPU (full "
        "fine-tuning on several with ZeRO-3):",
        "",
        models_table(plan).markdown(),
    ]
    return "\n".join(lines) + "\n"
