"""The text encoder that ships: a Tok2Vec of spaCy, computed with numpy alone.

An encoder has a `name`, language, name and version, such as "en_household-1.0.0", and `encode`,
which gives the vector of each of some texts in lower case: all of one width and one scale.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open

from sgm.files import parse_json
from sgm.messages import shorten
from sgm.text.tokenizer import Tokenizer

FloatArray = NDArray[np.float32]

WIDTH = 96
RMS = 0.5  # root mean square of the entries of a vector
ENCODER_FILE = "encoder.safetensors"
METADATA = "encoder"  # key of the JSON in that file
ATTRIBUTES = ("norm", "prefix", "suffix", "shape")  # of a token, in the order of the tables
DEPTH = 4  # window layers
PIECES = 3  # of a maxout
_MASK = 2**64 - 1  # of a hash


class Tok2Vec:
    """Hash embeddings of a token's attributes, then residual layers over windows of three tokens.

    Everything is computed in float64, one text at a time. So a vector depends on no other text, and
    what is left of a processor's rounding is seldom seen once a vector is rounded to float32.

    Args:
        name: language, name and version of the pipeline that was converted.
        arrays: `table.A` (rows, 96) of each attribute A; `layer.N.weights` (I, 288), `layer.N.bias`
            (288,), `layer.N.scale` and `layer.N.shift` (96,) of layers 0 to 4, where I is 384 in
            the first and 288 in the others; `vectors` (W, 96) of known words.
        words: in lower case; their vectors are not computed, but those of `arrays`, (W,).
        seeds: of the hash of each attribute.
        symbols: strings whose id is not their hash.
        tokenizer: of the texts.

    Raises:
        KeyError: if an array is missing.
        ValueError: if one has another shape or is not of float32.

    Source: spaCy's documentation of MultiHashEmbed and MaxoutWindowEncoder.
    """

    def __init__(
        self,
        name: str,
        arrays: Mapping[str, NDArray[Any]],
        *,
        words: Sequence[str],
        seeds: Mapping[str, int],
        symbols: Mapping[str, int],
        tokenizer: Tokenizer,
    ) -> None:
        _check_arrays(arrays, len(words))
        self.name = name
        self._vector_of = dict(zip(words, arrays["vectors"], strict=True))
        self._tables = [arrays[f"table.{attribute}"] for attribute in ATTRIBUTES]
        self._seeds = np.array([seeds[attribute] for attribute in ATTRIBUTES], dtype=np.uint64)
        self._num_rows = np.array([len(table) for table in self._tables], dtype=np.uint64)
        self._layers = [
            [
                arrays[f"layer.{n}.{part}"].astype(float)
                for part in ("weights", "bias", "scale", "shift")
            ]
            for n in range(1 + DEPTH)
        ]
        self._symbols = dict(symbols)
        self._tokenizer = tokenizer

    @property
    def words(self) -> tuple[str, ...]:
        """Words and phrases in lower case that were trained on."""
        return tuple(self._vector_of)

    def encode(self, texts: Sequence[str]) -> Iterator[FloatArray]:
        """Give the vector of each text, float32 (96,)."""
        for text in texts:
            known = self._vector_of.get(text)
            yield scale_mean(self.compute_tokens(text)) if known is None else known

    def compute_tokens(self, text: str) -> NDArray[np.float64]:
        """Compute the vectors of the tokens of a text in lower case, known or not, (T, 96)."""
        ids = []
        for token in self._tokenizer.split(text):
            word = token.text
            names = (token.norm, word[0], word[-3:], compute_shape(word))  # as `ATTRIBUTES`
            ids.append([self._symbols.get(name) or hash_string(name) for name in names])
        rows = hash_rows(np.array(ids, dtype=np.uint64), self._seeds, self._num_rows)  # (T, A, 4)
        embedded = [
            table[rows[:, column]].sum(axis=1, dtype=float)  # (T, 96)
            for column, table in enumerate(self._tables)
        ]
        states = np.zeros((len(ids) + 2 * DEPTH, WIDTH))  # each layer uses up a row at each end
        states[DEPTH:-DEPTH] = _apply(self._layers[0], np.concatenate(embedded, axis=1))
        for layer in self._layers[1:]:
            windows = np.concatenate([states[:-2], states[1:-1], states[2:]], axis=1)
            states = states[1:-1] + _apply(layer, windows)
        return states


def _apply(layer: list[NDArray[np.float64]], inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Maxout, then layer normalisation, (T, I) -> (T, 96)."""
    weights, bias, scale, shift = layer
    pieces = (inputs @ weights + bias).reshape(len(inputs), PIECES, WIDTH)
    most = pieces.max(axis=1)  # (T, 96)
    centred = most - most.mean(axis=1, keepdims=True)
    variance = np.mean(centred**2, axis=1, keepdims=True)
    return centred / np.sqrt(variance + 1e-8) * scale + shift


