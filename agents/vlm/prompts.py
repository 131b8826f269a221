"""The words that a model is given: templates of ``configs/prompts``, or a training file's own."""

from __future__ import annotations

from pathlib import Path

from agents.vlm.paper_prompts import read_prompts
from agents.vlm.prompt_set import PromptSet
from agents.vlm.settings import Prompts
from agents.vlm.templates import directory_of, load_templates


def load_prompts(settings: Prompts) -> PromptSet:
    """The prompts that settings ask for, tried out once.

    Raises:
        ValueError: there are none such, a template or the training file is wrong, or Jinja is
            missing; one line says where and why.
    """
    templates = load_templates(directory_of(settings.profile, settings.language))
    if not settings.dataset:
        return templates
    return read_prompts(Path(settings.dataset), templates)
