"""The command lines of servers as a table, and real processes in place of servers."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
import time
import urllib.request
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from agents.vlm.serving import ENGINES, Command, Machine, ServeOptions, command_for, inspect_machine
from benchmarks.cli import serve as cli_serve
from benchmarks.cli.serve import ENGINE_CHOICES, run_server, serve
from benchmarks.cli.server_process import LINES, ServerError, ServerProcess

ROOT = Path(__file__).resolve().parents[3]
EVERYTHING = frozenset().union(*(engine.needs for engine in ENGINES.values()))
BARE = Machine("py", EVERYTHING - {"vllm", "llama_cpp"}, gpus=0)
FULL = Machine("py", EVERYTHING, gpus=2)
QWEN = "Qwen/Qwen2.5-VL-7B-Instruct"

# -- the command ---------------------------------------------------------------------------------

COMMANDS = [
    (
        "GPUs and vLLM",
        QWEN,
        ServeOptions(8000),
        FULL,
        "py -m vllm.entrypoints.cli.main serve Qwen/Qwen2.5-VL-7B-Instruct --host 127.0.0.1 "
        "--port 8000 --served-model-name Qwen/Qwen2.5-VL-7B-Instruct --max-model-len 32768 "
        "--tensor-parallel-size 2 --enable-prefix-caching "
        """--limit-mm-per-prompt '{"image": 40, "video": 0}' """
        """--mm-processor-kwargs '{"min_pixels": 3136, "max_pixels": 351232}'""",
    ),
    (
        "all that can be wanted of vLLM",
        "runs/sft",
        ServeOptions(1, name="mine", pictures=9, context=4096, gpus=1, more=("--dtype", "half")),
        FULL,
        "py -m vllm.entrypoints.cli.main serve runs/sft --host 127.0.0.1 --port 1 "
        "--served-model-name mine --max-model-len 4096 --tensor-parallel-size 1 "
        "--enable-prefix-caching "
        """--limit-mm-per-prompt '{"image": 9, "video": 0}' """
        """--mm-processor-kwargs '{"min_pixels": 3136, "max_pixels": 351232}' --dtype half""",
    ),
    (
        "no GPU",
        QWEN,
        ServeOptions(8000),
        Machine("py", EVERYTHING, gpus=0),
        "py -m transformers.cli.transformers serve Qwen/Qwen2.5-VL-7B-Instruct --host 127.0.0.1 "
        "--port 8000",
    ),
    (
        "a GPU, but no vLLM",
        QWEN,
        ServeOptions(8000),
        Machine("py", EVERYTHING - {"vllm"}, gpus=1),
        "py -m transformers.cli.transformers serve Qwen/Qwen2.5-VL-7B-Instruct --host 127.0.0.1 "
        "--port 8000",
    ),
    (
        "a GGUF file, whatever there is",
        "models/gemma.Q4.gguf",
        ServeOptions(8001),
        FULL,
        "py -m llama_cpp.server --model models/gemma.Q4.gguf --model_alias gemma.Q4 "
        "--host 127.0.0.1 --port 8001 --n_ctx 8192 --n_gpu_layers -1 --logits_all false",
    ),
    (
        "a GGUF file on a processor",
        "gemma.GGUF",
        ServeOptions(8001, name="gemma", context=2048),
        Machine("py", EVERYTHING, gpus=0),
        "py -m llama_cpp.server --model gemma.GGUF --model_alias gemma --host 127.0.0.1 "
        "--port 8001 --n_ctx 2048 --n_gpu_layers 0 --logits_all false",
    ),
    (
        "GPUs that are not asked for",
        QWEN,
        ServeOptions(8000, gpus=0),
        FULL,
        "py -m transformers.cli.transformers serve Qwen/Qwen2.5-VL-7B-Instruct --host 127.0.0.1 "
        "--port 8000",
    ),
    (
        "an engine that is asked for",
        QWEN,
        ServeOptions(8000, engine="transformers"),
        FULL,
        "py -m transformers.cli.transformers serve Qwen/Qwen2.5-VL-7B-Instruct --host 127.0.0.1 "
        "--port 8000",
    ),
]


@pytest.mark.parametrize(
    ("model", "options", "machine", "argv"),
    [case[1:] for case in COMMANDS],
    ids=[case[0] for case in COMMANDS],
)
def test_command(model, options, machine, argv):
    assert command_for(model, options, machine).argv == tuple(shlex.split(argv))


def test_a_tuned_model_is_served_and_played_as_it_was_tuned():
    options = ServeOptions(1, pixels=(784, 50_000), agent_config="run/model/agent.yaml")
    command = command_for("run/merged", options, FULL)
    assert '{"min_pixels": 784, "max_pixels": 50000}' in command.argv
    assert command.bench_options == ("--agent-config", "run/model/agent.yaml")
    assert command_for("run/merged", options, BARE).bench_options == (
        "--agent-config", "run/model/agent.yaml", "--concurrency", "1",
    )  # fmt: skip


REFUSALS = [
    (QWEN, ServeOptions(1, engine="vllm"), BARE, ["vllm", "py -m pip install vllm"]),
    ("x.gguf", ServeOptions(1), BARE, ["lacks llama_cpp:", "'llama-cpp-python[server]'"]),
    (
        QWEN,
        ServeOptions(1),
        Machine("py", frozenset({"transformers", "torch", "openai"}), 0),
        ["lacks fastapi, uvicorn:", "'transformers[serving]"],
    ),
    (QWEN, ServeOptions(1, engine="ollama"), FULL, ["'ollama'", "vllm, transformers, llama_cpp"]),
    (QWEN, ServeOptions(1, name="mine"), BARE, ["the name 'mine'", "leave it out"]),
    (QWEN, ServeOptions(1, context=10), BARE, ["the context 10"]),
]


@pytest.mark.parametrize(("model", "options", "machine", "says"), REFUSALS)
def test_what_cannot_be_served_is_refused_in_a_line(model, options, machine, says):
    with pytest.raises(ValueError, match=r"^[^\n]+$") as refused:
        command_for(model, options, machine)
    for part in says:
        assert part in str(refused.value)


def test_where_and_as_what_a_model_is_served():
    command = command_for("models/gemma.Q4.gguf", ServeOptions(8001), FULL)
    assert command.name == "gemma.Q4"
    assert command.base_url == "http://127.0.0.1:8001/v1"
    assert command.ready_url == "http://127.0.0.1:8001/v1/models"
    assert command.environment == {"HOST": "127.0.0.1", "PORT": "8001"}
    assert command_for(QWEN, ServeOptions(1), FULL).name == QWEN
    assert command_for(QWEN, ServeOptions(1, name="q"), FULL).name == "q"


@pytest.mark.parametrize(
    ("model", "options", "bench_options"),
    [
        (QWEN, ServeOptions(1), ""),
        (QWEN, ServeOptions(1, engine="transformers"), "--concurrency 1"),
        ("x.gguf", ServeOptions(1), "--concurrency 1 --agent-config text"),
        ("x.gguf", ServeOptions(1, more=("--clip_model_path", "y.gguf")), "--concurrency 1"),
    ],
)
def test_how_to_play_with_it(model, options, bench_options):
    assert command_for(model, options, FULL).bench_options == tuple(bench_options.split())


def test_the_command_line_offers_the_engines_that_there_are():
    assert tuple(ENGINES) == ENGINE_CHOICES


# -- what the machine has ------------------------------------------------------------------------


def executable(path: Path, text: str) -> Path:
    path.write_text(f"#!{sys.executable}\n{text}")
    path.chmod(0o755)
    return path


def test_packages_are_those_of_the_python_that_is_named():
    found = inspect_machine(sys.executable, {"PATH": os.defpath})
    assert {"transformers", "torch"} <= found.packages <= EVERYTHING
    assert found.python == sys.executable


def test_something_else_than_a_python(tmp_path):
    with pytest.raises(ValueError, match="nothing/python does not run"):
        inspect_machine(str(tmp_path / "nothing/python"))


@pytest.mark.parametrize(
    ("visible", "count"), [(None, 3), ("0,2", 2), ("", 0), ("-1", 0), ("0,1,2,3", 3)]
)
def test_gpus_are_counted_less_those_hidden(tmp_path, visible, count):
    lines = "".join(f"GPU {n}: NVIDIA H100 (UUID: GPU-{n})\n" for n in range(3))
    executable(tmp_path / "nvidia-smi", f"print({lines.replace('GPU-', 'id-')!r})")
    environment = {"PATH": str(tmp_path)}
    if visible is not None:
        environment["CUDA_VISIBLE_DEVICES"] = visible
    assert inspect_machine(sys.executable, environment).gpus == count


def test_a_driver_that_fails_is_no_gpu(tmp_path):
    executable(tmp_path / "nvidia-smi", "raise SystemExit(9)")
    assert inspect_machine(sys.executable, {"PATH": str(tmp_path)}).gpus == 0


# -- processes -----------------------------------------------------------------------------------

STAND_IN = """
    import http.server, os, subprocess, sys, time
    if "helper" in sys.argv[3:]:
        helper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        print("helper", helper.pid, flush=True)
    print("pid", os.getpid(), flush=True)
    ready = time.monotonic() + float(sys.argv[2])

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200 if time.monotonic() > ready else 503)
            self.end_headers()
        def log_message(self, *args):
            print("asked", flush=True)

    http.server.HTTPServer(("127.0.0.1", int(sys.argv[1])), Handler).serve_forever()
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def stand_in(tmp_path):
    """A server's command: a script that answers at /health after some seconds."""

    def make(text: str = STAND_IN, seconds: float = 1.0, *more: str) -> Command:
        script = tmp_path / "server.py"
        script.write_text(textwrap.dedent(text))
        port = free_port()
        url = f"http://127.0.0.1:{port}"
        argv = (sys.executable, str(script), str(port), str(seconds), *more)
        said = {"SAID": "so"}
        options = ("--concurrency", "1")
        return Command("stand-in", argv, said, "a model", f"{url}/v1", f"{url}/health", options)

    return make


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"  # without an init that reaps, the dead stay listed


