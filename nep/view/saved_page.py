"""The page as one file: no server, no display, nothing from the network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nep.view.answers import Desk
from nep.view.document import make_document
from sgm.files import write_whole

MOST_FRAMES = 60  # steps of a story
_MOST_FURNITURE = 200  # whose tables are kept


def save_page(desk: Desk, asked: Sequence[str], path: Path) -> None:
    """Write the page to a file that any browser opens.

    It holds the answers of the first judge to what is asked, at up to `MOST_FRAMES` steps, those
    with statements and looks first; furniture is described as of the last step.

    Raises:
        ValueError: if something that is asked is no name.
        OSError: if the file cannot be written.
    """
    story, judge = desk.stage.story, desk.judges.names[0]
    steps = story.choose_steps(MOST_FRAMES)
    frames: dict[int, Any] = {}
    plans: dict[int, Any] = {}
    for step in steps:
        state = desk.tell_state(step)
        if state["plan"] not in plans:
            plans[state["plan"]] = desk.tell_plan(step)
        answers = {words: desk.answer(step, words, judge) for words in asked}
        frames[step] = {"state": state, "answers": answers, "changes": desk.tell_changes(step)}
    ids = story.memory_at(story.num_steps).furniture_ids[:_MOST_FURNITURE]
    content = {
        **desk.tell_page(next(iter(asked), "")),
        "judges": [judge],
        "isLive": False,
        "saved": {
            "asked": list(asked), "frames": frames, "plans": plans, "names": desk.list_names(),
            "traces": {words: desk.trace(words, judge) for words in asked},
            "furniture": {number: desk.tell_furniture(story.num_steps, number) for number in ids},
        },
    }  # fmt: skip
    write_whole(path, make_document(content).encode())
