"""The command as a user runs it."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from support import run_python

from er_gym.rollout import runner
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import RunSummary
from er_gym.tasks.types import TASK_TYPES

COUNTER = "CounterTop|-00.08|+01.15|00.00"
NOTHING = RunSummary(0, 0, ())
ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "benchmarks.cli"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}


def episode_times(out: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in (out / "episodes").glob("*.json")}


# -- bad input -----------------------------------------------------------------------------------


def without(field):
    def change(tasks):
        del tasks[3][field]

    return change


def with_value(field, value):
    def change(tasks):
        tasks[3][field] = value

    return change


def with_unknown_object(tasks):
    tasks[3]["task_metadata"]["actions"][1]["objectId"] = "Apple|+99.00|+99.00|+99.00"


BAD_TASKS = {
    "no scene of that name": (with_value("scene", "FloorPlan999"), ["FloorPlan999", "identity 3"]),
    "no field": (without("tasktype"), ["lacks field 'tasktype'", "identity 3"]),
    "no type of that name": (with_value("tasktype", "cook"), ["'cook'", "single_search"]),
    "no object of that id": (
        with_unknown_object,
        ["paper-3", "Apple|+99.00|+99.00|+99.00", "FloorPlan1"],
    ),
}


def one_line(err: str) -> str:
    assert err.startswith("er-gym: ")
    assert err.count("\n") == 1
    assert err.endswith("\n")
    return err


@pytest.mark.parametrize(("change", "words"), BAD_TASKS.values(), ids=BAD_TASKS)
def test_a_bad_task_is_set_aside(er_gym, tasks_file, paper_tasks, tmp_path, change, words):
    change(paper_tasks)
    tasks_file.write_text(json.dumps(paper_tasks))
    out = tmp_path / "out"
    code, shown, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", out)
    )
    assert code == 0
    assert "1 of the suite's tasks set aside" in shown
    assert all(word in " ".join(text.split()) for word in words for text in (shown, err))
    assert len(list((out / "episodes").glob("*.json"))) == len(paper_tasks) - 1


@pytest.mark.parametrize("text", ["", "{", "no json", '{"a": 1}'])
def test_a_task_file_that_is_none(er_gym, tasks_file, text):
    tasks_file.write_text(text)
    code, shown, err = er_gym("bench", "--tasks-file", tasks_file, "--agent", "oracle")
    assert (code, shown) == (2, "")
    assert str(tasks_file) in one_line(err)


BAD_OPTIONS = {
    "agent": (["--agent", "nobody"], ["'nobody'", "oracle", "random"]),
    "backend": (["--backend", "unreal"], ["'unreal'", "embedded", "unity"]),
    "instances": (["--instances", "any"], ["'any'", "target", "explore"]),
    "both sources": (["--suite", "mini"], ["give --suite or --tasks-file, not both"]),
    "task": (["--task-ids", "paper-1,paper-99"], ["'paper-99'", "paper-0"]),
    "shard": (["--shard", "9/8"], ["'9/8'", "2/8"]),
    "limit": (["--limit", "0"], ["--limit", "er-gym bench --help"]),
    "workers": (["--workers", "none"], ["--workers", "er-gym bench --help"]),
    "scorer": (["--scorer", "kind"], ["'kind'", "corrected"]),
    "protocol": (["--protocol", "papers"], ["'papers'", "default", "paper"]),
    "the paper's instances": (
        ["--protocol", "paper", "--instances", "explore"],
        ["paper protocol", "leave out instances='explore'"],
    ),
    "poses": (["--poses", __file__], [Path(__file__).name, "not JSON"]),
    "option": (["--fast"], ["--fast", "er-gym bench --help"]),
}


@pytest.mark.parametrize(("options", "words"), BAD_OPTIONS.values(), ids=BAD_OPTIONS)
def test_a_bad_option(er_gym, tasks_file, tmp_path, options, words):
    out = tmp_path / "out"
    code, shown, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", out, *options)
    )
    assert (code, shown) == (2, "")
    assert all(word in one_line(err) for word in words)
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bench", "--agent", "oracle"], ["--suite", "mini"]),
        (["bench", "--suite", "huge", "--agent", "oracle"], ["'huge'", "mini"]),
        (["bench", "--suite", "mini"], ["--agent"]),
        (["bench", "--suite", "mini", "--agent", "oracle", "--poses", __file__], ["--poses"]),
        (["report"], ["RUN"]),
        (["report", "nowhere"], ["nowhere", "run.json"]),
        (["report", "nowhere", "--misses", "--format", "csv"], ["--misses", "json"]),
        (["report", "nowhere", "--format", "pdf"], ["'pdf'", "json"]),
        (["race"], ["'race'", "er-gym --help"]),
    ],
    ids=" ".join,
)
def test_a_bad_command(er_gym, arguments, words):
    code, shown, err = er_gym(*arguments)
    assert (code, shown) == (2, "")
    assert all(word in one_line(err) for word in words)


def test_the_directory_of_another_run_is_left_alone(er_gym, tasks_file, run_directory, episode):
    run_directory.write(episode(("end",), ("end",)))
    before = {path: path.read_bytes() for path in run_directory.path.rglob("*.json")}
    code, shown, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", run_directory.path)
    )
    assert (code, shown) == (2, "")
    assert "its suite is 'hand-made', this one's 'tasks' (further differences: " in one_line(err)
    assert "; choose another --out, or repeat that command" in one_line(err)
    assert {path: path.read_bytes() for path in run_directory.path.rglob("*.json")} == before


def test_a_directory_that_cannot_be_made(er_gym, tasks_file, tmp_path):
    (tmp_path / "file").touch()
    code, _, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle"),
        *("--out", tmp_path / "file" / "run"),
    )
    assert code == 2
    assert "file" in one_line(err)


# -- the small commands --------------------------------------------------------------------------


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from benchmarks.cli import main as cli\n"
        "try: cli.main(['bench', '--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'gymnasium', 'numpy', 'pydantic', 'rich', 'ai2thor', 'er_gym', 'agents'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = run_python(code)
    assert done.stderr == ""
    assert "--suite" in done.stdout


def test_help_is_shown_without_a_command(er_gym):
    code, out, err = er_gym()
    assert (code, err) == (0, "")
    assert all(name in out for name in ("bench", "report", "suites", "envs", "--version"))


def test_version(er_gym):
    from er_gym import __version__

    assert er_gym("--version") == (0, f"er-gym {__version__}\n", "")


def test_envs(er_gym):
    code, out, _ = er_gym("envs")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == [kind.env_id for kind in TASK_TYPES]


def test_suites(er_gym):
    code, out, _ = er_gym("suites")
    assert code == 0
    (line,) = [line for line in out.splitlines() if line.startswith("mini: ")]
    assert int(line.split()[1]) >= 100


# -- bench and report ----------------------------------------------------------------------------


def bench(tasks_file: Path, out: Path, *more: str) -> list[str]:
    options = ["--tasks-file", str(tasks_file), "--out", str(out), *more]
    return [*COMMAND, "bench", *options]


def test_bench_continues_and_report_reports(tasks_file, tmp_path, er_gym):
    out = tmp_path / "run"
    first = subprocess.run(
        bench(tasks_file, out, "--agent", "oracle", "--limit", "3", "--workers", "2"),
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    )
    assert first.returncode == 0, first.stderr
    assert "tasks, oracle: 3/3 episodes, 100.0 % success" in first.stderr
    assert ["oracle", "3/7", "100.00"] in [line.split()[:3] for line in first.stdout.splitlines()]
    before = episode_times(out)
    assert set(before) == {"paper-0.json", "paper-1.json", "paper-2.json"}

    code, shown, err = er_gym(
        "bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", out
    )
    assert code == 0
    assert "7/7 episodes" in err
    assert "oracle" in shown
    after = episode_times(out)
    assert len(after) == 7
    assert {name: after[name] for name in before} == before

    code, shown, _ = er_gym("report", out, "--format", "json")
    (run,) = json.loads(shown)["runs"]
    assert (run["episodes"], run["misses"], run["scorers_differ"]) == (7, [], [])
    assert run["manifest"]["env"] == {"backend": "embedded", "obs_mode": "text"}
    code, shown, _ = er_gym("report", out, "--format", "csv")
    assert [row["name"] for row in csv.DictReader(io.StringIO(shown))] == ["all", "Manipulate"]
    code, shown, _ = er_gym("report", out, "--format", "md", "--misses", "--by-type")
    row = "| oracle | 7 | 100.00 | 64.6 to 100.0 | 100.00 | 100.00 | 100.00 | - | 100.00 | - | - |"
    assert row in shown
    assert f"| oracle | {out} | 7 | 100.00 | 0.00 | 0.00 | 0.00 | 0.00 | 0.00 | 0.00 |" in shown
    assert f"**{out}: 0 of 7 episodes without success**" in shown
    code, shown, err = er_gym("report", out, "--misses", "--scorer", "paper")
    assert (code, err) == (0, "")
    assert "scorer paper" in shown


def test_a_run_is_played_and_continued_under_one_protocol(
    er_gym, tasks_file, tmp_path, monkeypatch
):
    out = tmp_path / "run"
    poses = tmp_path / "poses.json"
    pose = {
        "agent_teleport_position": {"x": 0.5, "y": 0.9, "z": 0.5},
        "agent_cameraHorizon": 30,
        "agent_isstanding": True,
        "agent_rotation": {"x": 0, "y": 270, "z": 0},
    }
    stated = {"scene": "FloorPlan1", "tasktype": "single_pickup", "taskname": "", COUNTER: pose}
    poses.write_text(json.dumps({"6": stated}))
    command = ("bench", "--tasks-file", tasks_file, "--poses", poses, "--agent", "oracle")
    where = ("--out", out, "--limit", "1")
    code, shown, err = er_gym(*command, *where, "--protocol", "paper")
    assert code == 0, err
    assert "protocol paper" in shown
    assert RunDirectory.open(out).manifest.env["protocol"] == "paper"
    (episode,) = RunDirectory.open(out).episodes()
    assert episode.success

    code, shown, err = er_gym(*command, *where)
    assert (code, shown) == (2, "")
    assert "holds another run: its protocol is 'paper', this one's 'default'" in one_line(err)

    played = []
    monkeypatch.setattr(
        runner, "run", lambda run_directory, tasks, make_agent, **_: played.extend(tasks) or NOTHING
    )
    for protocol, states in (("paper", True), ("default", False)):
        code, _, err = er_gym(
            *command, "--out", tmp_path / protocol, "--limit", "1", "--protocol", protocol
        )
        assert code == 0, err
        assert (COUNTER in played[-1].poses) is states  # task 0 has the pose of task 6


def start(command: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("signum", [signal.SIGKILL, signal.SIGINT], ids=["KILL", "INT"])
def test_an_ended_run_continues(tasks_file, tmp_path, signum):
    out = tmp_path / "run"
    # Ten times seven episodes, so that the run is under way for long after the first of them.
    command = bench(tasks_file, out, "--agent", "random", "--workers", "2", "--samples", "10")
    process = start(command)
    while not (out / "episodes").exists() or not episode_times(out):
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.02)
    if signum == signal.SIGINT:
        os.killpg(process.pid, signum)  # as the terminal does on Ctrl-C
    else:
        process.send_signal(signum)
    shown, err = process.communicate(timeout=30)
    before = episode_times(out)
    assert 1 <= len(before) < 70
    if signum == signal.SIGINT:
        assert process.returncode == 130
        assert shown == ""
        last = err.splitlines()[-1]
        assert last == (
            f"er-gym: interrupted: {len(before)} of 70 episodes are in {out}; "
            "the same command continues"
        )
        assert "Traceback" not in err

    again = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    after = episode_times(out)
    assert len(after) == 70
    assert {name: after[name] for name in before} == before
    assert not any(episode.error for episode in RunDirectory.open(out).episodes())


def test_crashes_give_exit_code_1(tasks_file, tmp_path, er_gym, monkeypatch, episode):
    crashed = episode(("end",), (), task_id="paper-2", error="ValueError: no")

    def run(run_directory, tasks, make_agent, **how):
        run_directory.write(crashed)
        return RunSummary(played=7, already_done=0, crashed=(crashed,))

    monkeypatch.setattr(runner, "run", run)
    out = tmp_path / "run"
    code, shown, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", out)
    )
    assert code == 1
    assert "1 of 1 episodes crashed and count as failures" in shown
    assert err.splitlines()[-1] == (
        "er-gym: 1 of 7 episodes crashed, the first of them paper-2: ValueError: no; "
        "the same command plays them again"
    )


def test_a_full_disk_is_reported_in_one_line(tasks_file, tmp_path, er_gym, monkeypatch):
    def run(run_directory, tasks, make_agent, **how):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(runner, "run", run)
    out = tmp_path / "run"
    code, shown, err = er_gym(
        *("bench", "--tasks-file", tasks_file, "--agent", "oracle", "--out", out)
    )
    assert (code, shown) == (2, "")
    assert "No space left on device; no episode was played, and nothing is left" in one_line(err)
    assert not out.exists()


# -- starts that come to nothing -------------------------------------------------------------------


class _NoSuchModel(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        body = b'{"error": {"message": "there is no model of that name"}}'
        self.send_response(404)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Says nothing."""