def wait_for(condition, seconds: float = 20.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.05)


def test_a_server_that_takes_a_while(stand_in):
    command = stand_in(STAND_IN, 1.0)
    told = []
    with ServerProcess(command.argv) as server:
        took = server.wait_until_ready(
            command.ready_url, 60, lambda since, line: told.append((since, line))
        )
        assert took >= 1.0
        assert told[0][0] < told[-1][0] <= took
        assert told[-1][1] == "asked"
        with urllib.request.urlopen(command.ready_url) as answer:
            assert answer.status == 200
        pid = int(next(line for line in server.last_lines if line.startswith("pid")).split()[1])
    assert not alive(pid)


def test_a_proxy_is_not_asked_about_this_machine(stand_in, monkeypatch):
    monkeypatch.setenv("http_proxy", f"http://127.0.0.1:{free_port()}")
    command = stand_in(STAND_IN, 0.0)
    with ServerProcess(command.argv) as server:
        assert server.wait_until_ready(command.ready_url, 60) >= 0


def test_a_server_that_dies_says_its_last_words(stand_in):
    command = stand_in(
        """
        import os, sys
        for n in range(50):
            print("line", n)
        print("half\\rdone", end="", flush=True)
        sys.exit("said " + os.environ["SAID"])
        """
    )
    with ServerProcess(command.argv, command.environment) as server:
        with pytest.raises(ServerError, match=r"ended before it was ready.* exit code 1$"):
            server.wait_until_ready(command.ready_url, 60)
        assert len(server.last_lines) == LINES
        assert server.last_lines[-4:] == ["line 48", "line 49", "half", "donesaid so"]


