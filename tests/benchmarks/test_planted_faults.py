"""The faults that the check plants, and what comes of them in a checkout of three files."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from support import in_one_test

from benchmarks.checks.planted_faults import table
from benchmarks.checks.planting.faults import Fault, chosen, faults_of
from benchmarks.checks.planting.kinds import KINDS
from benchmarks.checks.planting.mirrors import EQUIVALENT
from benchmarks.checks.planting.reach import (
    Reach,
    failing_of,
    planted,
    reach_of,
    run_tests,
    scratch_copy,
)


def faults_in(folder: Path, source: str) -> list[Fault]:
    (folder / "made").mkdir(exist_ok=True)
    (folder / "made" / "thing.py").write_text(source, encoding="utf-8")
    return faults_of(folder, "made")


@in_one_test(
    "row",
    [  # a program; a kind; what takes the place of what
        ("a < b", "comparison", {"(a > b)"}),
        ("a == b", "comparison", {"(a != b)"}),
        ("a in b", "comparison", {"(a not in b)"}),
        ("a < b", "off by one", {"(a <= b)"}),
        ("a[2]", "off by one", {"3", "1"}),
        ("a[0]", "off by one", {"1"}),
        ("range(4)", "off by one", {"5", "3"}),
        ("c if a else b", "condition", {"(not (a))"}),
        ("a and b", "condition", {"a", "b"}),
        ("not a", "condition", {"a"}),
        ("[x for x in a if b]", "condition", {"True"}),
        ("a and b", "and/or", {"(a or b)"}),
        ("f(a, b, c)", "arguments", {"(f(b, a, c))", "(f(a, c, b))"}),
        ("f(a, a)", "arguments", set()),
        ("max(a, b)", "arguments", set()),
        ("for x in a:\n    f(x)", "early end", {"f(x)\n    break"}),
        ("def f():\n    g()\n    h()", "early end", {"return\n    h()"}),
        ("def f():\n    g()\n    return 1", "early end", set()),
        ("def f(a=1, b='', c=None, d=True): pass", "default", {"2", "'other'", "False"}),
        ("A = {'x': 2.0}", "default", {"4.0"}),
        ("a.get(b, 0)", "default", {"1"}),
        # what only says or checks something
        ("assert a < b", "comparison", set()),
        ("raise E(a < b)", "comparison", set()),
        ("f'{a < b}'", "comparison", set()),
        ("zip(a, b, strict=a < b)", "comparison", set()),
        ("def f(a: b < c): pass", "comparison", set()),
        ("def __repr__(self):\n    return a < b", "comparison", set()),
        ("log.info(a < b)", "comparison", set()),
    ],
)
def test_kinds(row: tuple[str, str, set[str]], tmp_path_factory: pytest.TempPathFactory) -> None:
    source, kind, expected = row
    found = faults_in(tmp_path_factory.mktemp("x"), source)
    assert {each.after for each in found if each.kind == kind} == expected


SOURCE = """
LIMIT = 3


def bounded(n):
    '''Not a < fault.'''
    if n > LIMIT:
        return LIMIT
    return n


def counted(n):
    while n < 0:
        n += 1
    return n


def idle(n):
    if n < 5:
        return 1
    return 2
"""
TESTS = """
from made.thing import bounded, counted

def test_bounded():
    assert [bounded(n) for n in (1, 5)] == [1, 3]

def test_counted():
    assert counted(-2) == 0
