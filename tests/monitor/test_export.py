"""Exports open from a disk, ask for nothing, and say what the server says."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from benchmarks.cli import main as cli
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks.types import canonical_names

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
HOSTILE = (
    "</script><script>alert(1)</script><!-- <script> ]]> </template></main></body> "
    "\u2028 \u202e \"'><img src=x onerror=alert(1)> {{ 7 * 7 }}"
)


def export(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        cli.main(["ui", "--export", *map(str, arguments)])
    return int(left.value.code or 0)


class Seen(HTMLParser):
    """What a page holds: tags, addresses, and the text of scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.told: list[tuple[str, dict[str, str | None]]] = []
        self.inline: dict[str, list[str]] = {"script": [], "style": []}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.told.append((tag, dict(attrs)))
        if tag in self.inline:
            self.inline[tag].append("")

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1] in self.inline and self.cdata_elem:
            self.inline[self.tags[-1]][-1] += data

    def addresses(self) -> list[str]:
        names = ("href", "src", "data-src", "action", "data-map", "data-frame")
        return [told[name] or "" for _, told in self.told for name in names if name in told]


def policy_of(page: Seen) -> str:
    (policy,) = (
        told["content"] for _, told in page.told
        if told.get("http-equiv") == "Content-Security-Policy"
    )  # fmt: skip
    assert policy is not None
    return policy


def test_one_file_holds_everything_and_needs_no_other(runs, tmp_path, capsys):
    out = tmp_path / "x.html"
    assert export(runs / "random", "--out", out, "--episodes", 2, "--draw") == 0
    assert "2 of 8 episodes" in capsys.readouterr().out
    page = Seen(out.read_text(encoding="utf-8"))
    for address in page.addresses():
        assert not address or address.startswith(("?", "#", "data:")), address
    assert page.tags.count("template") == 2
    rows = [json.loads(str(told["data-values"])) for _, told in page.told if "data-values" in told]
    assert len(rows) == 8
    pictures = [told["data-src"] for _, told in page.told if "data-picture" in told]
    assert len(pictures) > 2
    assert base64.b64decode(str(pictures[0]).split(",")[1]).startswith(b"\xff\xd8\xff")
    maps = [told for tag, told in page.told if tag == "svg" and told.get("class") == "room"]
    assert len(maps) == 2
    policy = policy_of(page)
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    for kind, texts in page.inline.items():
        assert texts
        hashes = [base64.b64encode(hashlib.sha256(each.encode()).digest()).decode()
                  for each in texts]  # fmt: skip
        assert f"{kind}-src " + " ".join(f"'sha256-{each}'" for each in hashes) in policy


def test_what_is_chosen_has_replays(runs, tmp_path):
    out = tmp_path / "x.html"
    only = ("--only", "sort=task", "--only", "outcome=success", "--language", "zh")
    assert export(runs / "oracle", "--out", out, *only) == 0
    page = Seen(out.read_text(encoding="utf-8"))
    assert page.tags.count("template") == 8
    assert "任务类型" in out.read_text(encoding="utf-8")
    assert export(runs / "oracle", "--out", out) == 2  # it is there
    types = [each.task_type for each in RunDirectory.open(runs / "oracle").episodes()]
    for name in ("Search", "Exposed Object Search", "long_range"):
        some = ("--only", f"type={name}", "--overwrite")
        assert export(runs / "oracle", "--out", out, *some) == 0
        expected = sum(each in canonical_names([name]) for each in types)
        assert Seen(out.read_text(encoding="utf-8")).tags.count("template") == expected, name
    none = ("--only", "outcome=failure", "--overwrite")
    assert export(runs / "oracle", "--out", out, *none) == 0
    assert "<template" not in out.read_text(encoding="utf-8")