def test_a_server_that_a_signal_ends(stand_in):
    command = stand_in("import os; os.kill(os.getpid(), 9)")
    with (
        ServerProcess(command.argv) as server,
        pytest.raises(ServerError, match=r"exit code 137$"),
    ):
        server.wait_until_ready(command.ready_url, 60)


def test_a_server_that_cannot_be_run(tmp_path):
    with ServerProcess([str(tmp_path / "nothing")]) as server:
        with pytest.raises(ServerError, match=r"exit code 127$"):
            server.wait_until_ready("http://127.0.0.1:1/", 60)
        assert "nothing cannot be run" in server.last_lines[-1]


def test_a_server_that_is_never_ready_is_ended(stand_in):
    command = stand_in(STAND_IN, 600.0, "helper")
    with ServerProcess(command.argv) as server:

        def started() -> list[int]:
            return [int(line.split()[1]) for line in server.last_lines if line != "asked"]

        deadline = time.monotonic() + 60
        while len(started()) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        with pytest.raises(ServerError, match=r"not ready after 0\.5 s"):
            server.wait_until_ready(command.ready_url, 0.5)
        pids = started()
        assert len(pids) == 2
    assert not any(alive(pid) for pid in pids)


STUBBORN = """
    import os, signal, time
    signal.signal(signal.SIGTERM, lambda *_: print("no", flush=True))
    print("pid", os.getpid(), flush=True)
    while True:
        time.sleep(0.01)
"""


