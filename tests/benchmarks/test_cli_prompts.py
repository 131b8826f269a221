"""``er-gym prompts``: the sets of prompts, and copies of them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from agents.expert.writers.prompts import load_writer_prompts
from agents.factory import load_settings
from agents.vlm.prompts import load_prompts
from agents.vlm.settings import Prompts
from er_gym.data.dialects import dialect_names, load_dialect

Run = Callable[..., tuple[int, str, str]]


def test_all_sets_are_listed(er_gym: Run) -> None:
    code, out, _ = er_gym("prompts")
    assert code == 0
    listed = re.findall(r"^([\w-]+) +en, zh  ", out, re.MULTILINE)
    assert listed == ["default", "expert", *dialect_names()]


def test_a_copy_says_the_same_until_it_is_changed(er_gym: Run, tmp_path: Path) -> None:
    mine = tmp_path / "my prompts"
    code, out, _ = er_gym("prompts", "copy", mine)
    assert code == 0
    *_, override = shlex.split(out.splitlines()[-1])
    settings = load_settings(None, [override])
    assert load_prompts(settings.prompts).digest == load_prompts(Prompts()).digest
    assert "next.jinja" in (mine / "README.md").read_text(encoding="utf-8")

    changed = mine / "en" / "system.jinja"
    changed.write_text("Beep.", encoding="utf-8")
    (mine / "zh" / "next.jinja").unlink()
    code, _, err = er_gym("prompts", "copy", mine)
    assert code == 2
    assert str(changed) in err
    assert changed.read_text(encoding="utf-8") == "Beep."
    assert not (mine / "zh" / "next.jinja").exists()  # all or none
    assert er_gym("prompts", "copy", mine, "--force")[0] == 0
    assert load_prompts(settings.prompts).digest == load_prompts(Prompts()).digest


def test_a_copy_of_the_prompts_of_writers(er_gym: Run, tmp_path: Path) -> None:
    assert er_gym("prompts", "copy", tmp_path / "x", "--from", "expert")[0] == 0
    copied = load_writer_prompts("zh", str(tmp_path / "x"))
    assert copied.digest == load_writer_prompts("zh").digest


@pytest.mark.parametrize("name", dialect_names())
def test_a_copy_of_a_dialect(er_gym: Run, tmp_path: Path, name: str) -> None:
    assert er_gym("prompts", "copy", tmp_path / "x", "--from", name)[0] == 0
    assert load_dialect(str(tmp_path / "x")).texts == load_dialect(name).texts


def test_what_cannot_be_copied(er_gym: Run, tmp_path: Path) -> None:
    code, _, err = er_gym("prompts", "copy", tmp_path / "x", "--from", "../agents")
    assert code == 2
    assert "choose one of: default, expert, paper" in err
    assert not (tmp_path / "x").exists()
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    code, _, err = er_gym("prompts", "copy", tmp_path / "file")
    assert (code, err.count("\n")) == (2, 1)
