"""The check that counts what houses promise: what it plays, and going on after a kill."""

from __future__ import annotations

from dataclasses import dataclass, field

from click.testing import CliRunner

from benchmarks.checks import houses
from er_gym.tasks.generate import generated_types
from er_gym.tasks.task import Task

KINDS = generated_types()


@dataclass
class Room:
    """Makes ten tasks of each type, or one of those that are rare."""

    rare: frozenset[str] = frozenset()

    def tasks(self, types=()):
        for kind in KINDS:
            if kind.name in types:
                for number in range(1 if kind.name in self.rare else 10):
                    yield Task(f"{kind.name}-{number}", kind, "House1-0", "", ())


@dataclass
class Verdicts:
    """Solves tasks but those of some types."""

    failing: frozenset[str] = frozenset()
    asked: list[str] = field(default_factory=list)

    def __call__(self, task):
        self.asked.append(task.id)
        self.solved = task.type.name not in self.failing
        return self


def test_all_tasks_are_played_or_enough_of_enough_types():
    verify = Verdicts()
    assert houses.tasks_done(Room(), verify, 6) == {kind.name: 6 for kind in KINDS}
    verify = Verdicts()
    done = houses.tasks_done(Room(), verify, 6, enough=30)
    assert done.total() == len(verify.asked) == 30
    assert len(done) == len(KINDS)
    verify = Verdicts(frozenset(kind.name for kind in KINDS[7:]))
    done = houses.tasks_done(Room(), verify, 6, enough=30)
    assert done == {kind.name: 6 for kind in KINDS[:7]}
    assert len(verify.asked) == 6 * len(KINDS)  # seven types are not enough
    first, *others = (kind.name for kind in KINDS)
    done = houses.tasks_done(Room(frozenset({first})), Verdicts(), 6)
    assert done == {first: 1} | dict.fromkeys(others, 6)  # a type that runs out ends no other


def test_houses_that_fall_short_are_named():
    types = {kind.name: 4 for kind in KINDS[: houses.TYPES]}
    every = {
        name: houses.House(name=name, rooms=1, seconds=0.1, played=0.1, done=done)
        for name, done in (
            ("enough", types),
            ("few", dict.fromkeys(types, 3)),
            ("of few types", {KINDS[0].name: 90}),
        )
    }
    every["not played"] = houses.House(name="not played", rooms=1, seconds=0.1)
    assert [line.split(":")[0] for line in houses._short(every, 30)] == ["few", "of few types"]


def test_the_same_command_goes_on_where_it_was_killed(tmp_path, monkeypatch):
    order = ["--each", "1", "--seed", "3", "--work", str(tmp_path / "work")]

    def run(*more: str) -> str:
        told = CliRunner().invoke(houses.main, [*order, *more])
        assert told.exit_code == 0, told.output
        return told.output

    first = run("--count", "2", "--played", "1")
    assert "| 1 | 1 |" in first
    file = tmp_path / "work" / "houses.jsonl"
    lines = file.read_text()
    file.write_text(lines + '{"name": "House3-5", "roo')  # a kill amid a line would leave this
    made = []
    count = houses.count_house
    monkeypatch.setattr(
        houses, "count_house", lambda *a: made.append((a[0], a[4] is None)) or count(*a)
    )
    run("--count", "3", "--played", "1")
    assert made == [(5, True)]
    run("--count", "3", "--played", "2")
    assert made[1:] == [(4, False)]
    told = CliRunner().invoke(houses.main, [*order, "--enough", "5"])
    assert told.exit_code != 0
    assert "another count of houses" in told.output
