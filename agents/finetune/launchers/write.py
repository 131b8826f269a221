"""Writes the files of a run for another program."""

from __future__ import annotations

from pathlib import Path

from agents.finetune.launchers.deepspeed import DEEPSPEED
from agents.finetune.launchers.llama_factory import LLAMA_FACTORY
from agents.finetune.launchers.ms_swift import MS_SWIFT
from agents.finetune.launchers.plan import DATA, LaunchPlan, Program
from agents.finetune.launchers.readme import SCRIPT, readme, script
from agents.finetune.launchers.sources import DataFacts, PicturesToTokens, data_facts, open_source
from agents.finetune.launchers.trl import TRL
from agents.finetune.models import ChosenModel, choose_model, picture_tokens
from agents.finetune.settings import FinetuneSettings
from er_gym.data.trajectory import PictureRecord
from er_gym.writing import check_folder, whole_folder, write_atomic

PROGRAMS: dict[str, Program] = {row.name: row for row in (LLAMA_FACTORY, MS_SWIFT, TRL, DEEPSPEED)}
"""All programs by name."""
FULL_GPUS, LORA_GPUS = 8, 1
"""On how many GPUs a run trains, if nothing is said."""


def write_files(
    program: str,
    settings: FinetuneSettings,
    model: str,
    data: Path,
    out: Path,
    *,
    gpus: int | None = None,
    copy: bool = False,
) -> list[Path]:
    """Write all that a program needs to make a run.

    Everything is there when it is complete, or nothing (:func:`er_gym.writing.whole_folder`).

    Args:
        program: a name of :data:`PROGRAMS`.
        settings: of the run.
        model: see :func:`agents.finetune.models.choose_model`.
        data: a collection, or a ShareGPT file.
        out: the output folder; it may be there if it is empty.
        gpus: on how many GPUs it will run; by default 8 for full fine-tuning and 1 for LoRA.
        copy: copy pictures instead of linking them.

    Returns:
        The files without the data's pictures, in alphabetical order.

    Raises:
        ValueError: no such program, model or data; a conversation is longer than
            ``data.max_length``; the program does not know the mask or the optimizer; or ``out`` is
            not empty.
        OSError: something cannot be written.
    """
    if program not in PROGRAMS:
        raise ValueError(f"there is no program {program!r:.60}; choose of {', '.join(PROGRAMS)}")
    if settings.data.mask == "all" and program != "deepspeed":  # that runs er-gym finetune
        raise ValueError(f"{program} cannot learn with data.mask=all; set turns or released")
    if settings.training.optimizer != "adamw":
        raise ValueError(f"{program} cannot learn with training.optimizer=muon; set adamw")
    chosen = choose_model(model)
    check_folder(out)
    count = gpus or (LORA_GPUS if settings.model.lora else FULL_GPUS)
    source = open_source(data, settings.data)
    facts = data_facts(source, _counter(chosen, settings))
    _check_length(facts, settings)
    plan = LaunchPlan(settings, chosen, source, facts, count, copy)
    with whole_folder(out) as draft:
        files = PROGRAMS[program].write(plan, draft)
        for name, text in files.texts.items():
            write_atomic(draft / name, text)
        write_atomic(draft / SCRIPT, script(files), mode=0o755)
        write_atomic(draft / "README.md", readme(plan, files, program))
    beside = [path for path in out.iterdir() if path.is_file()]
    return sorted([*beside, *(path for path in (out / DATA).iterdir() if path.is_file())])


def _counter(model: ChosenModel, settings: FinetuneSettings) -> PicturesToTokens:
    """Counts the tokens of a picture."""
    side, data = model.facts.token_side, settings.data

    def count(picture: PictureRecord) -> int:
        return picture_tokens(side, picture.width, picture.height, data.min_pixels, data.max_pixels)

    return count


def _check_length(facts: DataFacts, settings: FinetuneSettings) -> None:
    limit = settings.data.max_length
    if facts.tokens > limit:
        raise ValueError(
            f"the conversation {facts.longest} has about {facts.tokens:,} tokens, "
            f"{facts.picture_tokens:,} of them for {facts.shown} pictures: about "
            f"{facts.tokens - limit:,} more than data.max_length {limit:,}; set data.max_length="
            f"{facts.tokens} or a lower data.max_pixels (nothing is ever cut off)"
        )
