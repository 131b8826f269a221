"""Nothing outside the given folders is read, whatever a request says or a run directory holds."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from agents.vlm.record import PictureRecord
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.episode_view import picture_file
from er_gym.rollout.run_directory import RunDirectory
from er_gym.writing import file_stem

SECRET = "the secret of another folder"

PATHS = (
    "/../secret.txt", "/..%2fsecret.txt", "/%2e%2e/secret.txt", "/%2e%2e%2fsecret.txt",
    "/..%5csecret.txt", "/....//secret.txt", "/.%00./secret.txt", "//secret.txt",
    "/static/../secret.txt", "/static/..%2f..%2fapp.py", "/static/%2e%2e%2fapp.py",
    "/static/....//app.py", "/static/monitor.css%00.txt", "/static//etc/passwd",
    "/static/%2fetc%2fpasswd", "/runs/../secret.txt", "/runs/..%2fsecret.txt",
    "/runs/%2e%2e", "/runs/{id}/../../secret.txt", "/runs/{id}/..%2f..%2fsecret.txt",
    "/runs/{id}%00", "/runs/{id}/", "/runs/" + "a" * 5_000, "/language/..%2fsecret",
)  # fmt: skip
KEYS = (
    "../../secret", "..%2f..%2fsecret", "/etc/passwd", "..\\..\\secret", "secret.txt\0",
    "episodes/",
    "a" * 5_000, "", ".", "~root", "file:///etc/passwd", "{key}/../../../secret",
)  # fmt: skip


@pytest.fixture
def folder(runs: Path, tmp_path: Path) -> Path:
    """A folder of runs beside a secret."""
    (tmp_path / "secret.txt").write_text(SECRET)
    (tmp_path / "secret.json").write_text(json.dumps({"secret": SECRET}))
    shutil.copytree(runs / "oracle", tmp_path / "runs" / "oracle")
    return tmp_path / "runs"


def test_no_address_leads_out_of_the_folders(folder, serve, visit):
    server, client = serve(folder), visit(folder)
    (directory,) = Directories([folder]).all()
    key = next(iter(RunDirectory.open(directory.path).episodes())).key
    assert server.raw(f"/runs/{directory.id}")[0] == 200
    for path in PATHS:
        status, text = server.raw(path.format(id=directory.id))
        assert status in (307, 400, 404), path
        assert SECRET not in text, path
    for name in ("episode", "picture", "map", "frame", "request"):
        for asked in KEYS:
            answer = client.get(
                f"/runs/{directory.id}/{name}", params={"key": asked.format(key=key)}
            )
            assert answer.status_code == 404, (name, asked)
            assert SECRET not in answer.text
    for n in ("-1", "99999999999999999999", "1.5", "٣", "x"):
        for name in ("frame", "request"):
            answer = client.get(f"/runs/{directory.id}/{name}", params={"key": key, "n": n})
            assert answer.status_code in (404, 422), (name, n)


def test_only_get_is_answered(folder, visit):
    client = visit(folder)
    for method in ("POST", "PUT", "DELETE", "PATCH", "TRACE"):
        assert client.request(method, "/").status_code == 405
    assert client.get("/docs").status_code == 404
    assert client.get("/openapi.json").status_code == 404


@pytest.mark.parametrize(
    "back", ["//evil.example", "/\\evil.example", "https://evil.example", "\n/"]
)
def test_the_choice_of_a_language_leads_back_here_only(back, folder, visit):
    answer = visit(folder).get("/language/zh", params={"back": back})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")


def test_links_are_not_followed(folder, visit):
    outside = folder.parent / "outside"
    shutil.copytree(folder / "oracle", outside)
    (folder / "linked").symlink_to(outside, target_is_directory=True)
    assert [directory.path.name for directory in Directories([folder]).all()] == ["oracle"]
    key = next(iter(RunDirectory.open(outside).episodes())).key
    run = folder / "oracle"
    conversation = run / "conversations" / f"{file_stem(key)}.json"
    conversation.parent.mkdir(exist_ok=True)
    conversation.symlink_to(folder.parent / "secret.json")
    (directory,) = Directories([folder]).all()
    answer = visit(folder).get(f"/runs/{directory.id}/episode", params={"key": key})
    assert answer.status_code == 200
    assert SECRET not in answer.text


def test_a_record_cannot_name_a_picture_elsewhere(folder):
    run = folder / "oracle"
    pictures = run / "pictures"
    pictures.mkdir()
    Image.new("RGB", (4, 4)).save(pictures / "0.jpg")
    Image.new("RGB", (4, 4)).save(folder.parent / "outside.jpg")
    (pictures / "link.jpg").symlink_to(folder.parent / "outside.jpg")
    (pictures / "folder.jpg").mkdir()

    def found(path: str) -> Path | None:
        return picture_file(run, PictureRecord(path=path, digest="", width=4, height=4))

    assert found("pictures/0.jpg") == (pictures / "0.jpg").resolve()
    for path in (
        "../../outside.jpg", "pictures/../../../outside.jpg", str(folder.parent / "outside.jpg"),
        "pictures/link.jpg", "pictures/folder.jpg", "pictures", "", "run.json", "pictures/none.jpg",
    ):  # fmt: skip
        assert found(path) is None, path
    shutil.rmtree(pictures)
    pictures.symlink_to(folder.parent, target_is_directory=True)
    assert found("pictures/outside.jpg") is None
