"""Text vectors: what is near what, the contract of `TextVectors`, and the training script."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import spacy

from sgm.prior.prior_graph import PriorGraph
from sgm.text import TextVectors
from sgm.text.tok2vec import ENCODER_FILE
from sgm.text.vectors import SHIPPED_PIPELINE, SpacyEncoder, load_language
from tools.text_training import __main__ as train


@pytest.fixture(scope="module")
def text() -> TextVectors:
    return TextVectors()


@pytest.fixture(scope="module")
def labels() -> list[str]:
    prior = PriorGraph.default()
    types = [*prior.furniture, *prior.objects]
    return list(dict.fromkeys(["house", "floor", *prior.rooms, *(t.label for t in types)]))


TINY_TAXONOMY = {
    "modifiers": ["large", "red"],
    "groups": [
        {
            "name": name,
            "kinds": [kind],
            "rooms": [room],
            "places": [],
            "uses": [],
            "materials": [],
            "words": words,
        }
        for name, kind, room, words in [
            ("vessel", "kitchenware", "kitchen", ["cup", "mug", "glass"]),
            ("cutlery", "kitchenware", "kitchen", ["fork", "spoon"]),
            ("bedding", "textile", "bedroom", ["pillow", "blanket"]),
        ]
    ],
}
SETTINGS = {"epochs": 3, "batch_size": 8, "learning_rate": 5e-3, "seed": 1}


def copy_for_spacy(folder: Path) -> Path:
    """Copy the shipped pipeline without the file that is read instead of it."""
    ignored = shutil.ignore_patterns(ENCODER_FILE)
    return Path(shutil.copytree(SHIPPED_PIPELINE, folder / "pipeline", ignore=ignored))


def test_mug_is_nearer_to_cup_than_to_bed(text: TextVectors) -> None:
    _, cup, bed = text.cosines(["mug", "cup", "bed"])[0]
    assert cup > 0.8
    assert bed < 0.3


@pytest.mark.parametrize(
    ("kind", "at_least"),
    [
        ("known", 0.98),
        ("unseen compound", 0.9),
        ("unseen closed compound", 0.8),
        ("unseen plural", 0.9),
        ("fresh compound", 0.9),
        ("fresh closed compound", 0.8),
        ("fresh plural", 0.9),
        # Words without a known part ("tankard") are near chance: docs/text.md has the figures.
    ],
)
def test_share_of_triples_that_hold(text: TextVectors, kind: str, at_least: float) -> None:
    assert train.compute_accuracy(text)[kind] >= at_least


def test_unseen_words_are_in_no_training_text() -> None:
    evaluation = train.load_evaluation()
    taxonomy = train.load_taxonomy()
    unseen = {a for kind, rows in evaluation.items() if kind != "known" for a, _, _ in rows}
    words = {word for group in taxonomy["groups"] for word in group["words"]}
    phrases = set(train.compute_features(taxonomy["groups"], unseen)[0])
    tokens = {token for phrase in phrases for token in phrase.split()}
    assert not unseen & words
    assert not unseen & {f"{m} {phrase}" for m in taxonomy["modifiers"] for phrase in phrases}
    for kind in ("unseen word", "fresh word", "unseen closed compound", "fresh closed compound"):
        assert not {a for a, _, _ in evaluation[kind]} & tokens


def test_every_label_of_the_default_prior_is_trained_on_and_distinct(
    text: TextVectors, labels: list[str]
) -> None:
    phrases = set(train.compute_features(train.load_taxonomy()["groups"], set())[0])
    assert not set(labels) - phrases
    cosines = text.cosines(labels)
    assert np.max(cosines - 2.0 * np.eye(len(labels))) < 0.99


def test_vectors_have_the_promised_shape_and_scale(text: TextVectors, labels: list[str]) -> None:
    vectors = text.vectors(labels)
    assert vectors.shape == (len(labels), TextVectors.WIDTH)
    assert vectors.dtype == np.float32
    np.testing.assert_allclose(np.sqrt(np.mean(vectors**2, axis=1)), TextVectors.RMS, rtol=1e-5)
    assert np.max(np.abs(vectors)) < 3.0
    assert text.vectors([]).shape == (0, TextVectors.WIDTH)


def test_cosines_agree_with_the_vectors(text: TextVectors) -> None:
    vectors = text.vectors(["mug", "sofa"]).astype(np.float64)
    expected = vectors[0] @ vectors[1] / np.linalg.norm(vectors[0]) / np.linalg.norm(vectors[1])
    np.testing.assert_allclose(text.cosines(["mug", "sofa"]), [[1, expected], [expected, 1]], 1e-5)


def test_a_vector_depends_on_its_label_alone(text: TextVectors, labels: list[str]) -> None:
    backwards = TextVectors().vectors(labels[::-1])[::-1]  # other batches, empty cache
    np.testing.assert_array_equal(text.vectors(labels), backwards)
    twice = text.vectors(["salt shaker", "mug", "salt shaker"])
    np.testing.assert_array_equal(twice[0], twice[2])
    np.testing.assert_array_equal(text.vectors(["Salt_Shaker"])[0], twice[0])


def test_bad_labels_are_refused(text: TextVectors) -> None:
    with pytest.raises(TypeError, match=r"sequence of strings, got 'mug'.*Pass \['mug'\]"):
        text.vectors("mug")
    with pytest.raises(ValueError, match="must contain a word, got ' _'"):
        text.vectors(["mug", " _"])
    with pytest.raises(ValueError, match=r"UTF-8 can hold, got 'm.ud800g'"):
        text.vectors(["m\ud800g"])


def test_missing_pipeline_names_the_install_command() -> None:
    with pytest.raises(ModuleNotFoundError, match="python -m spacy download en_core_web_none"):
        TextVectors("en_core_web_none")


def test_pipeline_of_another_width_is_refused(tmp_path: Path) -> None:
    spacy.blank("en").to_disk(tmp_path)
    with pytest.raises(ValueError, match="tok2vec component of width 96, got None"):
        TextVectors(tmp_path)


def test_installed_package_is_loaded_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: TextVectors
) -> None:
    """A package laid out like en_core_web_sm, made of the shipped pipeline and a ruler."""
    nlp = spacy.load(SHIPPED_PIPELINE)
    nlp.add_pipe("attribute_ruler")
    package = tmp_path / "en_household_ruled"
    package.mkdir()
    nlp.to_disk(package / "en_household_ruled-1.0.0", exclude=["vocab"])
    meta = nlp.meta | {"name": "household_ruled"}
    (package / "meta.json").write_text(json.dumps(meta))
    (package / "__init__.py").write_text(
        "from spacy.util import load_model_from_init_py\n"
        "def load(**options):\n"
        "    return load_model_from_init_py(__file__, **options)\n"
    )
    metadata = tmp_path / "en_household_ruled-1.0.0.dist-info" / "METADATA"
    metadata.parent.mkdir()
    metadata.write_text("Metadata-Version: 2.1\nName: en_household_ruled\nVersion: 1.0.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    ruled = TextVectors("en_household_ruled")
    np.testing.assert_allclose(
        ruled.vectors(["salt shaker"]), text.vectors(["salt shaker"]), rtol=0, atol=1e-5
    )


def test_en_core_web_sm_when_installed() -> None:
    pytest.importorskip(
        "en_core_web_sm", reason="en_core_web_sm is not installed: it is no wheel of PyPI"
    )
    text = TextVectors("en_core_web_sm")
    assert text.name.startswith("en_core_web_sm-")
    assert text.vectors(["mug", "salt shaker"]).shape == (2, TextVectors.WIDTH)


def test_shipped_pipeline_is_small_and_plain() -> None:
    files = [path for path in SHIPPED_PIPELINE.rglob("*") if path.is_file()]
    sizes = {p.relative_to(SHIPPED_PIPELINE).as_posix(): p.stat().st_size for p in files}
    assert sizes.pop(ENCODER_FILE) < 5e6  # all that is read without spaCy
    assert set(sizes) == {"config.cfg", "meta.json", "tokenizer", "tok2vec/cfg", "tok2vec/model"}
    assert sum(sizes.values()) < 5e6


@pytest.mark.slow
def test_import_is_light_and_loading_needs_neither_pickle_nor_network(tmp_path: Path) -> None:
    folder = copy_for_spacy(tmp_path)
    script = """
