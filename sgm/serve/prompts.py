"""The prompts of MCP: what a person may choose in a client, said to the model in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sgm.messages import shorten_text
from sgm.names.words import MAX_LENGTH


@dataclass(frozen=True, slots=True)
class Prompt:
    """A prompt.

    Attributes:
        name: by which it is asked for.
        about: one sentence.
        argument: its name.
        about_argument: in one line.
        default: what stands for an argument that is left out; None if it may not be.
        text: with `{}` where the argument stands.
    """

    name: str
    about: str
    argument: str
    about_argument: str
    default: str | None
    text: str

    def write(self, arguments: Mapping[str, str]) -> str:
        """Return the text; raises ValueError for other arguments than its own."""
        unknown = [name for name in arguments if name != self.argument]
        if unknown:
            raise ValueError(
                f"arguments of prompt {self.name} must be {self.argument}, got "
                f"{shorten_text(unknown[0])!r}. Leave it out."
            )
        said = " ".join(arguments.get(self.argument, "").split()) or self.default
        if said is None or len(said) > MAX_LENGTH:
            raise ValueError(
                f"{self.argument} must be a text of 1 to {MAX_LENGTH} characters, got "
                f"{'none' if said is None else shorten_text(said)}. Give it: {self.about_argument}."
            )
        return self.text.format(said)


PROMPTS: Final[Mapping[str, Prompt]] = {
    prompt.name: prompt
    for prompt in (
        Prompt(
            "tidy_up",
            "Put things back where they belong.",
            "room",
            "such as kitchen; left out for the whole home",
            "the whole home",
            "Tidy up: {}. Look through list_things, and through changes since this morning. The "
            "history of a thing says where it was before. List for me what does not lie where it "
            "belongs, and where you would put it; begin when I agree. For each thing call "
            "search_start, and search_next after every look, with all that was seen there; then "
            "picked_up, and put_down at its place. Say at the end what you have put back, and what "
            "you did not find.",
        ),
        Prompt(
            "where_is",
            "Say where a thing is.",
            "thing",
            "in words, such as the red mug",
            None,
            "Where is this: {}? Call where_is. If the status is ambiguous, ask me what `ask` says. "
            "Say the likeliest place, how sure that is and why; the next places, too, if it is "
            "less than even.",
        ),
    )
}
