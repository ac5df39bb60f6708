"""The encoder that needs numpy alone gives the tokens and vectors of spaCy."""

import json
import random
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import spacy
from safetensors import safe_open
from safetensors.numpy import load_file, save_file
from spacy.language import Language
from spacy.strings import get_string_id
from thinc.api import NumpyOps

from sgm.text import TextVectors
from sgm.text.tok2vec import (
    ENCODER_FILE,
    METADATA,
    Tok2Vec,
    compute_shape,
    hash_rows,
    hash_string,
    load_tok2vec,
    scale_mean,
)
from sgm.text.vectors import SHIPPED_PIPELINE
from tools.text_training import __main__ as train
from tools.text_training.convert import TOLERANCE, convert

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def encoder() -> Tok2Vec:
    return load_tok2vec(SHIPPED_PIPELINE / ENCODER_FILE)


@pytest.fixture(scope="module")
def nlp() -> Language:
    return spacy.load(SHIPPED_PIPELINE)


def make_texts(nlp: Language, *, rng: random.Random, number: int) -> list[str]:
    """Draw phrases, special cases glued to words, ASCII, faces and any characters."""
    words = [word for group in train.load_taxonomy()["groups"] for word in group["words"]]
    pieces = [*nlp.tokenizer.rules, *words[::5], *"()[]{}<>:;,.!?'\"`-…/\\_*#&%$€@+=~^|é日🍵½²İΣ"]
    pieces += ["\u2019", "\u2013", "\u2019s"]  # quotation mark, dash
    pieces += ["n't", "5kg", "10:30", "1,000", "http://x.com/a?b=c", "foo@bar.com", "x", "number"]
    ascii_ = "abcdefghijklmnopqrstuvwxyz0123456789-'.,:;/()!?$%&*+ "
    ranges = [(32, 0x2FF), (0x300, 0xD7FF), (0xE000, 0x10FFFF)]
    kinds = [
        lambda: " ".join(rng.choices(words, k=rng.randint(1, 3))),
        lambda: "".join(piece + " " * rng.randint(0, 1) for piece in rng.choices(pieces, k=3)),
        lambda: "".join(rng.choices(ascii_, k=rng.randint(1, 14))),
        lambda: "".join(rng.choices("-:();'8odp_*=/^x.<>3 ", k=rng.randint(1, 9))),
        lambda: "".join(chr(rng.randint(*rng.choice(ranges))) for _ in range(rng.randint(1, 8))),
    ]
    labels = [kinds[i % len(kinds)]() for i in range(number)]
    texts = (" ".join(label.lower().replace("_", " ").split()) for label in labels)
    return [text for text in dict.fromkeys(texts) if text]


def check_equal(encoder: Tok2Vec, nlp: Language, texts: list[str]) -> None:
    for text, doc in zip(texts, nlp.pipe(texts), strict=True):
        tokens = [(token.text, token.norm) for token in encoder._tokenizer.split(text)]
        assert tokens == [(token.text, token.norm_) for token in doc], text
        difference = scale_mean(encoder.compute_tokens(text)) - scale_mean(doc.tensor)
        assert np.max(np.abs(difference)) <= TOLERANCE, text


def test_tokens_by_hand(encoder: Tok2Vec) -> None:
    def split(text: str) -> list[tuple[str, str]]:
        return [(token.text, token.norm) for token in encoder._tokenizer.split(text)]

    assert split("salt shaker") == [("salt", "salt"), ("shaker", "shaker")]
    assert split("mugs") == [("mug", "mug"), ("s", "s")]  # our own rule, docs/text.md
    assert split("don't") == [("do", "do"), ("n't", "not")]  # a special case
    assert split("(mug)") == [("(", "("), ("mug", "mug"), (")", ")")]  # prefix and suffix
    assert split("t-shirt") == [("t", "t"), ("-", "-"), ("shirt", "shirt")]  # infix
    assert split("http://a-b.com/c") == [("http://a-b.com/c",) * 2]  # no infix in an address
    assert split("5€") == [("5", "5"), ("€", "$")]  # a norm that is not the text
    assert split("mug (:") == [("mug", "mug"), ("(:", "(:")]
    # ":" and ")" are two suffixes, joined last; a space keeps them apart
    assert split("mug :) :)")[1:] == [(":)", ":)")] * 2
    assert split("mug : )")[1:] == [(":", ":"), (")", ")")]


