"""Films of searches: GIF, or MP4 where ffmpeg is installed."""

from __future__ import annotations

import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from simulator.igridson.agent import GridAgent
from simulator.igridson.drawing import AGENT, ASKED, BELIEF, FOUND, FURNITURE, mix
from simulator.igridson.env import IGridsonEnv
from simulator.igridson.find_object import Searcher
from simulator.igridson.scene import COLOR_WORDS, NEUTRALS

FORMATS = (".gif", ".mp4")
_FRAMES_PER_SECOND = 8
_HOLD_LOOK = 6  # frames for which a look stands still
_HOLD_END = 14  # and the end of a search


def film_searches(
    env: IGridsonEnv, searcher: Searcher, seed: int, num_searches: int, warm_up: int
) -> list[np.ndarray]:
    """Film an agent in one home, in an environment of `render_mode` "rgb_array".

    Some searches before are not filmed (`warm_up`), so that the memory is not empty.

    Returns:
        Frames of equal duration, uint8 (height, width, 3) each.

    Raises:
        ValueError: if there is nothing to film.
    """
    if num_searches < 1 or warm_up < 0:
        raise ValueError(
            "video must show at least one search after zero or more others, got "
            f"{num_searches} after {warm_up}. Raise the number."
        )
    agent = GridAgent(env, searcher)
    frames: list[np.ndarray] = []
    for number in range(warm_up + num_searches):
        for _ in agent.search(seed if number == 0 else None):
            if number < warm_up:
                continue
            frame = env.get_frame(tile_size=env.tile_size)
            stands_still = env.is_looking or env.step_count == 0
            frames += [frame] * (_HOLD_LOOK if stands_still else 1)
        if number >= warm_up:
            frames += [frames[-1]] * _HOLD_END
    return frames


def save_video(frames: list[np.ndarray], path: Path) -> None:
    """Write frames to a GIF or an MP4 file.

    Raises:
        ValueError: if the name ends in neither.
        FileNotFoundError: if an MP4 is wanted and ffmpeg is not installed.
        OSError: if the file cannot be written.
    """
    check_format(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".gif":
        _save_gif(frames, path)
    else:
        _save_mp4(frames, path)


def check_format(path: Path) -> None:
    """Check that a film can be written to a file of this name.

    Raises:
        ValueError: if the name ends in neither .gif nor .mp4.
        FileNotFoundError: if an MP4 is wanted and ffmpeg is not installed.
    """
    if path.suffix not in FORMATS:
        raise ValueError(f"video must end in {' or '.join(FORMATS)}, got '{path.name}'. Rename it.")
    if path.suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise FileNotFoundError(
            "MP4 must be written with ffmpeg, got no such command. Install ffmpeg, or write a .gif."
        )


def _save_gif(frames: list[np.ndarray], path: Path) -> None:
    """Write a looping GIF; frames that repeat become one of longer duration."""
    is_new = [not np.array_equal(*pair) for pair in pairwise(frames)]
    first = np.flatnonzero([True, *is_new])  # of each run of equal frames
    kept = [frames[number] for number in first]
    palette = _make_palette(kept)
    images = [
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in kept
    ]
    counts = np.diff([*first, len(frames)])
    durations = (round(1000 / _FRAMES_PER_SECOND) * counts).tolist()
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0)


def _make_palette(frames: list[np.ndarray]) -> Image.Image:
    """Return one palette for all frames, so that colours do not flicker.

    The colours that mean something come first, then the most frequent ones.
    """
    sample = [frames[i] for i in np.linspace(0, len(frames) - 1, 12).astype(int)]
    codes = np.concatenate([frame.reshape(-1, 3) for frame in sample]) @ [65536, 256, 1]
    colors, counts = np.unique(codes, return_counts=True)
    frequent = [(c // 65536, c // 256 % 256, c % 256) for c in colors[np.argsort(-counts)].tolist()]
    shades = [mix(FURNITURE, BELIEF, share) for share in np.linspace(0, 1, 32)]
    meaningful = [*shades, ASKED, AGENT, FOUND, *NEUTRALS, *COLOR_WORDS.values()]
    chosen = list(dict.fromkeys([*meaningful, *frequent]))[:256]
    palette = Image.new("P", (1, 1))
    palette.putpalette([int(channel) for color in chosen for channel in color])
    return palette


def _save_mp4(frames: list[np.ndarray], path: Path) -> None:
    """Pipe the frames to ffmpeg."""
    height, width, _ = frames[0].shape
    command = [
        "ffmpeg",
        "-y",
        "-loglevel",
        "error",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        str(_FRAMES_PER_SECOND),
        "-i",
        "-",
        "-vf",
        "pad=ceil(iw/2)*2:ceil(ih/2)*2",
        "-pix_fmt",
        "yuv420p",
        str(path),
    ]
    done = subprocess.run(
        command,
        input=b"".join(frame.tobytes() for frame in frames),
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise OSError(
            f"ffmpeg must write the film, got exit status {done.returncode} for '{path}': "
            f"{done.stderr.decode(errors='replace').strip()}. Write a .gif instead."
        )