def test_a_server_that_does_not_heed_signals_is_killed(stand_in, tmp_path):
    # The time of grace is over once the server has answered, however busy the machine is. Until
    # then, the file is missing.
    answered = tmp_path / "answered"
    guard = f"""
import os, sys, time
from benchmarks.cli import process_guard as guard

real = time.sleep

def until_answered(_):
    while not os.path.exists({str(answered)!r}):
        real(0.01)

guard.time.sleep = until_answered
sys.exit(guard.main(sys.argv[1:]))
"""
    guarded = subprocess.Popen(
        [sys.executable, "-c", guard, *stand_in(STUBBORN).argv],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    with guarded:
        pid = int(guarded.stdout.readline().split()[1])
        guarded.stdin.close()
        assert guarded.stdout.readline() == "no\n"
        answered.touch()
        assert guarded.wait(60) == 128 + signal.SIGKILL
    assert not alive(pid)


# -- the command `er-gym serve` ------------------------------------------------------------------


def test_dry_run_only_says_what_it_would_do(tmp_path, monkeypatch):
    (tmp_path / "a b.gguf").touch()
    monkeypatch.setattr("agents.vlm.serving.inspect_machine", lambda python: FULL)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(
        serve, ["a b.gguf", "--port", "0", "--dry-run", "--", "--chat_format", "gemma"]
    )
    assert result.exit_code == 0, result.output
    words = shlex.split(result.output)
    port = words[words.index("--port") + 1]
    assert int(port) > 0
    assert words[:6] == [
        "HOST=127.0.0.1",
        f"PORT={port}",
        "py",
        "-m",
        "llama_cpp.server",
        "--model",
    ]
    assert words[6] == "a b.gguf"
    assert words[-2:] == ["--chat_format", "gemma"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nothing.gguf"], "nothing.gguf is not a file"),
        (["./nothing"], "./nothing does not exist"),
        (["x/y", "--python", "/nothing"], "/nothing does not run as a Python"),
        (["x/y", "--engine", "vllm", "--dry-run"], "vllm should serve x/y"),
    ],
)
def test_bad_input_is_one_line(arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(serve, [*arguments, "--port", "0"])
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_port_that_is_taken():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        result = CliRunner().invoke(serve, ["x/y", "--port", port])
    assert result.exit_code == 2
    assert f"port {port} of 127.0.0.1 cannot be used" in result.stderr
    assert "--port" in result.stderr


def test_failure_shows_what_the_server_said(stand_in, capfd):
    command = stand_in("print('no such model'); raise SystemExit(3)")
    with pytest.raises(click.ClickException, match=r"^stand-in: the server ended .* code 3$"):
        run_server(command, patience=60)
    assert "no such model\n" in capfd.readouterr().err
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_a_server_that_ends_after_it_was_ready(stand_in, capfd):
    command = stand_in(STAND_IN.replace("serve_forever", "handle_request"), 0.0)
    with pytest.raises(click.ClickException, match="ended by itself, with exit code 0"):
        run_server(command, patience=60)
    out, err = capfd.readouterr()
    assert out.splitlines()[0].endswith(command.base_url)
    assert out.splitlines()[1] == (
        f"er-gym bench --suite mini --agent 'openai:a model' --base-url {command.base_url} "
        "--concurrency 1"
    )
    assert "pid" in err


@pytest.fixture
def serving(stand_in):
    """``er-gym serve`` in a process, ready, with the pids of all that its server started."""
    command = stand_in(STAND_IN, 0.5, "helper")
    code = (
        "import signal, sys\n"
        # Background processes ignore Ctrl-C.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from agents.vlm.serving import Command\n"
        "from benchmarks.cli.serve import run_server\n"
        f"sys.exit(run_server({command!r}, patience=60, verbose=True))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    )
    with process:
        assert process.stdout.readline().startswith("ready after")
        lines = [process.stderr.readline().split() for _ in range(3)]
        pids = [int(line[1]) for line in lines if line[0] in ("pid", "helper")]
        assert len(pids) == 2
        assert all(map(alive, pids))
        yield process, pids
        process.kill()


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)]
)
def test_nothing_is_left_however_it_ends(serving, number, code):
    process, pids = serving
    process.send_signal(number)
    assert process.wait(60) == code
    if number != signal.SIGKILL:  # then the guard needs a moment more
        assert not any(map(alive, pids))
    wait_for(lambda: not any(map(alive, pids)))