def test_shape_by_hand() -> None:
    assert compute_shape("ab1") == "xxd"
    assert compute_shape("refrigerators-12345") == "xxxx-dddd"
    assert compute_shape("É.....") == "X...."
    assert compute_shape("a" * 99) == "xxxx"
    assert compute_shape("a" * 100) == "LONG"


def test_hashes_are_those_of_spacy_and_thinc() -> None:
    rng = np.random.default_rng(0)
    texts = ["", *("aé日🍵"[i % 4] * i for i in range(1, 40)), "salt shaker", "\0"]
    assert [hash_string(text) for text in texts] == [get_string_id(text) for text in texts]
    ids = rng.integers(0, 2**64, size=(50, 2), dtype=np.uint64)
    seeds, num_rows = np.array([8, 2**32 - 1], dtype=np.uint64), np.array([3000, 7], np.uint64)
    rows = hash_rows(ids, seeds, num_rows)
    for table, (seed, num) in enumerate(zip(seeds, num_rows, strict=True)):
        expected = NumpyOps().hash(np.ascontiguousarray(ids[:, table]), int(seed)) % num
        np.testing.assert_array_equal(rows[:, table], expected)


def test_odd_texts_equal_spacys(encoder: Tok2Vec, nlp: Language) -> None:
    texts = r"""mug|mugs|glasses|don't|can't've|o'clock|it's|'s|n't|a.m.|10am|u.s.|t-shirt|--|...
    |…|“tea”|5kg|3.5|1,000|10:30|$5|€5|us$|c++|c#|and/or|mug/cup|(mug)|((((|))))|:)|mug:)|: )|:-) ;)
    |:))|(:|:) )|http://x.com/a-b|foo@bar.com|www.a.de|0.0|é|ß|ς|日本語|カップ|чашка|كوب|👩‍🍳|🍵🍵|½|x²
    |ǆ|number|agent|root|x|\\|\|"|""".split("|")
    texts += ["\u017f", "\u200b", "a\u0301", "\ufb01", "\ufeffmug", "\u00admug", "\x00", "\x7f"]
    texts += ["\U0001d400\U0001d401", "it\u2019s", "a\u2013b", "\u2019"]
    texts = [" ".join(text.split()) for text in texts]
    texts += ["a" * 99, "a" * 100, "b" * 3000, "9" * 200, "mug " * 50 + "mug", "." * 60]
    check_equal(encoder, nlp, [text for text in texts if text])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_random_texts_equal_spacys(encoder: Tok2Vec, nlp: Language, seed: int) -> None:
    check_equal(encoder, nlp, make_texts(nlp, rng=random.Random(seed), number=4000))


@pytest.mark.slow
def test_a_new_vector_is_the_same_to_the_bit_in_any_batch(encoder: Tok2Vec, nlp: Language) -> None:
    texts = make_texts(nlp, rng=random.Random(3), number=200)
    together = np.stack(list(encoder.encode(texts)))
    alone = np.concatenate([TextVectors().vectors([text]) for text in texts[:20]])
    np.testing.assert_array_equal(together[:20], alone)
    backwards = np.stack(list(encoder.encode(texts[::-1])))[::-1]
    np.testing.assert_array_equal(together, backwards)


