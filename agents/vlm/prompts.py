"""Loads prompts: templates of ``configs/prompts``, or the texts of a training file."""

from __future__ import annotations

from pathlib import Path

from agents.vlm.paper_prompts import read_prompts
from agents.vlm.prompt_set import PromptSet
from agents.vlm.settings import Prompts
from agents.vlm.templates import directory_of, load_templates


def load_prompts(settings: Prompts) -> PromptSet:
    """Load the prompts that the settings name, and render each once as a check.

    Raises:
        ValueError: the prompts do not exist, a template or the training file is invalid, or Jinja
            is missing. The message is one line with the place and the reason.
    """
    templates = load_templates(directory_of(settings.profile, settings.language))
    if not settings.dataset:
        return templates
    return read_prompts(Path(settings.dataset), templates)