@pytest.fixture
def no_such_model():
    with ThreadingHTTPServer(("127.0.0.1", 0), _NoSuchModel) as server:
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/v1"
        server.shutdown()


def test_a_mistyped_model_or_url_leaves_nothing(er_gym, tmp_path, no_such_model, monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", "none")
    out = tmp_path / "run"
    ask = ("bench", "--suite", "mini", "--limit", "1", "--agent", "openai:m", "--out", out)
    quick = ("--agent-config", "text", "--set", "server.tries=1", "--concurrency", "1")
    code, shown, err = er_gym(*ask, *quick, "--base-url", no_such_model)
    assert (code, shown) == (3, ""), err
    assert "there is no model of that name" in err
    assert "nothing is left in" in err
    assert not out.exists()
    for url in ("nonsense", "ftp://x", "http://[::1", "http://x:99999/v1"):
        code, shown, err = er_gym(*ask, *quick, "--base-url", url)
        assert (code, shown) == (2, "")
        one_line(err)
        assert not out.exists()


@pytest.mark.parametrize("content", ["", "{", "[" * 100_000, "[1, 2]", None])
def test_conversations_that_are_none(er_gym, tmp_path, content):
    file = tmp_path / "kept.json"
    if content is None:
        os.mkfifo(file)  # is not waited for
    else:
        file.write_text(content)
    command = ("bench", "--suite", "mini", "--agent", f"recorded:{file}", "--out", tmp_path / "run")
    code, shown, err = er_gym(*command)
    assert (code, shown) == (2, "")
    assert "kept.json" in one_line(err)
    assert not (tmp_path / "run").exists()


def test_an_agent_that_exits_is_one_line(er_gym, tmp_path, monkeypatch):
    """Its constructor, or whatever else of it, ends no command in silence."""
    (tmp_path / "exits_today.py").write_text(
        "import sys\nclass Exits:\n    def __init__(self):\n        sys.exit(0)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    command = ("bench", "--suite", "mini", "--agent", "exits_today:Exits", "--out", tmp_path / "x")
    code, shown, err = er_gym(*command)
    assert (code, shown) == (2, "")
    assert "exits_today:Exits" in one_line(err)
    assert "SystemExit" in err


def test_names_that_are_not_utf8(er_gym):
    code, shown, err = er_gym("bench", "--suite", "mini", "--agent", "openai:\udc80")
    assert (code, shown) == (2, "")
    assert r"'openai:\udc80' is not UTF-8" in one_line(err)
