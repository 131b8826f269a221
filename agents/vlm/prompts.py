"""Loads prompts: templates of ``configs/prompts``, or the texts of a training file or a dialect."""

from __future__ import annotations

from pathlib import Path

from agents.vlm.dialect_prompts import dialect_prompts
from agents.vlm.paper_prompts import read_prompts
from agents.vlm.prompt_set import PromptSet
from agents.vlm.settings import AgentSettings, Prompts
from agents.vlm.templates import directory_of, load_templates


def load_prompts(settings: Prompts) -> PromptSet:
    """Load the prompts that the settings name, and render each once as a check.

    Raises:
        ValueError: the prompts do not exist, a template or the training file is invalid, or Jinja
            is missing. The message is one line with the place and the reason.
    """
    if settings.dialect:
        return dialect_prompts(settings.dialect, settings.language)
    templates = load_templates(directory_of(settings.profile, settings.language))
    if not settings.dataset:
        return templates
    return read_prompts(Path(settings.dataset), templates)


def prompts_for(settings: AgentSettings) -> PromptSet:
    """The prompts of an agent with these settings.

    Raises:
        ValueError: as :func:`load_prompts`, or other settings do not fit the prompts.
    """
    prompts = load_prompts(settings.prompts)
    prompts.check(decide=settings.decide, sees=settings.sees)
    return prompts