@pytest.mark.slow
def test_known_words_have_the_vectors_of_spacy(encoder: Tok2Vec, nlp: Language) -> None:
    """Those in the file, and what would be computed for them."""
    words = train.list_words()
    stored = np.stack(list(encoder.encode(words)))
    computed = np.stack([scale_mean(encoder.compute_tokens(word)) for word in words])
    theirs = np.stack([scale_mean(doc.tensor) for doc in nlp.pipe(words)])
    np.testing.assert_allclose(stored, theirs, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(stored, computed, rtol=0, atol=TOLERANCE)
    assert np.any(stored != computed)  # so they were not computed


def read_about(path: Path) -> dict[str, Any]:
    with safe_open(path, framework="np") as file:
        return json.loads(file.metadata()[METADATA])


@pytest.mark.slow
def test_shipped_file_is_what_the_command_makes(nlp: Language, tmp_path: Path) -> None:
    again = tmp_path / ENCODER_FILE
    again.write_bytes(convert(nlp, train.list_words()))
    assert again.read_bytes() == convert(nlp, train.list_words())
    about = [read_about(path) for path in (SHIPPED_PIPELINE / ENCODER_FILE, again)]
    symbols = [found.pop("symbols") for found in about]
    assert symbols[0].items() <= symbols[1].items()  # a later spaCy may know more of them
    assert about[0] == about[1]
    shipped, made = load_file(SHIPPED_PIPELINE / ENCODER_FILE), load_file(again)
    assert shipped.keys() == made.keys()
    vectors = shipped.pop("vectors"), made.pop("vectors")
    np.testing.assert_allclose(*vectors, rtol=0, atol=TOLERANCE)  # of two processors, perhaps
    for name, array in shipped.items():
        np.testing.assert_array_equal(array, made[name], err_msg=name)


def test_pipeline_that_computes_otherwise_is_not_converted() -> None:
    other = spacy.load(SHIPPED_PIPELINE)
    other.tokenizer.infix_finditer = re.compile("u").finditer
    assert convert(other, ["mug"])  # its rules are in the file
    model = other.get_pipe("tok2vec").model
    model.get_ref("encode").attrs["pad"] = 0  # texts of a batch see each other
    with pytest.raises(ValueError, match=r"spaCy's to 1e-05, got .* for 'mug'.*training alone"):
        convert(other, ["mug", "cup"])
    other.tokenizer.token_match = re.compile("mug").match
    with pytest.raises(ValueError, match="no token_match"):
        convert(other, ["mug"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"layer.3.bias": None}, "layer.3.bias"),
        ({"layer.0.weights": np.zeros((1, 288), np.float32)}, r"float32 \(1, 288\) where layer.0"),
        ({"table.shape": np.zeros((0, 96), np.float32)}, r"float32 \(0, 96\) where table.shape"),
        ({"vectors": np.zeros((3, 96), np.float32)}, r"float32 \(3, 96\) where vectors"),
        ({"layer.1.scale": np.zeros(96)}, "float64"),
    ],
)
def test_file_of_other_arrays_is_refused(tmp_path: Path, change: dict, message: str) -> None:
    source = SHIPPED_PIPELINE / ENCODER_FILE
    metadata = {METADATA: json.dumps(read_about(source))}
    arrays = {k: v for k, v in (load_file(source) | change).items() if v is not None}
    save_file(arrays, tmp_path / ENCODER_FILE, metadata)
    with pytest.raises(ValueError, match=f"whole file.*{message}.*--convert_only"):
        TextVectors(tmp_path)


def test_damaged_file_is_refused(tmp_path: Path) -> None:
    content = (SHIPPED_PIPELINE / ENCODER_FILE).read_bytes()
    for damaged in (content[:1000], content[:-1], b"", content.replace(b"words", b"Words", 1)):
        (tmp_path / ENCODER_FILE).write_bytes(damaged)
        with pytest.raises(ValueError, match=r"text encoder must be a whole file.*--convert_only"):
            TextVectors(tmp_path)
    save_file({}, tmp_path / ENCODER_FILE)
    with pytest.raises(ValueError, match=r"text encoder must be a whole file.*--convert_only"):
        TextVectors(tmp_path)


def test_only_other_pipelines_need_spacy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "spacy", None)  # as if it was not installed
    assert TextVectors().vectors(["a new word"]).shape == (1, 96)
    (tmp_path / "config.cfg").touch()
    for pipeline in ("en_core_web_sm", tmp_path):
        with pytest.raises(ModuleNotFoundError, match=r"package spacy .*pip install"):
            TextVectors(pipeline)


@pytest.mark.slow
def test_a_question_to_the_finder_loads_no_spacy() -> None:
    script = """
import sys
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian
from sgm.finder.finder import Finder
memory = SceneGraphMemory()
desk = memory.add_furniture("standing desk", room=memory.add_room("study"))
shelf = memory.add_furniture("wall shelf", room=0)
memory.observe(desk, seen=[Sighting("large red mug")])
memory.step()
print(Finder(Bayesian()).rank(memory, "tankard"))
import sgm.text
sgm.text.load_text().vectors(["tankard"])
assert not {"spacy", "thinc", "srsly", "murmurhash"} & set(sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