def test_a_folder_links_its_pages(runs, tmp_path):
    out = tmp_path / "folder"
    assert export(runs / "random", "--out", out, "--episodes", 2, "--draw") == 0
    files = {str(each.relative_to(out)) for each in out.rglob("*") if each.is_file()}
    assert {"index.html", "episodes/0001.html", "episodes/0002.html"} <= files
    for name in files:
        if name.endswith(".html"):
            for address in Seen((out / name).read_text(encoding="utf-8")).addresses():
                path = address.partition("?")[0].partition("#")[0]
                if path and not path.startswith("data:"):
                    assert ((out / name).parent / path).resolve() in {
                        (out / each).resolve() for each in files
                    }, address
    (out / "mine.txt").write_text("kept")
    assert export(runs / "random", "--out", out, "--overwrite") == 2
    (out / "mine.txt").unlink()
    assert export(runs / "random", "--out", out, "--overwrite", "--episodes", 1) == 0
    assert not (out / "episodes" / "0002.html").exists()
    assert [each.name for each in tmp_path.iterdir()] == ["folder"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--out", "x.html", "--only", "colour=red"), "type, scene"),
        (("--out", "x.html", "--only", "sort=colour"), "steps"),
        (("--out", "x.html", "--only", "type=serch"), "did you mean Search"),
        ((), "--out"),
    ],
)
def test_bad_options_are_one_line(arguments, told, runs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert export(runs / "oracle", *arguments) == 2
    message = capsys.readouterr().err
    assert told in message
    assert message.count("\n") == 1
    assert not list(tmp_path.iterdir())


def hostile_copy(run: Path, to: Path) -> Path:
    """A run in which the instructions, thoughts and answers are hostile."""
    shutil.copytree(run, to)
    for file in (to / "episodes").glob("*.json"):
        told: dict[str, Any] = json.loads(file.read_text())
        told["instruction"] = HOSTILE
        for step in told["steps"]:
            step["thought"] = step["feedback"] = HOSTILE
        file.write_text(json.dumps(told))
    lines = []
    for line in (to / "events.jsonl").read_text().splitlines():
        event = json.loads(line)
        event |= {"instruction": HOSTILE} if "instruction" in event else {}
        lines.append(json.dumps(event) + "\n")
    (to / "events.jsonl").write_text("".join(lines))
    return to


def test_what_a_model_says_stays_text(runs, tmp_path):
    plain, hostile = tmp_path / "plain.html", tmp_path / "hostile.html"
    run = hostile_copy(runs / "oracle", tmp_path / "oracle")
    assert export(runs / "oracle", "--out", plain, "--episodes", 2) == 0
    assert export(run, "--out", hostile, "--episodes", 2) == 0
    pages = [Seen(each.read_text(encoding="utf-8")) for each in (plain, hostile)]
    ignored = {"div", "p"}  # the oracle has no thoughts of its own
    kept = [[tag for tag in page.tags if tag not in ignored] for page in pages]
    assert kept[0] == kept[1]
    assert pages[0].inline == pages[1].inline
    text = hostile.read_text(encoding="utf-8")
    assert "\u2028" not in text
    assert "\u202e" not in text
    assert "alert(1)" in html.unescape(text)


def test_what_needs_the_server_goes(runs, tmp_path, visit):
    out = tmp_path / "x"
    assert export(runs / "random", "--out", out, "--episodes", 1) == 0
    files = (out / "index.html", out / "episodes" / "0001.html")
    exported = "".join(file.read_text(encoding="utf-8") for file in files)
    browser = visit(runs / "random")
    home = Seen(browser.get("/").text)
    run = next(address for address in home.addresses() if address.startswith("/runs/"))
    listed = browser.get(run).text
    episode = next(each for each in Seen(listed).addresses() if "/episode?" in each)
    served = listed + browser.get(episode).text
    for needs_the_server in ('class="menu"', 'class="language"', " download ", "data-draw>"):
        assert needs_the_server in served
        assert needs_the_server not in exported
    assert 'data-map=""><svg class="room"' in exported, "the map is in the page, not fetched"


@pytest.mark.skipif(CHROMIUM is None, reason="needs the browser: apt-get install chromium")
def test_a_browser_opens_it_from_the_disk(runs, tmp_path):
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    out = tmp_path / "x.html"
    hostile = hostile_copy(runs / "random", tmp_path / "random")
    only = ("--only", "sort=steps", "--only", "steps=-10")
    assert export(hostile, "--out", out, "--episodes", 2, *only, "--draw") == 0
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        context = browser.new_context(offline=True)
        page = context.new_page()
        wrong: list[str] = []
        page.on("console", lambda one: wrong.append(one.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("dialog", lambda one: wrong.append(one.message))
        asked: list[str] = []
        page.on("request", lambda one: asked.append(one.url))
        page.goto(out.as_uri())
        rows = page.locator("#rows tbody tr")
        short = rows.count()  # the list opens with what was chosen
        assert short < 8
        assert rows.first.locator("a[href]").count() == 1
        assert page.locator("[name=steps]").input_value() == "-10"
        page.get_by_role("link", name="Clear").click()
        assert rows.count() == 8
        page.locator("[name=steps]").fill("-10")
        page.get_by_role("button", name="Filter").click()
        assert rows.count() == short
        page.get_by_role("link", name="Clear").click()
        assert rows.count() == 8
        page.locator("#rows th a", has_text="Steps").click()
        cells = page.locator("#rows tbody td:nth-child(8)").all_text_contents()
        steps = [int(each.partition("/")[0]) for each in cells]
        assert steps == sorted(steps)
        assert sum(each <= 10 for each in steps) == short
        page.go_back()
        page.locator("#rows tbody a[href]").first.click()
        page.wait_for_url("**?episode=*")
        page.keyboard.press("ArrowRight")
        picture = page.locator(".pictures img:visible")
        assert picture.evaluate("image => image.decode().then(() => image.naturalWidth)") > 0
        assert page.locator(".map svg .stand.now").count() == 1
        assert page.locator(".steps li.now").get_attribute("data-step") == "1"
        browser.close()
    assert wrong == []
    assert {each.partition("?")[0].partition("#")[0] for each in asked if "data:" not in each} == {
        out.as_uri()
    }
