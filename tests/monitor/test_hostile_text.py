"""Whatever a model says, a page shows it as text."""

from __future__ import annotations

import contextlib
from html.parser import HTMLParser
from pathlib import Path

import pytest

from agents.vlm.record import ConversationRecord
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.formats import pieces, visible
from er_gym.rollout.events import EpisodeBegun, EventLog, RunBegun
from er_gym.rollout.run_directory import RunDirectory
from er_gym.writing import file_stem

HOSTILE = (
    "<script>alert(1)</script>", "</script><script>alert(1)</script>",
    "<img src=x onerror=alert(1)>", "\"><svg onload=alert(1)>", "' onmouseover='alert(1)",
    "javascript:alert(1)", "</p></li></ol>",
    "<!-- ", "]]>", "<style>*{display:none}</style>", "<iframe src=//evil.example></iframe>",
    "<base href=//evil.example>", "<meta http-equiv=refresh content='0;url=//evil.example'>",
    "{{ 7 * 7 }}{% for x in y %}", "${7*7}", "\u202egnp.exe\u202c", "\u200bhid\u2060den\ufeff",
    "\ud800 half a pair", "\x00\x07\x1b[2J", "&lt;script&gt;", "a" * 2_000_000, "\u0301" * 500,
    "｀𝕳𝖊𝖑𝖑𝖔 \U000e0041\U000e0042", "\r\nSet-Cookie: a=b",
)  # fmt: skip


class Seen(HTMLParser):
    """The tags, the attributes and the text of a page."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.names: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.names |= {name for name, _ in attrs}

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def seen(text: str) -> Seen:
    found = Seen()
    found.feed(text)
    found.close()
    return found


def run_of(folder: Path, manifest, episode, text: str) -> str:
    """A run in which everything that can be text is this one; the episode's key."""
    run = RunDirectory.create(folder / "run", manifest)
    usable = text.encode("utf-8", "replace").decode()
    record = episode(("pickup Egg",), ("pickup Egg", "!pickup Egg"), name=usable, error=usable)
    steps = [
        step.model_copy(update={"thought": usable, "feedback": usable, "navigable": [usable]})
        for step in record.steps
    ]
    run.write(record.model_copy(update={"steps": steps, "agent": usable[:200]}))
    said = {
        "task_id": record.key,
        "agent": "openai:x",
        "scene": usable[:99],
        "instruction": usable,
        "settings": {},
        "prompts": "p",
        "prompts_digest": "",
        "prompt_tokens": 1,
        "completion_tokens": 1,
        "cost": 0.0,
        "messages": [
            {"role": "user", "parts": [usable]},
            {"role": "assistant", "parts": [usable], "reasoning": usable},
        ],
        "rounds": [
            {"message": 1, "thoughts": [{"kind": usable[:99], "text": usable}], "name": usable}
        ],
    }
    (run.path / "conversations").mkdir(exist_ok=True)
    file = run.path / "conversations" / f"{file_stem(record.key)}.json"
    file.write_text(ConversationRecord.model_validate(said).model_dump_json())
    return record.key


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_it_is_shown_and_changes_nothing(text, tmp_path, manifest, episode, visit):
    key = run_of(tmp_path, manifest, episode, text)
    plain = run_of(tmp_path / "plain", manifest, episode, "harmless")
    client = visit(tmp_path)
    every = {directory.name: directory for directory in Directories([tmp_path]).all()}
    (hostile,) = (each for each in every.values() if "plain" not in each.name)
    (harmless,) = (each for each in every.values() if "plain" in each.name)
    for page in (
        "/runs/{id}", "/runs/{id}/episode?key={key}", "/runs/{id}?text={text}",
        "/runs/{id}/request?key={key}",
    ):  # fmt: skip
        answers = [
            client.get(page.format(id=directory.id, key=name, text="%3Cscript%3E%22"))
            for directory, name in ((hostile, key), (harmless, plain))
        ]
        assert [each.status_code for each in answers] == [200, 200]
        found, wanted = (seen(each.text) for each in answers)
        long = [tag for tag in ("details", "summary", "b", "p", "span") if len(text) > 4_000]
        assert [t for t in found.tags if t not in long] == [t for t in wanted.tags if t not in long]
        assert found.names == wanted.names
        shown = "".join(found.text)
        for char in "\u202e\u200b\ufeff\x00\x1b\U000e0041":
            assert char not in shown
        assert len(answers[0].content) < 2_500_000
    if text.isprintable() and len(text) < 4_000:
        page = seen(client.get(f"/runs/{hostile.id}/episode?key={key}").text)
        assert visible(text) in "".join(page.text)


def test_a_stream_may_hold_anything(tmp_path, manifest, visit):
    run = RunDirectory.create(tmp_path / "run", manifest)
    with contextlib.closing(EventLog(run.path)) as log:
        log(RunBegun(suite="s", agent="a", tasks=len(HOSTILE), done=0))
        for number, text in enumerate(HOSTILE):
            usable = text.encode("utf-8", "replace").decode()
            told = {"task_id": f"{number} {usable[:50]}", "task_type": usable[:300]}
            log(EpisodeBegun(**told, scene=usable[:300], instruction=usable, max_steps=9))
    events = run.path / "events.jsonl"
    with events.open("ab") as file:
        file.write(b'\xff\xfe not JSON\n{\n[]\nnull\n{"kind": [1]}\n' + b"9" * 10_000_000 + b"\n")
        file.write(
            b'{"time":1,"kind":"episode_begun"}\n{"kind":"step","time":{}}\n' + b"[" * 99_999
        )
    client = visit(tmp_path)
    (directory,) = Directories([tmp_path]).all()
    answer = client.get(f"/runs/{directory.id}")
    assert answer.status_code == 200
    text = "".join(seen(answer.text).text)
    assert f"0 of {len(HOSTILE)}" in text
    assert "<img src=x onerror=alert(1)>" in text
    own = seen(client.get("/gone").text).tags.count("script") + 1  # that saves tags
    assert seen(answer.text).tags.count("script") == own


def test_what_a_browser_lays_out_slowly_is_parted_and_counted():
    assert visible("e" + "\u0301" * 200_000) == "e" + "\u0301" * 4 + "⟨U+0301 …199995⟩ …"
    assert visible("Việt nǎ\u0301i") == "Việt nǎ\u0301i"
    for text in ("A-" * 50_000, "one two\nthree " * 3_000, "a" * 3_999, ""):
        parts = pieces(text)
        assert "".join(parts) == text
        assert max(map(len, parts)) <= 4_000
    assert all(part.endswith((" ", "\n")) for part in pieces("one two\nthree " * 3_000)[:-1])
