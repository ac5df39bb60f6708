"""A search that goes on from call to call, and what each of its looks was answered."""

from __future__ import annotations

from sgm.checks import is_number
from sgm.finder.answers import NextLook, Searching
from sgm.finder.meanings import Unclear, ask_which, tell_doubt
from sgm.finder.search_plan import Look
from sgm.finder.search_several import SeveralSearch
from sgm.finder.spots import tell_position
from sgm.messages import shorten

_MOST_TOLD = 20  # of the latest looks, whose answers are kept


class RunningSearch:
    """A search with its number, whose looks are counted from 1.

    Attributes:
        search_id: for `search_next`.
        search: the search.
    """

    def __init__(self, search_id: str, search: SeveralSearch) -> None:
        """Begin with a search that was begun."""
        self.search_id, self.search = search_id, search
        self._told: dict[int, tuple[object, Searching]] = {}  # by number of the look

    def find_told(self, look: object, about: object) -> Searching | None:
        """Return the answer of a look that was reported before; None of the one that is next.

        Args:
            look: its number; None for the one that is next.
            about: what came of it.

        Raises:
            ValueError: if the look is neither, or something else was said to come of it.
        """
        following = self.search.num_looks + 1
        if look is None or (look == following and is_number(look)):
            return None
        said, answer = self._told.get(look, (None, None)) if is_number(look) else (None, None)  # type: ignore[call-overload]
        if answer is None:
            raise ValueError(
                f"look must be the number of the next look, {following}, or of one of the latest, "
                f"got {shorten(look)}. Send what next.look was."
            )
        if said != about:
            raise ValueError(
                f"look {shorten(look)} must have come to one result, got another one than before. "
                "Send the look that is next."
            )
        return answer

    def note(self, about: object) -> Searching:
        """Return the answer to what came of the latest look, and keep it."""
        number = self.search.num_looks
        answer = self.tell()
        self._told[number] = about, answer
        self._told.pop(number - _MOST_TOLD, None)
        return answer

    def tell(self, near: Unclear | None = None) -> Searching:
        """Tell how the search stands, and what may be meant, of which the latest look shows some.

        `near` is what to ask about the thing that is looked for; None for nothing.
        """
        search = self.search
        if near is None and search.offered:
            near = ask_which(search.offered, search.description, search.memory.language)
        return Searching(
            search_id=self.search_id,
            thing=search.description,
            next=None if search.going is None else _tell_look(search.going, search.num_looks + 1),
            is_found=search.is_found,
            looks=search.num_looks,
            outcome=search.outcome,
            left=search.left if len(search.searches) > 1 else None,
            **{**tell_doubt(near), "status": "ok"},  # what nothing is known of is looked for, too
        )


def _tell_look(look: Look, number: int) -> NextLook:
    """Tell where to look next, and where to stand for that."""
    place = look.place
    assert look.layout is not None
    return NextLook(
        place.furniture,
        place.name,
        place.probability,
        look.cost,
        number,
        pose=look.pose,
        box=look.box,
        **tell_position(look.layout, place.furniture, place.position),
    )