import sys
import sgm.text
events = []
sys.addaudithook(lambda e, _: events.append(e) if e.startswith(("pickle.", "socket.")) else None)
sgm.text.TextVectors().vectors(["mug", "a new word"])
assert not {"spacy", "torch"} & set(sys.modules)
assert not events, events
import spacy
events.clear()
sgm.text.TextVectors(sys.argv[1]).vectors(["mug"])
assert not events, events
"""
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script, str(folder)],
        cwd=root,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("word", "plural"),
    [
        ("mug", "mugs"),
        ("glass", "glasses"),
        ("tissue box", "tissue boxes"),
        ("berry", "berries"),
        ("toy", "toys"),
        ("butter knife", "butter knives"),
        ("tomato", "tomatoes"),
        ("scissors", "scissors"),
    ],
)
def test_plural(word: str, plural: str) -> None:
    assert train.compute_plural(word) == plural


def test_targets_by_hand() -> None:
    phrases, features = train.compute_features(TINY_TAXONOMY["groups"], {"forks"})
    targets = features @ features.T
    cosine = {(a, b): targets[i, j] for i, a in enumerate(phrases) for j, b in enumerate(phrases)}
    # One value in each of name, kinds, rooms, plus identity; no uses, places, materials:
    # squared length 1.0^2 + 0.9^2 + 0.5^2 + 0.6^2 = 2.42.
    assert cosine["mug", "mug"] == pytest.approx(1.0)
    assert cosine["mug", "mugs"] == pytest.approx(1.0)
    assert cosine["mug", "cup"] == pytest.approx((1.0 + 0.81 + 0.25) / 2.42)
    assert cosine["mug", "fork"] == pytest.approx((0.81 + 0.25) / 2.42)
    assert cosine["mug", "pillow"] == pytest.approx(0.0)
    assert "spoons" in phrases
    assert "forks" not in phrases


def test_gradient_of_the_loss_agrees_with_finite_differences() -> None:
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(5, 8)).astype(np.float32)
    half = rng.uniform(size=(5, 5)).astype(np.float32)
    targets = (half + half.T) / 2
    _, gradient = train.compute_loss(vectors, targets)
    numeric = np.zeros_like(vectors)
    for index in np.ndindex(vectors.shape):
        step = np.zeros_like(vectors)
        step[index] = 1e-2
        upper, _ = train.compute_loss(vectors + step, targets)
        lower, _ = train.compute_loss(vectors - step, targets)
        numeric[index] = (upper - lower) / 2e-2
    assert np.max(np.abs(numeric)) > 0.02
    np.testing.assert_allclose(gradient, numeric, atol=2e-4)


@pytest.mark.slow
def test_training_repeats_byte_for_byte_and_lowers_the_loss(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", logger=train.logger.name)
    for name in ("first", "second"):
        train.train(TINY_TAXONOMY, set(), **SETTINGS).to_disk(tmp_path / name, exclude=["vocab"])
    first, second = ((tmp_path / name / "tok2vec/model") for name in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()
    losses = [float(message.split()[-1]) for message in caplog.messages if "loss" in message]
    assert losses[2] < losses[0]
    assert losses[:3] == losses[3:]
    other = train.train(TINY_TAXONOMY, set(), **(SETTINGS | {"seed": 2}))
    other.to_disk(tmp_path / "other", exclude=["vocab"])
    assert (tmp_path / "other/tok2vec/model").read_bytes() != first.read_bytes()


@pytest.mark.slow
def test_command_line_writes_a_pipeline_that_loads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(train, "load_taxonomy", lambda: TINY_TAXONOMY)
    out = tmp_path / "new" / "folder"
    train.main(["--out", str(out), "--epochs", "1", "--batch-size", "64"])
    assert set(json.loads(capsys.readouterr().out)["accuracy"]) == set(train.load_evaluation())
    words = ["mug", "spoons", "blue lamp", "(new)"]
    with_spacy = np.stack(list(SpacyEncoder(load_language(out)).encode(words)))
    text = TextVectors(out)
    np.testing.assert_allclose(text.vectors(words), with_spacy, rtol=0, atol=1e-5)
    (out / ENCODER_FILE).write_bytes(b"")
    train.main(["--out", str(out), "--convert_only"])
    np.testing.assert_array_equal(TextVectors(out).vectors(words), text.vectors(words))
    (out / ENCODER_FILE).unlink()
    np.testing.assert_array_equal(TextVectors(out).vectors(words), with_spacy)
    assert TextVectors(out).name == text.name == f"en_household-{train.VERSION}"
    with pytest.raises(SystemExit):
        train.main(["--out", str(out), "--epochs", "0"])
    assert "error: epochs must be at least 1, got 0" in capsys.readouterr().err
