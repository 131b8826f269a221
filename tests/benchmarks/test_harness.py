"""What the scripts for development share: counted tries, ways in turn, files, servers."""

from __future__ import annotations

import json
import socket
import time
import urllib.error
import urllib.request
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from benchmarks.harness.chat_server import (
    ChatServer,
    counts,
    drawn,
    error,
    key_actions,
    replies,
)
from benchmarks.harness.measuring import in_turns, per_second, timed
from benchmarks.harness.output import json_option, print_table, write_figures
from benchmarks.harness.processes import plain_environment, run
from benchmarks.harness.tally import Tally, end, has_words, tally
from er_gym.tasks.suites import load_suite

# -- tries -----------------------------------------------------------------------------------------


def test_each_problem_is_told_and_each_try_counted_once(capsys):
    tries = [("one", []), ("two", iter(["late", "loud"])), ("three", ["lost"])]
    done = tally("things", tries)
    assert capsys.readouterr().out == "two: late\ntwo: loud\nthree: lost\n"
    assert (done.tried, done.failed) == (3, 2)
    assert str(done).startswith("3 things in ")
    both = Tally("all", 1, 1, 2.0) + done
    assert (both.what, both.tried, both.failed) == ("all", 4, 3)


@pytest.mark.parametrize(("failed", "code"), [(0, 0), (2, 1)])
def test_a_failure_is_the_exit_code(failed, code):
    with pytest.raises(SystemExit) as ended:
        end(Tally("things", 3, failed))
    assert ended.value.code == code


def test_tries_are_chosen_by_all_words():
    assert has_words("a server that hangs", ["server", "hangs"])
    assert not has_words("a server that hangs", ["server", "lies"])


# -- measuring and printing ------------------------------------------------------------------------


def test_ways_take_turns_and_change_their_order():
    order = []
    found = in_turns({name: lambda name=name: order.append(name) or len(order) for name in "ab"}, 3)
    assert order == ["a", "b", "b", "a", "a", "b"]
    assert found == {"a": [1, 4, 5], "b": [2, 3, 6]}


def test_times_are_of_the_call():
    spent = timed(lambda: sum(range(200_000)))
    assert 0 < spent.processor < spent.clock + 0.05
    assert per_second(lambda: None, 0.01) > 100


def test_figures_go_into_a_table_and_into_a_file(tmp_path: Path, capsys):
    print_table("speeds", ("what", "steps/s"), [("ours [x]", 7)], notes=["of one core"])
    shown = capsys.readouterr().out
    assert all(words in shown for words in ("speeds", "ours [x]", "7", "of one core"))

    @click.command()
    @json_option
    def command(file: Path | None) -> None:
        write_figures(file, {"speed": 7})

    mine = tmp_path / "mine.json"
    assert CliRunner().invoke(command, ["--json", str(mine)]).exit_code == 0
    assert json.loads(mine.read_text()) == {"format": "er-gym/figures/1", "figures": {"speed": 7}}
    assert CliRunner().invoke(command, ["--json", str(mine)]).exit_code == 0  # its own file
    mine.write_text("My notes.")
    assert CliRunner().invoke(command, ["--json", str(mine)]).exit_code == 2
    assert CliRunner().invoke(command, []).exit_code == 0


def test_a_command_is_interrupted_once_it_has_said_what_is_waited_for(tmp_path: Path):
    script = "trap 'echo over; exit 7' INT; echo oops >&2; echo ready; while :; do sleep 0.1; done"
    done = run(["bash", "-c", script], cwd=tmp_path, terminal=False, until="ready")
    assert (done.code, done.late) == (7, False)
    assert done.text("out") == "ready\nover\n"
    assert done.text("err") == "oops\n"
    assert 0 < done.ending < 20
    late = run(["sleep", "30"], cwd=tmp_path, terminal=False, seconds=0.3)
    assert late.late
    idle = run(["sleep", "30"], cwd=tmp_path, terminal=False, idle=0.3)
    assert (idle.late, idle.code) == (True, -9)
    told = run(["env"], cwd=tmp_path, terminal=False, environment=plain_environment(MINE="1"))
    assert "MINE=1\n" in told.text("out")
    assert "COLUMNS=" not in told.text("out")


# -- the server ------------------------------------------------------------------------------------


def ask(url: str, *said: str) -> tuple[str, int]:
    """The server's words, and the tokens that it counts."""
    messages = [
        {"role": "assistant" if number % 2 else "user", "content": words}
        for number, words in enumerate(said)
    ]
    asked = json.dumps({"messages": messages}).encode()
    with urllib.request.urlopen(f"{url}/chat/completions", asked) as answer:
        told = json.load(answer)
    return told["choices"][0]["message"]["content"], told["usage"]["total_tokens"]


def test_a_server_replies_with_the_next_key_action_and_counts():
    task = load_suite("mini").tasks[0]
    first = f"{task.key_actions[0].verb} {task.key_actions[0].actual_type}"
    fault = replies(key_actions([task]), keep=True, tokens=counts(400, 20))
    with ChatServer(fault) as server:
        words, tokens = ask(server.url, task.instruction)
        assert f"<DecisionMaking>{first}</DecisionMaking>" in words
        assert tokens == 420
        words, _ = ask(server.url, task.instruction, *["", "again"] * 40)
        assert "<DecisionMaking>end</DecisionMaking>" in words
        assert (server.count, server.accepted, server.repeated) == (2, 2, 0)
        ask(server.url, task.instruction)
        assert server.repeated == 1


def test_faults_are_drawn_by_weight_and_seed():
    def courses(seed):
        codes = []
        fault = drawn({"good": (3, replies(lambda _: "fine")), "bad": (1, error(503))}, seed)
        with ChatServer(fault) as server:
            for _ in range(20):
                try:
                    ask(server.url, "hello")
                    codes.append(200)
                except urllib.error.HTTPError as refused:
                    codes.append(refused.code)
            assert server.drawn == {"good": codes.count(200), "bad": codes.count(503)}
        return codes

    assert courses(1) == courses(1)
    assert 0 < courses(1).count(503) < 12


def test_who_has_hung_up_gets_no_reply():
    with ChatServer(replies(lambda _: "too late", latency=0.5)) as server:
        host, port = server.url.removeprefix("http://").removesuffix("/v1").split(":")
        with socket.create_connection((host, int(port))) as client:
            body = b'{"messages": []}'
            client.sendall(b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n%s" % (len(body), body))
        while not server.count:
            time.sleep(0.01)
        time.sleep(1.0)
        assert (server.count, server.accepted, server.repeated) == (1, 0, 0)
        assert not server.answered
