"""Pages of data: a collection's counts are those of its statistics, a trajectory is whole."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fastapi.testclient import TestClient
from played_collection import make_collection

from benchmarks.monitor.collection_index import CollectionIndex
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.fingerprint import fingerprint
from benchmarks.monitor.flow import flow
from er_gym.data.collection import TRAJECTORIES, Collection
from er_gym.data.statistics import statistics
from er_gym.data.trajectory import Subgoal, Trajectory
from er_gym.tasks.types import canonical_names

HOSTILE = "<script>alert(1)</script> \u202e \"'><img src=x onerror=alert(1)> {{ 7 * 7 }}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A collection of real episodes; a thought of the first one was refused before it stood."""
    root = tmp_path_factory.mktemp("data")
    collection = make_collection(root / "x", parts=("imitation", "anomalies"))
    first, *rest = collection.trajectories()
    collection.write([with_thought(first, refused=["unseen", "side"]), *rest])
    return root


def with_thought(trajectory: Trajectory, **changes: object) -> Trajectory:
    """The trajectory with another first thought; its first turn is not learnt, and has a goal."""
    turn = trajectory.turns[0]
    thought = turn.thoughts[0].model_copy(update=changes)
    goal = Subgoal(verb="put in", thing="Apple", place="Fridge")
    thoughts = [thought, *turn.thoughts[1:]]
    turn = turn.model_copy(update={"thoughts": thoughts, "train": False, "subgoal": goal})
    return trajectory.model_copy(update={"turns": [turn, *trajectory.turns[1:]]})


@pytest.fixture
def collection(folder: Path) -> Collection:
    return Collection.open(folder / "x")


@pytest.fixture
def client(folder: Path, visit) -> TestClient:
    return visit(folder)


@pytest.fixture
def address(folder: Path) -> str:
    (directory,) = Directories([folder]).of_kind("collection")
    return f"/data/{directory.id}"


def said(text: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text.replace("<wbr>", ""))).split())


def rows(text: str) -> list[str]:
    return re.findall(
        r"<tr[^>]*>\n<td[^>]*><a href=.*?</tr>", text[text.index('id="rows"') :], re.DOTALL
    )


def same(index: CollectionIndex, collection: Collection) -> None:
    wanted = statistics(collection)
    for name in ("task_types", "languages", "turns", "trained_turns", "refused", "thoughts",
                 "transitions"):  # fmt: skip
        assert getattr(index.found, name) == getattr(wanted, name), name


def test_the_index_counts_as_the_statistics_do(collection):
    index = CollectionIndex(collection.path / TRAJECTORIES)
    index.read()
    every = list(collection.trajectories())
    assert [head.id for head in index.heads] == [each.id for each in every]
    assert [head.turns for head in index.heads] == [each.actions for each in every]
    assert index.at(every[2].id) is index.heads[2]
    assert index.found.refused == {"unseen": 1, "side": 1}
    assert index.found.trained_turns < index.found.turns
    same(index, collection)


def test_other_layouts_are_read_and_damage_is_counted(collection, tmp_path):
    other = Collection.create(tmp_path / "y", collection.manifest)
    lines = (collection.path / "trajectories.jsonl").read_text().splitlines()
    spaced = [json.dumps(json.loads(line), indent=None) for line in lines]  # spaces after colons
    file = other.path / "trajectories.jsonl"
    file.write_text("\n".join(spaced[:3]) + "\n")
    index = CollectionIndex(other.path / TRAJECTORIES)
    index.read()
    assert len(index.heads) == 3
    same(index, other)
    with file.open("a") as grown:  # half a line is left for later
        grown.write("\n".join(["{}", "[1]", "no JSON", lines[3]]) + "\n" + lines[4][:500])
    index.read()
    assert (len(index.heads), index.damaged) == (4, 3)
    other.write(collection.trajectories())
    index.read()
    assert (len(index.heads), index.damaged) == (len(lines), 0)
    same(index, other)


