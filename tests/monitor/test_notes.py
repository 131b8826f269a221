"""What people note of a run and of its episodes."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path

import pytest

from benchmarks.monitor.directories import Directories
from benchmarks.monitor.episode_filter import Filter
from benchmarks.monitor.export import ExportRequest, export
from benchmarks.monitor.notes import CannotNote, Note, note_episode, read_notes, tag_run
from er_gym.rollout.run_directory import NOTES, RunDirectory

HERE = "http://127.0.0.1:8010"
HOSTILE = "<script>alert(1)</script> \u202egnp\u202c =1+1"


@pytest.fixture
def folder(runs: Path, tmp_path: Path) -> Path:
    return shutil.copytree(runs / "random", tmp_path / "random")


def test_a_note_is_kept_beside_the_run_shown_filtered_saved_and_exported(folder, visit, tmp_path):
    client = visit(folder)
    address = f"/runs/{Directories([folder]).all()[0].id}"
    first, second, *_ = [each.key for each in RunDirectory.open(folder).episodes()]
    page = client.get(f"{address}/episode", params={"key": first}).text
    secret = re.search(r'name="secret" value="([^"]+)"', page)[1]
    form = {"secret": secret, "key": first, "flag": "on", "text": HOSTILE}
    state = client.get("/live").text
    answer = client.post(f"{address}/note", data=form, headers={"origin": HERE})
    assert (answer.status_code, answer.headers["location"]) == (303, address)
    assert client.get("/live").text != state  # open pages are told
    assert read_notes(folder).episodes == {first: Note(flag=True, text=HOSTILE)}
    client.post(
        f"{address}/note",
        data={"secret": secret, "key": second, "text": "b"},
        headers={"origin": HERE},
    )
    client.post(
        f"{address}/tags", data={"secret": secret, "tags": "x , y,x"}, headers={"origin": HERE}
    )
    assert json.loads((folder / NOTES).read_text())["tags"] == ["x", "y"]

    assert "⟨U+202E⟩" in client.get(address).text
    for filter, keys in (("flag", [first]), ("note", [first, second])):
        rows = client.get(f"{address}?note={filter}&as=json&table=episodes").json()
        assert sorted(each["id"] for each in rows) == sorted(keys)
    assert {each["Task flag"]: each["Task note"][:3] for each in rows} == {1: "<sc", None: "b"}
    for each in (
        client.get(address).text,
        client.get(f"{address}/episode", params={"key": first}).text,
    ):
        assert "alert(1)" in each
        assert "<script>alert" not in each
    out = tmp_path / "x.html"
    export(ExportRequest(folder, out, 1, Filter(note="flag")))
    assert html.escape("<script>alert(1)</script>") in out.read_text()
    assert "<script>alert" not in out.read_text()

    form |= {"flag": "", "text": " "}
    client.post(f"{address}/note", data=form, headers={"origin": HERE})
    assert list(read_notes(folder).episodes) == [second]


def test_nobody_else_notes_anything(folder, visit):
    client = visit(folder)
    address = f"/runs/{Directories([folder]).all()[0].id}"
    key = next(iter(RunDirectory.open(folder).episodes())).key
    secret = re.search(r'name="secret" value="([^"]+)"', client.get(address).text)[1]
    good = {"secret": secret, "key": key, "text": "x"}
    for change, headers, status in (
        ({}, {}, 403),
        ({}, {"origin": "http://evil.example"}, 403),
        ({"secret": "guessed"}, {"origin": HERE}, 403),
        ({"key": "../../x"}, {"origin": HERE}, 404),
        ({"text": "x" * 4_001}, {"origin": HERE}, 409),
        ({"text": "x" * 90_000}, {"origin": HERE}, 413),
    ):
        answer = client.post(f"{address}/note", data=good | change, headers=headers)
        assert answer.status_code == status, change
    answer = client.post(f"{address}/note", json=good, headers={"origin": HERE})
    assert answer.status_code == 415
    back = good | {"back": "//evil.example"}
    assert not (folder / NOTES).exists()
    answer = client.post(f"{address}/note", data=back, headers={"origin": HERE})
    assert answer.headers["location"] == address
    assert (
        client.post("/runs/000000000000/tags", data=good, headers={"origin": HERE}).status_code
        == 404
    )


def test_what_is_no_file_of_notes_is_told_and_not_replaced(folder, visit):
    address = f"/runs/{Directories([folder]).all()[0].id}"
    (folder / NOTES).write_text('{"format": "mine"}')
    assert "notes.json cannot be read" in visit(folder).get(address).text
    for change in (lambda: note_episode(folder, "k", Note(text="x")), lambda: tag_run(folder, "a")):
        with pytest.raises(CannotNote, match=r"notes\.json cannot be read"):
            change()
    assert (folder / NOTES).read_text() == '{"format": "mine"}'
    (folder / NOTES).unlink()
    (folder.parent / "secret.json").write_text('{"tags": ["secret"]}')
    (folder / NOTES).symlink_to(folder.parent / "secret.json")
    with pytest.raises(CannotNote):
        read_notes(folder)
    for tags in (",".join(map(str, range(21))), "x" * 41):
        with pytest.raises(CannotNote, match="at most"):
            tag_run(folder, tags)