def compute_shape(text: str) -> str:
    """Give the shape of a token: "xxd" of "ab1"; a run of equal signs is cut at four."""
    if len(text) >= 100:
        return "LONG"
    shape = ""
    for char in text:
        if char.isalpha():
            char = "X" if char.isupper() else "x"
        elif char.isdigit():
            char = "d"
        if shape[-4:] != 4 * char:
            shape += char
    return shape


def _check_arrays(arrays: Mapping[str, NDArray[Any]], num_words: int) -> None:
    shapes: dict[str, tuple[int, ...]] = {"vectors": (num_words, WIDTH)}
    for attribute in ATTRIBUTES:
        name = f"table.{attribute}"
        shapes[name] = (max(1, len(arrays[name])), WIDTH)
    for n in range(1 + DEPTH):
        num_inputs = (3 if n else len(ATTRIBUTES)) * WIDTH
        shapes |= {
            f"layer.{n}.weights": (num_inputs, PIECES * WIDTH),
            f"layer.{n}.bias": (PIECES * WIDTH,),
            f"layer.{n}.scale": (WIDTH,),
            f"layer.{n}.shift": (WIDTH,),
        }
    for name, shape in shapes.items():
        array = arrays[name]
        if array.shape != shape or array.dtype != np.float32:
            raise ValueError(f"{array.dtype} {array.shape} where {name} is float32 {shape}")


def load_tok2vec(path: Path) -> Tok2Vec:
    """Load a file that `tools.text_training` wrote.

    Raises:
        ValueError: if it is cut short, or holds something else.
    """
    try:
        with safe_open(path, framework="np") as file:
            about = parse_json(file.metadata()[METADATA])
            arrays = {name: file.get_tensor(name) for name in file.keys()}
        return Tok2Vec(
            about["name"],
            arrays,
            words=about["words"],
            seeds=about["seeds"],
            symbols=about["symbols"],
            tokenizer=Tokenizer(**about["tokenizer"]),
        )
    except (SafetensorError, LookupError, TypeError, ValueError) as error:
        raise ValueError(
            f"text encoder must be a whole file of tools.text_training, got {shorten(str(error))} "
            f"for {path}. Write it anew: python -m tools.text_training --convert_only --out FOLDER"
        ) from error


def hash_string(text: str) -> int:
    """Hash a string as spaCy does: MurmurHash64A with seed 1 of its UTF-8 bytes, 0 if empty.

    Source: A. Appleby, MurmurHash2, 64-bit version; spaCy's StringStore.
    """
    if not text:
        return 0
    data, factor = text.encode("utf-8"), 0xC6A4A7935BD1E995
    hashed = (1 ^ (len(data) * factor)) & _MASK
    num_whole = len(data) // 8 * 8
    for start in range(0, num_whole, 8):
        block = int.from_bytes(data[start : start + 8], "little") * factor & _MASK
        block = (block ^ block >> 47) * factor & _MASK
        hashed = (hashed ^ block) * factor & _MASK
    if num_whole < len(data):
        hashed = (hashed ^ int.from_bytes(data[num_whole:], "little")) * factor & _MASK
    hashed = (hashed ^ hashed >> 47) * factor & _MASK
    return hashed ^ hashed >> 47


def hash_rows(
    ids: NDArray[np.uint64], seeds: NDArray[np.uint64], num_rows: NDArray[np.uint64]
) -> NDArray[np.intp]:
    """Choose four rows of each hash table for each id, (T, A) -> (T, A, 4).

    MurmurHash3_x64_128 of the eight bytes of an id, as thinc's `HashEmbed` computes it: of T
    tokens' A attributes, with seeds and numbers of rows of the tables, (A,).

    Source: A. Appleby, MurmurHash3; J. Svenstrup et al., "Hash embeddings", 2017.
    """
    first = ids * np.uint64(0x87C37B91114253D5)  # products modulo 2^64, as the hash wants them
    first = (first << np.uint64(31) | first >> np.uint64(33)) * np.uint64(0x4CF5AD432745937F)
    second = seeds ^ np.uint64(8)  # 8 bytes long
    first = (first ^ second) + second
    second = second + first
    first, second = _mix(first), _mix(second)
    first = first + second
    second = second + first
    low = np.uint64(0xFFFFFFFF)
    parts = [first & low, first >> np.uint64(32), second & low, second >> np.uint64(32)]
    return (np.stack(parts, axis=-1) % num_rows[:, None]).astype(np.intp)


def _mix(hashed: NDArray[np.uint64]) -> NDArray[np.uint64]:
    for factor in (0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53):
        hashed = (hashed ^ hashed >> np.uint64(33)) * np.uint64(factor)
    return hashed ^ hashed >> np.uint64(33)


def scale_mean(tokens: NDArray[Any]) -> FloatArray:
    """Scale the mean of the vectors of a text's tokens to `RMS`, (T, 96) -> float32 (96,)."""
    mean = tokens.mean(axis=0)  # (96,)
    scale = RMS / max(float(np.sqrt(np.mean(mean**2))), 1e-8)
    return (mean * scale).astype(np.float32)
