"""A step stands beside the picture that it was decided on."""

from __future__ import annotations

import re
import shutil

from agents.vlm.record import ConversationRecord, MessageRecord, PictureRecord, RoundRecord
from benchmarks.monitor.directories import Directories
from er_gym.rollout.run_directory import CONVERSATIONS, PICTURES, RunDirectory
from er_gym.writing import file_stem


def test_a_step_of_a_run_has_the_picture_that_it_was_decided_on(runs, tmp_path, visit):
    """Each picture's content names the step that it was shown for; one step got none."""
    folder = shutil.copytree(runs / "random", tmp_path / "run")
    run = RunDirectory.open(folder)
    record = next(each for each in run.episodes() if len(each.steps) > 5)
    (folder / PICTURES).mkdir()
    messages, rounds = [MessageRecord(role="system", parts=["You are the system prompt."])], []
    for number in range(1, len(record.steps)):
        path = f"{PICTURES}/{number}.jpg"
        (folder / path).write_bytes(b"step %d" % number)
        shown = [PictureRecord(path=path, digest="", width=4, height=3)] if number != 3 else []
        messages.append(MessageRecord(role="user", parts=[f"see for {number}", *shown]))
        messages.append(MessageRecord(role="assistant", parts=[f"said for step {number}"]))
        rounds.append(RoundRecord(message=len(messages) - 1))
    told = ConversationRecord(
        task_id=record.task_id, scene=record.scene, instruction=record.instruction,
        agent=record.agent, settings={"pictures": {"keep": 1}}, prompts="", prompts_digest="",
        messages=messages, rounds=rounds, prompt_tokens=0, completion_tokens=0, cost=0.0,
    )  # fmt: skip
    (folder / CONVERSATIONS).mkdir()
    file = folder / CONVERSATIONS / f"{file_stem(record.key)}.json"
    file.write_text(told.model_dump_json())

    client = visit(folder)
    address = f"/runs/{Directories([folder]).all()[0].id}"
    page = client.get(f"{address}/episode", params={"key": record.key}).text
    shown = re.findall(r'data-step="(\d+)" data-pictures="(\d+)" data-stand="(\d+)"', page)
    assert [int(step) for step, _, _ in shown] == list(range(len(record.steps)))
    for step, picture, stand in [tuple(map(int, each)) for each in shown]:
        got = client.get(f"{address}/picture", params={"key": record.key, "n": picture})
        expected = {0: 1, 3: 2}.get(step, step)  # nobody decided 0, and 3 on the same as 2
        assert got.content == b"step %d" % expected, step
        told = page.split(f'id="step-{step}"')[1].partition("</li>")[0]
        assert (f"said for step {step}" in told) == (step > 0)
        assert stand == max(step - 1, 0)

    # What was new in each request stands beside its step; the request itself leaves pictures out.
    assert "You are the system prompt." in page.split('id="step-1"')[1].partition("</li>")[0]
    request = client.get(f"{address}/request", params={"key": record.key, "n": 4}).text
    assert [text for n in range(1, 6) if (text := f"see for {n}") in request] == [
        "see for 1", "see for 2", "see for 3", "see for 4",
    ]  # fmt: skip
    assert request.count("You are the system prompt.") == 1
    assert request.count("[picture no longer shown]") == 1  # of 1; 2 is kept, 3 had none
    assert re.findall(r'src="([^"]+n=\d+)"', request) == [
        f"{address}/picture?key={record.key}&amp;n={n}" for n in (1, 2)
    ]
    for n in (0, len(record.steps)):
        assert client.get(f"{address}/request?key={record.key}&n={n}").status_code == 404
