"""An instruction as a vector: the same on every machine, or by a model."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support import NO_MODELS, run_python

from er_gym.envs.wrappers import make_encoder
from er_gym.tasks.suites import load_suite

hashed = make_encoder("hashed")


class Model:
    """Stands in for a SentenceTransformer: a vector of length 5, and notes what it is asked."""

    made: list[tuple[str, str]]
    encoded: list[str]

    def __init__(self, name: str, *, device: str) -> None:
        self.made.append((name, device))
        if "broken" in name:
            raise OSError("We couldn't connect to the hub.\nCheck your connection.")

    def encode(self, text: str, /, *, show_progress_bar: bool) -> np.ndarray:
        assert not show_progress_bar
        self.encoded.append(text)
        return np.array([3.0, -4.0, 0.0], dtype=np.float16)


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> type[Model]:
    """sentence-transformers with a stand-in for its models; give each test its own name."""
    Model.made, Model.encoded = [], []
    library = SimpleNamespace(SentenceTransformer=Model)
    monkeypatch.setitem(sys.modules, "sentence_transformers", library)  # type: ignore[arg-type]
    return Model


@pytest.fixture(scope="module")
def encoder(minilm: str) -> str:
    """The name of the encoder that all-MiniLM-L6-v2 makes."""
    return f"sentence-transformers:{minilm}"


def test_hashed_is_the_default_and_is_made_once() -> None:
    assert make_encoder() is hashed
    assert hashed.dimension == 64


def test_hashed_keeps_to_its_promise() -> None:
    instructions = {task.instruction for task in load_suite("mini").tasks}
    vectors = np.stack([hashed(text) for text in instructions])
    assert vectors.shape == (len(instructions), 64)
    assert vectors.dtype == np.float32
    assert np.abs(vectors).max() <= 1.0
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=1e-6)
    assert len(np.unique(vectors, axis=0)) == len(instructions)


@pytest.mark.parametrize(
    ("text", "where", "signs"),
    [
        ("find", [4], [1]),
        ("CD", [26], [-1]),
        ("Find the CreditCard", [4, 14, 19, 38, 48, 54, 62], [1, -1, -1, -1, -1, -1, -1]),
    ],
)
def test_hashed_is_the_same_on_every_machine(text: str, where: list[int], signs: list[int]) -> None:
    vector = hashed(text)
    assert np.flatnonzero(vector).tolist() == where
    # Seven features in seven buckets: each is worth the same.
    np.testing.assert_array_equal(vector[where], np.float32(signs / np.sqrt(len(where))))


def test_hashed_is_the_same_in_every_process() -> None:
    text = "Put the “Egg” in the Fridge — 找鸡蛋"
    code = (
        f"from er_gym.envs.wrappers import make_encoder; print(make_encoder()({text!r}).tobytes())"
    )
    said = [run_python(code, PYTHONHASHSEED=seed).stdout.strip() for seed in ("1", "2")]
    assert said == [str(hashed(text).tobytes())] * 2


@pytest.mark.parametrize("other", ["find THE credit card!", "  Find\nthe Credit-Card."])
def test_hashed_reads_words(other: str) -> None:
    np.testing.assert_array_equal(hashed("Find the CreditCard"), hashed(other))


def test_hashed_reads_their_order() -> None:
    assert (hashed("Book on Box, CD on Bed") != hashed("CD on Box, Book on Bed")).any()


def test_splits_a_name_behind_its_abbreviation() -> None:
    np.testing.assert_array_equal(hashed("TVStand"), hashed("tv stand"))


@pytest.mark.parametrize("text", ["", " ?! …", "\ud800"])
def test_a_text_without_words_is_nothing(text: str) -> None:
    np.testing.assert_array_equal(hashed(text), np.zeros(64, dtype=np.float32))


def test_an_encoding_is_the_callers_own() -> None:
    hashed("Find the Mug.")[:] = 7.0
    assert np.linalg.norm(hashed("Find the Mug.")) == pytest.approx(1.0)


def test_an_encoder_goes_to_another_process_by_name() -> None:
    assert pickle.loads(pickle.dumps(hashed)) is hashed


def test_a_model_is_loaded_once_on_the_cpu_and_remembers(
    model: type[Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/me")
    encoder = make_encoder("sentence-transformers:~/once")
    assert make_encoder("sentence-transformers:~/once") is encoder
    assert model.made == [("/home/me/once", "cpu")]
    assert encoder.dimension == 3
    for _ in range(3):
        vector = encoder("Take it.")
    assert model.encoded.count("Take it.") == 1
    assert vector.dtype == np.float32
    np.testing.assert_array_equal(vector, np.float32([0.6, -0.8, 0.0]))


@pytest.mark.parametrize("name", ["", "bow", "sentence-transformers:", "Hashed", None, 64, ["x"]])
def test_unknown_encoders(name: Any) -> None:
    with pytest.raises(ValueError, match=r"unknown encoder .*'hashed' or 'sentence-transformers:"):
        make_encoder(name)


def test_without_the_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sentence_transformers", None)  # type: ignore[arg-type]
    with pytest.raises(ImportError) as caught:
        make_encoder("sentence-transformers:absent")
    message = str(caught.value)
    assert "'sentence-transformers:absent'" in message
    assert "pip install 'er-gym[match]'" in message
    assert "'hashed' or 'sentence-transformers:NAME_OR_DIRECTORY'" in message
    assert "\n" not in message


def test_a_model_that_cannot_be_loaded(model: type[Model]) -> None:
    with pytest.raises(ValueError, match="a local directory that holds a model") as caught:
        make_encoder("sentence-transformers:broken")
    assert "(OSError: We couldn't connect to the hub.)" in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="cannot be loaded"):  # a failure is not remembered
        make_encoder("sentence-transformers:broken")
    assert len(model.made) == 2


def test_naming_encoders_imports_nothing_heavy() -> None:
    code = (
        "import sys, er_gym.envs.wrappers as w; w.make_encoder();"
        "print([m for m in ('sentence_transformers', 'torch', 'ai2thor') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_real_model_knows_what_words_mean(encoder: str) -> None:
    encoder = make_encoder(encoder)
    assert encoder.dimension == 384
    take, grasp, light = map(
        encoder, ("Pick up the mug.", "Please grab the cup.", "Switch on the floor lamp.")
    )
    assert take.dtype == np.float32
    assert take.shape == (384,)
    assert np.linalg.norm(take) == pytest.approx(1.0, abs=1e-6)
    assert take @ grasp > take @ light + 0.3
    assert pickle.loads(pickle.dumps(encoder)) is encoder


@pytest.mark.parametrize("make", NO_MODELS)
def test_a_real_directory_without_a_model(
    make: Callable[[Path], Path], tmp_path: Path, encoder: str
) -> None:
    where = make(tmp_path)
    with pytest.raises(ValueError, match=f"'sentence-transformers:{where}': .*local directory"):
        make_encoder(f"sentence-transformers:{where}")