def test_the_servers_last_line_is_its_progress(monkeypatch):
    class Server:
        def wait_until_ready(self, url, patience, hear):
            hear(1.0, "loading \x1b[1mweights")
            return 2.0

    told = []
    monkeypatch.setattr(cli_serve, "doing", lambda *said: told.append(said))
    address = "http://127.0.0.1:1"
    command = Command("vllm", ("vllm",), {}, "small", address, address)
    assert cli_serve._wait(Server(), command, 5.0, verbose=False) == 2.0
    (what, last), ended = told
    assert (what, last()) == ("starting vllm for small", r"loading \x1b[1mweights")
    assert ended == ("",)


# -- the command `er-gym match-server` -------------------------------------------------------------


def test_names_are_matched_over_http():
    code = (
        "from benchmarks.cli.serve import match_server\n"
        "match_server.main(['--port', '0', '--set', 'matching.fuzzy=100'], standalone_mode=False)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    with process:
        url = process.stdout.readline().strip()
        body = json.dumps({"names": ["the fridge", "Fridgge"]}).encode()
        with urllib.request.urlopen(f"{url}/match", body) as answer:
            matches = json.load(answer)["matches"]
        process.terminate()
    assert url.startswith("http://127.0.0.1:")
    assert [match["object_type"] for match in matches] == ["Fridge", ""]


def test_a_setting_that_there_is_not():
    result = CliRunner().invoke(cli_serve.match_server, ["--set", "matching.wit=1"])
    assert result.exit_code == 2
    assert "wit" in result.stderr


def test_the_run_of_an_adapter_is_merged_once_and_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch", reason="needs the extra local")
    pytest.importorskip("transformers", reason="needs the extra local")
    peft = pytest.importorskip("peft", reason="adapters need peft")
    from support import one_torch_thread
    from tiny_qwen import make_tiny_qwen
    from transformers import AutoModelForImageTextToText

    from agents.vlm.chat import Message
    from agents.vlm.clients.local import LocalClient
    from agents.vlm.clients.merging import merge
    from agents.vlm.settings import AgentSettings

    base = make_tiny_qwen(tmp_path / "base")
    run = tmp_path / "run"
    lora = peft.LoraConfig(
        r=4, target_modules=["q_proj", "v_proj"], init_lora_weights=False, task_type="CAUSAL_LM"
    )
    peft.get_peft_model(AutoModelForImageTextToText.from_pretrained(base), lora).save_pretrained(
        run / "model"
    )
    (run / "finetune.json").write_text("{}")
    (run / "model" / "agent.yaml").write_text("prompts: {dialect: paper}\nseed: 3\n")
    monkeypatch.setattr("agents.vlm.serving.inspect_machine", lambda python: FULL)
    shown = CliRunner().invoke(serve, [str(run), "--dry-run", "--port", "0"], standalone_mode=False)
    assert f" {run / 'merged'} " in shown.output, shown.exception
    assert not (run / "merged").exists()

    merged = merge(run / "model")
    assert merged == run / "merged"
    assert (merged / "agent.yaml").is_file()
    assert not list(merged.glob("adapter*"))
    talk = [Message("user", ("Look around.",))]
    settings = AgentSettings.model_validate(
        {"sampling": {"max_tokens": 12}, "local": {"dtype": "float32", "device_map": "cpu"}}
    )
    said = []
    with one_torch_thread():
        for path in (run, merged, base):
            client = LocalClient(str(path), settings)
            said.append(client.reply(talk, 0).text)
            client.close()
    assert said[0] == said[1] != said[2]

    before = (merged / "model.safetensors").stat().st_mtime_ns
    assert merge(run / "model") == merged
    assert (merged / "model.safetensors").stat().st_mtime_ns == before
    (run / "model" / "agent.yaml").write_text("prompts: {dialect: tags}\n")
    assert "tags" in (merge(run / "model") / "agent.yaml").read_text()
    (run / "merged" / "notes.txt").write_text("mine")
    (run / "model" / "agent.yaml").write_text("prompts: {dialect: paper}\n")
    with pytest.raises(ValueError, match=r"merged is not empty; .*would be lost: notes\.txt"):
        merge(run / "model")
    (run / "merged" / "merged_from.json").rename(run / "merged" / "stamp.json")
    with pytest.raises(ValueError, match=r"merged is not empty; .*would be lost: "):
        merge(run / "model")
    assert (run / "merged" / "notes.txt").read_text() == "mine"
    shutil.rmtree(run / "merged")
    (run / "model" / "adapter_model.safetensors").write_bytes(b"?")
    with pytest.raises(ValueError, match="cannot be merged into"):
        merge(run / "model")
    assert sorted(each.name for each in run.iterdir()) == ["finetune.json", "model"]
    assert merge(base) == base
