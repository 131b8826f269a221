"""Names that models write, as object types."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from support import NO_MODELS, in_one_test

from agents.vlm import matching
from agents.vlm.matching import Match, Matcher
from agents.vlm.settings import Matching
from er_gym.data.names_en import NAMES_EN
from er_gym.data.names_zh import NAMES_ZH
from er_gym.data.shared_names import SHARED_EN, SHARED_ZH
from er_gym.thor import OBJECT_TYPES

pytest.importorskip("rapidfuzz", reason="needs RapidFuzz: pip install 'er-gym[vlm]'")

MATCHER = Matcher(Matching())
TABLES = pytest.mark.parametrize(
    ("names", "shared"), [(NAMES_EN, SHARED_EN), (NAMES_ZH, SHARED_ZH)], ids=["en", "zh"]
)


def key(name: str) -> str:
    return name.lower().replace(" ", "")


# -- the tables ------------------------------------------------------------------------------------


@TABLES
def test_names_stand_for_types_that_exist(
    names: dict[str, tuple[str, ...]], shared: dict[str, tuple[str, ...]]
) -> None:
    assert {*names} <= {*OBJECT_TYPES}
    assert all(len(types) > 1 and {*types} <= {*OBJECT_TYPES} for types in shared.values())


def test_every_type_has_a_chinese_name() -> None:
    assert list(NAMES_ZH) == list(OBJECT_TYPES)


@TABLES
def test_a_name_is_in_one_place_only(
    names: dict[str, tuple[str, ...]], shared: dict[str, tuple[str, ...]]
) -> None:
    assert not any(isinstance(others, str) or "" in others for others in names.values())
    keys = [key(name) for others in (*names.values(), shared, OBJECT_TYPES) for name in others]
    assert len({*keys}) == len(keys)


@TABLES
def test_every_name_is_found(
    names: dict[str, tuple[str, ...]], shared: dict[str, tuple[str, ...]]
) -> None:
    for object_type, others in names.items():
        for name in others:
            assert MATCHER.match(name) == Match(name, object_type, "alias", 1.0)
    for name, types in shared.items():
        assert MATCHER.match(name).object_type == types[0]
        for each in types:
            assert MATCHER.match(name, prefer=(each,)).object_type == each


# -- looked up -------------------------------------------------------------------------------------


@in_one_test("name", OBJECT_TYPES)
def test_types_by_their_own_names(name: str) -> None:
    words = "".join(f" {letter}" if letter.isupper() else letter for letter in name).strip()
    if name not in ("CD", "TVStand"):
        assert MATCHER.match(words).object_type == name
    for written in (
        name, name.lower(), name.upper(), f" {name}\n", words.replace(" ", "_"), f"the {name}",
        words.replace(" ", "-"), f"{name}_1", f"{name} 2", f"{name} #3", f"{name}12",
        f"{name}|+00.97|-00.10|+01.25", f"{name}s", f"two {name}s", f"a dirty {name}",
    ):  # fmt: skip
        if name in ("CD", "TVStand") and written.startswith(("C ", "C_", "C-", "T ", "T_", "T-")):
            continue
        match = MATCHER.match(written)
        assert (match.object_type, match.how, match.score) == (name, "exact", 1.0), written


@pytest.mark.parametrize(
    ("name", "object_type", "how"),
    [
        ("credit card", "CreditCard", "exact"),
        ("knives", "Knife", "exact"),
        ("shelves", "Shelf", "exact"),
        ("Tomatoes", "Tomato", "exact"),
        ("boxes", "Box", "exact"),
        ("tv stand", "TVStand", "exact"),
        ("cds", "CD", "exact"),
        ("ｆｒｉｄｇｅ", "Fridge", "exact"),
        ("Sink|-00.60|+00.90|+00.50|SinkBasin", "SinkBasin", "exact"),
        ("Apple|-00.47|+01.15|+00.48|AppleSliced_0", "AppleSliced", "exact"),
        ("the second red wooden Chair", "Chair", "exact"),
        ("bowl of fruit", "Bowl", "exact"),
        ("refrigerator", "Fridge", "alias"),
        ("Couches", "Sofa", "alias"),
        ("TV", "Television", "alias"),
        ("TV remote", "RemoteControl", "alias"),
        ("mobile phone", "CellPhone", "alias"),
        ("trash cans", "GarbageCan", "alias"),
        ("kitchen counter", "CounterTop", "alias"),
        ("cupboard", "Cabinet", "alias"),
        ("stove", "StoveBurner", "alias"),
        ("tap", "Faucet", "alias"),
        ("slice of bread", "BreadSliced", "alias"),
        ("potato slices", "PotatoSliced", "alias"),
        ("glass of water", "Cup", "alias"),
        ("冰箱", "Fridge", "alias"),
        ("红色的苹果", "Apple", "alias"),
        ("厨房的水龙头", "Faucet", "alias"),
    ],
)
def test_looked_up(name: str, object_type: str, how: str) -> None:
    match = MATCHER.match(name)
    assert (match.object_type, match.how) == (object_type, how)


def test_a_type_within_reach_is_preferred() -> None:
    assert MATCHER.match("table").object_type == "DiningTable"
    assert MATCHER.match("table", prefer={"Mug", "CoffeeTable"}).object_type == "CoffeeTable"
    assert MATCHER.match("tables", prefer=["SideTable", "CoffeeTable"]).object_type == "CoffeeTable"
    assert MATCHER.match("table", prefer=["Desk"]).object_type == "DiningTable"
    assert MATCHER.match("Sink", prefer=["SinkBasin"]).object_type == "Sink"
    assert MATCHER.match("couch", prefer=["Chair"]).object_type == "Sofa"


# -- compared by letters ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "object_type"),
    [
        ("Frige", "Fridge"),
        ("Fridgee", "Fridge"),
        ("Microwav", "Microwave"),
        ("Conter Top", "CounterTop"),
        ("Televison", "Television"),
        ("the refridgerator", "Fridge"),
        ("Coffe Machine 2", "CoffeeMachine"),
        ("credit crad", "CreditCard"),
        ("Dinning tables", "DiningTable"),
    ],
)
def test_misspelt(name: str, object_type: str) -> None:
    match = MATCHER.match(name)
    assert (match.object_type, match.how) == (object_type, "fuzzy")
    assert 0.86 <= match.score < 1


@pytest.mark.parametrize(
    "name",
    ["Pin", "Pam", "Cap", "Clot", "Pat", "Bot", "Bad", "Dusk", "Eggg", "Mag", "Cut", "Sinc",
     "Chain", "baseball", "roaster", "coaster", "handle", "pantry", "stool pigeon", "car",
     "door", "wall", "dishwasher", "桌", "我", "x" * 10_000],
)  # fmt: skip
def test_near_is_not_near_enough(name: str) -> None:
    match = MATCHER.match(name)
    assert (match.object_type, match.how, match.score) == ("", "none", 0.0)


def test_no_name_is_taken_for_a_misspelling_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {name: (name,) for name in OBJECT_TYPES}
    names |= {name: (kind,) for kind, others in NAMES_EN.items() for name in others}
    names.update(SHARED_EN)
    keys = matching._MISSPELLABLE
    for name, types in names.items():
        own = {key(other) for other, theirs in names.items() if {*theirs} & {*types}}
        monkeypatch.setattr(matching, "_MISSPELLABLE", [each for each in keys if each not in own])
        assert matching._fuzzy_match(key(name), 86.0, ()) == ("", 0.0), name


def test_the_threshold_is_the_settings() -> None:
    assert Matcher(Matching(fuzzy=92)).match("Frige").how == "none"
    assert Matcher(Matching(fuzzy=80)).match("Candel").object_type == "Candle"


def test_of_two_that_are_as_near_the_one_at_hand_is_meant() -> None:
    lenient = Matcher(Matching(fuzzy=80))
    assert lenient.match("xomatosliced").object_type == "TomatoSliced"
    name = "garbageban"  # as near to GarbageBag as to GarbageCan
    assert lenient.match(name).object_type == ""
    assert lenient.match(name, prefer=["GarbageBag"]).object_type == "GarbageBag"
    assert lenient.match(name, prefer=["GarbageCan"]).object_type == "GarbageCan"


def test_an_unknown_name_lists_the_nearest_types() -> None:
    match = MATCHER.match("tosater")
    assert match.near[0] == "Toaster"
    assert len({*match.near}) == 3
    a, b, c = match.near
    assert match.problem == (
        f"There is no object type 'tosater'; the nearest are {a}, {b} and {c}."
    )
    assert MATCHER.match("toaster").problem == ""
    assert MATCHER.match("toaster").near == ()


def test_problems_are_short_and_of_one_line() -> None:
    problem = MATCHER.match("blue\nelephant " * 1000).problem
    assert len(problem) < 200
    assert "\n" not in problem
    assert MATCHER.match("").problem == "There is no object type ''."
    assert MATCHER.match(" ?! ").problem == "There is no object type '?!'."


def test_many_at_once_and_twice_the_same() -> None:
    names = ["table", "Frige", "spaceship", "table", ""]
    assert MATCHER.match_many(names, ["SideTable"]) == [
        MATCHER.match(name, ["SideTable"]) for name in names
    ]
    assert MATCHER.match_many([]) == []


def test_never_raises() -> None:
    chance = random.Random(3)
    pieces = [
        "Fridge",
        "|",
        "+0.1",
        "_",
        " ",
        "1",
        "of",
        "的",
        "the",
        "s",
        "\ud800",
        "\x00",
        "ﷺ",
        "-",
    ]
    for _ in range(500):
        name = "".join(chance.choice(pieces) for _ in range(chance.randrange(9)))
        match = MATCHER.match(name)
        assert bool(match.object_type) != bool(match.problem)


def test_without_rapidfuzz_it_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['rapidfuzz'] = None\n"
        "from agents.vlm.matching import Matcher\n"
        "from agents.vlm.settings import Matching\n"
        "print(Matcher(Matching()).match('couch').object_type)\n"
        "print([name for name in ('torch', 'sentence_transformers') if name in sys.modules])\n"
        "try: Matcher(Matching()).prepare()\n"
        "except ValueError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
    )
    sofa, heavy, message = done.stdout.splitlines()
    assert (sofa, heavy) == ("Sofa", "[]")
    assert message.endswith("pip install 'er-gym[vlm]'")


# -- compared by meaning ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def by_meaning(minilm: str) -> Matcher:
    return Matcher(Matching(embeddings=minilm, threshold=0.6))


def test_meaning(by_meaning: Matcher) -> None:
    names = ["big comfy couch", "place to sleep", "pooch bed", "study lamp", "hovercraft", "Frige"]
    found = by_meaning.match_many(names)
    assert [(match.object_type, match.how) for match in found] == [
        ("Sofa", "meaning"), ("Bed", "meaning"), ("DogBed", "meaning"), ("DeskLamp", "meaning"),
        ("", "none"), ("Fridge", "fuzzy"),
    ]  # fmt: skip
    assert all(0.6 <= match.score < 1 for match in found[:4])
    assert len(found[4].near) == 3
    assert by_meaning.match("").how == "none"
    assert by_meaning.match("refrigerator").how == "alias"


def test_its_threshold_is_the_settings(by_meaning: Matcher, minilm: str) -> None:
    score = by_meaning.match("place to sleep").score
    stricter = Matcher(Matching(embeddings=minilm, threshold=score + 0.01))
    match = stricter.match("place to sleep")
    assert (match.object_type, match.near[0]) == ("", "Bed")


def test_meaning_of_what_several_types_are_called(by_meaning: Matcher) -> None:
    name = "paper sheet"
    assert by_meaning.match(name).object_type == SHARED_EN["paper"][0]
    assert by_meaning.match(name, prefer=["Newspaper"]).object_type == "Newspaper"


def test_the_same_from_many_threads_and_in_whatever_company(by_meaning: Matcher) -> None:
    names = [f"{word} for the {room}" for word in ("seat", "light", "rest", "art") for room in
             ("lounge", "hall", "attic", "cellar", "garden", "porch")]  # fmt: skip
    together = by_meaning.match_many(names)
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(by_meaning.match, names * 4)) == together * 4
    by_meaning._embeddings._vectors.clear()  # type: ignore[union-attr]
    assert [by_meaning.match(name) for name in reversed(names)] == together[::-1]


@pytest.mark.parametrize("make", NO_MODELS)
def test_a_model_that_cannot_be_loaded(
    make: Callable[[Path], Path], tmp_path: Path, minilm: str
) -> None:
    where = str(make(tmp_path))
    matcher = Matcher(Matching(embeddings=where))
    assert matcher.match("couch").object_type == "Sofa"  # it is not needed yet
    for ask in (matcher.prepare, lambda: matcher.match("hovercraft")):
        with pytest.raises(ValueError, match="cannot be loaded") as caught:
            ask()
        assert f"matching.embeddings '{where}'" in str(caught.value)
        assert "\n" not in str(caught.value)


def test_without_the_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sentence_transformers", None)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"'some/model' needs .*pip install 'er-gym\[match\]'"):
        Matcher(Matching(embeddings="some/model")).prepare()
