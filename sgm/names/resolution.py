"""What a question was taken for: matches, how sure they are, and what to ask back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from sgm.names.asking import Asking, make_asking
from sgm.names.sections import ENGLISH

MOST_ALTERNATIVES = 3
_UNSURE = (
    "another property",
    "typo",
    "part of the name",
    "what it holds",
    "similar meaning",
    "several things",
    "unknown",
)
SAYS_LESS = ("fewer words", "more general name")


@dataclass(frozen=True, slots=True)
class Resolution:
    """What a question was taken for.

    Attributes:
        question: as it was asked.
        matches: descriptions of the memory that it may mean, in the order in which they came up; a
            thing is found when one of them is. Empty where the memory has nothing of that name.
        how: "exact"; "same words" (but for articles, case, order, plural); "any of the kind" (the
            question says less than the descriptions); "synonym"; "fewer words" (the descriptions
            say less than the question); "more general name"; "another property" (they say another
            one than the question); "part of the name"; "what it holds"; "typo"; "similar meaning"
            (by text vectors); "several things" (the question is about more than one); or "unknown".
        alternatives: other descriptions that may have been meant, the nearest first.
        doubtful: where nothing matches, descriptions that may well be meant, and may be another
            thing: a "piano bench" where a bench is asked for. Ask the user.
        readings: the matches by what the name may mean: eyeglasses, and drinking glasses.
        owner: whose it is, by the question: "dad" of "dad's phone"; empty if it names no owner.
        unused: words of the question that say something, and that nothing was made of.
        things: where it is about several, each in words of its own.
        where: words of a place in the question, "on the dinner table"; the finder looks it up.
        is_not_there: whether the thing is not there, by the question.
        is_soft: whether that place is a room before a name, "kitchen scissors".
        places: furniture that the words of a place mean; the finder fills it in.
        contradiction: how what is known contradicts that place, in one sentence.
        unsorted: where it is a broad kind, "toy": descriptions that the table knows no kind of.
        quantity: "both", "every" or a number, where the question says so.
        language: in which is asked back.
    """

    question: str
    matches: tuple[str, ...]
    how: str
    alternatives: tuple[str, ...] = ()
    readings: tuple[tuple[str, ...], ...] = ()
    owner: str = ""
    doubtful: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    things: tuple[str, ...] = ()
    where: str = ""
    is_not_there: bool = False
    is_soft: bool = False
    places: tuple[int, ...] = ()
    contradiction: str = ""
    unsorted: tuple[str, ...] = ()
    quantity: str = ""
    language: str = ENGLISH

    @property
    def is_ambiguous(self) -> bool:
        """Whether it is to be asked what is meant; see `ask_back`.

        The name means different things, perhaps one of `doubtful`, or what has another property; or
        there are words that nothing was made of.
        """
        if self.unused or self.things or self.contradiction:
            return True
        if self.matches:
            return self.means_several or self.how == "another property"
        return bool(self.doubtful)

    @property
    def means_several(self) -> bool:
        """Whether the name means different things, "glasses": each of `readings`."""
        return len(self.readings) > 1

    @property
    def has_quantity(self) -> bool:
        """Whether there are as many matches as "both", "every" or "3" says."""
        if self.quantity in ("", "every"):
            return True
        return len(self.matches) == (2 if self.quantity == "both" else int(self.quantity))

    def take_only(self, match: str) -> Resolution:
        """Return the resolution of a question that means one description, and nothing else."""
        return replace(self, matches=(match,), readings=((match,),), how="exact")

    @property
    def is_sure(self) -> bool:
        """Whether the matches are meant by their names, so that finding one ends a search."""
        return self.how not in _UNSURE and not self.unused

    @property
    def says_less(self) -> bool:
        """Whether the matches say less than the question: "mug" for "red mug"."""
        return self.how in SAYS_LESS

    @property
    def meant(self) -> tuple[str, ...]:
        """The matches, where all that is said of the question holds for them.

        None where they say less: what is no "red mug" may be a "mug".
        """
        return self.matches if self.is_sure and not self.says_less else ()

    @property
    def ask_back(self) -> str:
        """What to ask the user, "Do you mean the eyeglasses or the wine glass?"; else empty."""
        if not self.is_ambiguous:
            return ""
        asking = make_asking(self.language)
        if self.things:
            return asking.say("several", names=asking.list_names(self.things))
        meant = self.matches or self.doubtful
        told = [asking.tell_unused(self.unused)] if self.unused else []
        told += [self.contradiction] if self.contradiction else []
        if meant and not self.contradiction:
            told.append(asking.ask_which(meant))
        return " ".join(told)

    def __str__(self) -> str:
        """Say it in one line."""
        line = self.question
        if self.how == "exact":
            return line
        asking = make_asking(self.language)
        if self.matches:
            names, how = list_some(self.matches, asking), asking.tell_how(self.how)
            line = asking.say("taken for", question=line, names=names, how=how)
        if self.is_ambiguous:
            line += f" ({self.ask_back})"
        if self.alternatives:
            names = list_some(self.alternatives, asking)
            line += f" {asking.say('did you mean', names=names)}"
        return line


def list_some(names: Sequence[str], asking: Asking) -> str:
    """List the first names, and say how many more there are."""
    shown = ", ".join(map(asking.translate, names[:MOST_ALTERNATIVES]))
    more = len(names) - MOST_ALTERNATIVES
    return asking.say("some names", names=shown, number=more) if more > 0 else shown