def test_texts_that_look_like_fields_are_texts(collection, tmp_path):
    other = Collection.create(tmp_path / "y", collection.manifest)
    first = next(collection.trajectories())
    trap = 'a"purpose":"b,"verb":"c],"success":false,{"kind":"planning","text":"x\\'
    other.write([with_thought(first, text=trap).model_copy(update={"instruction": trap})])
    index = CollectionIndex(other.path / TRAJECTORIES)
    index.read()
    assert index.heads[0].success is first.success
    same(index, other)


def test_a_collection_shows_its_counts(client, address, collection):
    answer = client.get("/data")
    assert f'href="{address}"' in answer.text
    found = statistics(collection)
    assert f"finished {found.trajectories}" in said(answer.text)
    page = client.get(address)
    text = said(page.text)
    assert f"Thoughts {found.all_thoughts}" in text
    assert f"imitation {found.parts['imitation'].trajectories}" in text
    assert "unseen 1 50.0 %" in text
    (picture,) = re.findall(r'<svg class="flow".*?</svg>', page.text, re.DOTALL)
    shares = found.transition_shares()
    percent = round(shares["begin"]["analysis"])
    assert f"begin → situation analysis {percent} %" in said(picture)
    assert len(re.findall(r'<path class="band', picture)) == sum(map(len, shares.values()))
    for svg in re.findall(r"<svg.*?</svg>", page.text, re.DOTALL):
        ElementTree.fromstring(svg)


def test_trajectories_are_filtered_and_sorted(client, address, collection):
    every = list(collection.trajectories())
    assert len(rows(client.get(address).text)) == len(every)
    for name, value, takes in (
        ("part", "anomalies", lambda each: each.part == "anomalies"),
        ("type", every[0].task_type, lambda each: each.task_type == every[0].task_type),
        ("type", "Transport", lambda each: each.task_type in canonical_names(["Transport"])),
        ("refused", "side", lambda each: each.id == every[0].id),
        ("text", every[1].id.upper(), lambda each: each.id == every[1].id),
        ("sort", "nonsense", lambda each: True),
    ):
        shown = rows(client.get(address, params={name: value}).text)
        assert len(shown) == sum(map(takes, every)), name
    unknown = client.get(address, params={"type": "serch"}).text
    assert not rows(unknown)
    assert "did you mean Search" in said(unknown)
    by_turns = rows(client.get(address, params={"sort": "-turns"}).text)
    turns = [int(re.findall(r'class="number">(\d+)<', row)[0]) for row in by_turns]
    assert turns == sorted((each.actions for each in every), reverse=True)


def test_a_trajectory_is_shown_turn_by_turn(client, address, collection):
    first, second, *_ = collection.trajectories()
    page = client.get(f"{address}/trajectory", params={"key": first.id})
    assert page.status_code == 200
    assert len(re.findall(r"data-step=", page.text)) == first.actions
    text = said(page.text)
    for turn in first.turns:
        assert str(turn.action) in text
        assert " ".join(turn.feedback.split()) in text
        for thought in turn.thoughts:
            assert " ".join(thought.text.split()) in text
    assert "refused: unseen" in text
    assert text.count("not learnt") == 1
    assert "put in Apple → Fridge" in text
    assert html.escape(second.id) in page.text  # the next one
    pictures = [picture for turn in first.turns for picture in turn.pictures]
    beside = re.findall(r'data-step="(\d+)" data-pictures="([\d,]+)" data-stand="(\d+)"', page.text)
    assert [int(stand) for _, _, stand in beside] == list(range(first.actions))
    for step, numbers, _ in beside:  # the pictures that the turn was decided on
        own = first.turns[int(step)].pictures
        assert [pictures[int(each)] for each in numbers.split(",")] == own
    got = client.get(f"{address}/picture", params={"key": first.id, "n": 0})
    assert got.content == (collection.path / pictures[0].path).read_bytes()
    assert got.headers["content-type"] == "image/jpeg"
    beyond = client.get(f"{address}/picture", params={"key": first.id, "n": len(pictures)})
    assert beyond.status_code == 404
    room = client.get(f"{address}/map", params={"key": first.id}).text
    assert room.count('class="stand"') == first.actions + 1
    assert client.get(f"{address}/trajectory", params={"key": "none"}).status_code == 404