"""


def test_a_choice_is_seeded_of_every_kind_and_hardly_changes_with_the_code(tmp_path: Path) -> None:
    source = "\n".join(
        f"def f{n}(a, b=1):\n    if a < b and a[{n}]:\n        g(a, b)" for n in range(9)
    )
    found = faults_in(tmp_path, source)
    assert len({each.id for each in found}) == len(found)
    first = chosen(tmp_path, found, 14, 0)
    assert chosen(tmp_path, found, 14, 0) == first
    assert {each.kind for each in first} == {*KINDS}
    assert {each.id for each in chosen(tmp_path, found, 14, 1)} != {each.id for each in first}
    later = faults_in(tmp_path, f"X = f(a, b)\n\n\n{source}")
    kept = {each.id for each in chosen(tmp_path, later, 14, 0)} & {each.id for each in first}
    assert len(kept) >= 13


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "tests").mkdir()
    (folder / "tests" / "test_thing.py").write_text(TESTS, encoding="utf-8")
    (folder / "made").mkdir()
    (folder / "made" / "__init__.py").touch()
    (folder / "made" / "thing.py").write_text(SOURCE, encoding="utf-8")
    (folder / "ignored").touch()
    (folder / ".gitignore").write_text("ignored\n", encoding="utf-8")
    subprocess.run(["git", "init", "-q", folder], check=True)
    return folder


def test_faults_are_tried_in_a_copy_by_the_tests_that_run_them(checkout: Path) -> None:
    faults = {str(each).partition("  ")[2]: each for each in faults_of(checkout, "made")}

    def fault(where: str, after: str) -> Fault:
        (one,) = (each for each in faults.values() if (each.where, each.after) == (where, after))
        return one

    noticed, survivor = fault("def bounded ", "(n < LIMIT)"), fault("def bounded ", "(n >= LIMIT)")
    endless, idle = fault("def counted ", "2"), fault("def idle ", "(n > 5)")
    named = fault("", "4")
    with scratch_copy(checkout) as copy:
        assert not (copy / "ignored").exists()
        source = (copy / noticed.file).read_bytes()
        reach = reach_of(copy, "made", ["tests"], copy.parent / "kept")
        one, other = (f"tests/test_thing.py::test_{name}" for name in ("bounded", "counted"))
        assert [*reach.stages(noticed)] == [*reach.stages(survivor)] == [[one]]
        assert [*reach.stages(endless)] == [[other]]
        assert [*reach.stages(idle)] == []
        assert {*next(reach.stages(named))} == {one, other}  # any test may depend on a constant
        with planted(copy, fault("def counted ", "0")):
            assert run_tests(copy, [other], 0.5, "-x").late
        assert (copy / noticed.file).read_bytes() == source
        with planted(copy, noticed):
            assert failing_of(copy, [one, other]) == {one}
    assert not copy.exists()
    assert (checkout / noticed.file).read_text(encoding="utf-8") == SOURCE
    assert "-    if n > LIMIT:" in noticed.diff(source).splitlines()


def test_the_rest_of_a_file_is_tried_where_fixtures_ran_the_line() -> None:
    tests = {"a.py": {1: frozenset({"t.py::one|setup"}), 2: frozenset({"t.py::one|run", ""})}}
    reach = Reach(tests, {"t.py::one": 1.0, "t.py::two": 2.0, "u.py::three": 0.5})

    def at(line: int) -> Fault:
        return Fault("x-1", "a.py", "condition", "def f ", (line,), 0, 0, "", "", False)

    assert [*reach.stages(at(1))] == [["t.py::one"], ["t.py::two"]]
    assert [*reach.stages(at(2))] == [["t.py::one"], ["u.py::three", "t.py::two"]]
    assert [*reach.stages(at(3))] == []


def test_the_table_counts_by_package(tmp_path: Path) -> None:
    faults = faults_in(tmp_path, SOURCE)[:5]
    results = ("noticed", "by limit", "survived", "same", "no test")
    told = table({"made": faults}, dict(zip([each.id for each in faults], results, strict=True)))
    assert told[-2] == ("made", 5, 1, 1, 1, 1, 1, 0, "50 %")
    assert told[-1][-1] == "50 %"


def test_every_equivalent_fault_has_a_reason() -> None:
    assert all(len(reason.split()) > 3 for reason in EQUIVALENT.values())