def test_pictures_come_from_the_collection_alone(collection, tmp_path, visit):
    (tmp_path / "secret.jpeg").write_bytes(b"secret")
    first = next(collection.trajectories())
    other = Collection.create(tmp_path / "y", collection.manifest)
    (other.path / "parts").mkdir()
    (other.path / "parts" / "link.jpeg").symlink_to(tmp_path / "secret.jpeg")
    (other.path / "parts" / "text.txt").write_text("secret")
    paths = ("../secret.jpeg", "parts/../../secret.jpeg", str(tmp_path / "secret.jpeg"),
             "parts/link.jpeg", "parts/text.txt", "parts", "collection.json", "a\x00b")  # fmt: skip
    turn = first.turns[0]
    picture = turn.pictures[0]
    shown = [picture.model_copy(update={"path": path}) for path in paths]
    turn = turn.model_copy(update={"pictures": shown})
    other.write([first.model_copy(update={"turns": [turn], "part": "../.."})])
    client = visit(tmp_path)
    (directory,) = Directories([tmp_path]).of_kind("collection")
    for number in range(len(paths)):
        answer = client.get(f"/data/{directory.id}/picture", params={"key": first.id, "n": number})
        assert answer.status_code == 404, paths[number]
    assert (
        "part is not there"
        in client.get(f"/data/{directory.id}/map", params={"key": first.id}).text
    )


def test_what_a_model_says_stays_text(collection, tmp_path, visit):
    first = next(collection.trajectories())
    other = Collection.create(tmp_path / "y", collection.manifest)
    hostile = with_thought(first, text=HOSTILE, writer=HOSTILE, refused=[HOSTILE])
    update = {"instruction": HOSTILE, "task_type": HOSTILE, "part": HOSTILE, "actor": HOSTILE}
    other.write([hostile.model_copy(update=update)])
    client = visit(tmp_path)
    (directory,) = Directories([tmp_path]).of_kind("collection")
    for path in ("", f"/trajectory?key={first.id}"):
        text = client.get(f"/data/{directory.id}{path}").text
        assert "<img src=x" not in text
        assert "<script>alert" not in text
        assert "\u202e" not in said(text)
        assert "<img src=x onerror=alert(1)> {{ 7 * 7 }}" in said(text)


def test_a_collection_that_is_being_made_can_be_followed(collection, tmp_path, visit):
    growing = tmp_path / "y"
    (growing / "parts").mkdir(parents=True)
    (growing / "collection.json").write_text(collection.manifest.model_dump_json())
    client = visit(tmp_path)
    (directory,) = Directories([tmp_path]).of_kind("collection")
    before = fingerprint(directory)
    assert "when it ends or is interrupted" in client.get(f"/data/{directory.id}").text
    part = growing / "parts" / "imitation"
    part.mkdir()
    (part / "events.jsonl").write_text(
        '{"time":1.0,"kind":"run_begun","suite":"s","agent":"a","tasks":9,"done":0}\n'
    )
    assert fingerprint(directory) != before
    assert "imitation stopped 0 of 9" in said(client.get(f"/data/{directory.id}").text)


def test_a_flow_keeps_its_widths():
    counts = {"a": {"b": 30, "c": 10}, "b": {"c": 40}}
    picture = flow("f", "T", counts, {"a": "A", "b": "<B>", "c": "C"}, ("x", "y"))
    root = ElementTree.fromstring(str(picture))
    widths = [float(each.get("stroke-width", 0)) for each in root.iter("path")]
    assert widths[0] == pytest.approx(3 * widths[1], rel=0.02)
    assert widths[2] == pytest.approx(4 * widths[1], rel=0.02)
    assert flow("f", "T", {"a": {}}, {"a": "A"}, ("x", "y")) == ""
