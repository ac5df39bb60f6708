"""The features of an answer as a table: group, name, unit and what each column says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

EVIDENCE_VERSION = 3  # raised with every change of the columns or of what they mean


class EvidenceColumn(NamedTuple):
    """A feature of a place, or of a question.

    Attributes:
        group: which can be switched off.
        name: within the group.
        unit: of its numbers, see `UNITS`.
        text: what it says.
    """

    group: str
    name: str
    unit: str
    text: str


UNITS = {
    "0 or 1": "no or yes",
    "share": "0 to 1, of what is counted",
    "log share": "log(share x number of places + a little), about 0 for an even share",
    "probability": "0 to 1",
    "count": "log(1 + n)",
    "hours": "log(1 + hours)",
    "rate": "log(events per hour)",
    "moves": "1 - exp(-rate x hours), as a share of things that have moved by then",
    "rank": "1 / rank; equal ones share the mean",
    "ratio": "a number without a unit",
    "log": "a logarithm",
    "nats": "an information, in nats",
    "cosine": "-1 to 1",
}

# A group, and below it its columns: name, unit, what it says, with two spaces between them.
_OF_PLACES = """
sightings
  num_true  count  sightings of the thing at the place
  share  share  of its sightings, those at the place
  per_look  share  of the looks at the place and one more, those that showed it
  per_look_smooth  share  the same, with a fifth of a sighting more
  is_last  0 or 1  it was seen last here
  was_seen  0 or 1  it was ever seen here
  share_rank  rank  of the place by sightings
  recency_rank  rank  of the place by the time of its latest sighting
  is_usual  share  1 where it was seen most; places that are equal share it
  is_usual_and_away  share  the same, 0 at the place where it was seen last
looks
  absent_since_seen  count  looks that missed it since it was seen here
  absent_never_seen  count  looks that missed it where it was never seen
  looks  count  looks at the place
  was_looked_at  0 or 1  the place was ever looked at
  looks_share  ratio  a quarter of its looks to those at an average place
  is_looked_at_since  0 or 1  there was a look after the latest sighting here
times
  hours_since_seen  hours  since the latest sighting here; 0 where it was never seen
  home_moves_since_seen  moves  in this time, at the rate of the average thing of the home
  own_moves_since_seen  moves  in this time, at the rate of this thing
  hours_since_look  hours  since the latest look at the place; 0 without one
  home_moves_since_look  moves  in this time, at the rate of the average thing of the home
  own_moves_since_look  moves  in this time, at the rate of this thing
stays
  num_left  count  looks that found it gone from here
  left_since_seen  moves  since it was seen here, at the rate at which it was found gone
  per_known_look  share  of the looks since it was first seen here, those that showed it
  presence  probability  that it is here, as it leaves and comes back at the counted rates
  log_presence  log share  of the odds of that over all places
prior
  prior  share  of the thing at the place, by the prior
  log_prior  log share  of the same; 0 where the prior says nothing
  prior_rank  rank  of the place by the prior
  is_possible  0 or 1  the prior gives more than 0
  place_share  share  by the prior, of what is expected at the place, this thing
  log_place_share  log share  of the same
  place_share_rank  rank  of the place by the same
  prior_in_room  share  by the prior, within the room where it was seen last
  posterior_0.5  share  sightings per look, where the prior counts as half a look
  posterior_2  share  the same, where it counts as two looks
  posterior_8  share  the same, where it counts as eight looks
words
  by_name  share  of things of such names at the place, by the prior
  log_by_name  log share  of the same; 0 where no name is alike
  by_name_rank  rank  of the place by the same
  similar_here  share  of the sightings of things of similar names in this home
  log_similar_here  log share  of the same
  furniture_cosine  cosine  of the furniture's name to the nearest that the prior knows
filters
  belief_anywhere  probability  by an adaptive filter whose moves lead anywhere
  log_belief_anywhere  log share  of the same
  belief_in_room  probability  by one whose moves stay in the room
  log_belief_in_room  log share  of the same
  belief_learnt  probability  by one with the home's own share of moves between rooms
  log_belief_learnt  log share  of the same
  belief_slow  probability  by one with 0.02 moves an hour
  log_belief_slow  log share  of the same
  belief_fast  probability  by one with 0.15 moves an hour
  log_belief_fast  log share  of the same
  belief_moved  probability  by one for which the thing has just moved
  log_belief_moved  log share  of the same
  belief_moved_in_room  probability  by one for which it has just moved within its room
  log_belief_moved_in_room  log share  of the same
  belief_asked  probability  by one for which it may have just moved, as it is asked for
  log_belief_asked  log share  of the same
  belief_left  probability  by one whose rate is that at which it was found gone
  log_belief_left  log share  of the same
  belief_left_asked  probability  by one of that rate, for which it may have just moved
  log_belief_left_asked  log share  of the same
  belief_rank  rank  of the place by belief_asked
places
  popularity  share  of the things of the home, those that were last seen here
  log_popularity  log  of popularity x number of places + 0.1
  arrivals  share  of all moves of the home, those to the place
  log_arrivals  log  of the same to an even share, smoothed by half a move
  onward  share  of the moves from where the thing was seen last, those to the place
  log_onward  count  of these moves
  log_back  count  moves from the place to where the thing was seen last
others
  name_at_label  count  sightings of things of this name at furniture of this label
  name_at_label_share  share  of the sightings of things of this name, the same
  name_at_label_in_room  count  the same, in this room
  looks_at_label_in_room  count  looks at furniture of this label in this room
  same_name  count  sightings of other things of this name at the place
  same_name_share  share  of the sightings of other things of this name, the same
  companions_now  share  of things that are usually seen where this one is, those last seen here
  companions_often  share  of their sightings, those here; 0 at the usual place of this one
  strays  count  things last seen here that are usually elsewhere, by how lately
  strays_share  share  of all such things of the home
ways
  own  0 or 1  it came here from where it was seen last, the last time it did
  alike  share  of the moves of other things from there, by how alike their names are
  log_alike  log share  of the same
  label  share  of the moves between furniture of these two labels
  log_label  log share  of the same
lately
  changes_minutes  count  changes found at the place, e times less after 10 minutes
  changes_hours  count  the same, after an hour
rooms
  is_same_room  0 or 1  the place is in the room where it was seen last
  room_share  share  of its sightings, those in this room
  log_room_size  log  of the number of places in the room
hours
  hour_wide  share  of its sightings at about this hour of the day, those here
  log_hour_wide  count  of these sightings
  presence_wide  share  of the looks at about this hour, those that showed it
  hour_narrow  share  as hour_wide, of fewer hours
  log_hour_narrow  count  of these sightings
  presence_narrow  share  as presence_wide, of fewer hours
  strays_at_hour  share  of sightings at this hour of things out of their usual places, those here
  log_strays_at_hour  log share  of the same
"""
_OF_QUESTIONS = """
size
  log_num_places  log  of the number of places, 4 at least
  log_num_rooms  log  of the number of rooms, 3 at least
  num_known  count  things that were last seen at furniture that there is
  sightings_per_object  count  sightings for each of them
  age  hours  since the memory began
  log_step  log  of the hours of a time step
movement
  log_home_rate  rate  of moves of the average thing of the home
  log_own_rate  rate  of moves of this thing
  own_moves  count  moves of this thing that were found
  hours_since_seen  hours  since its latest sighting; 0 where it was never seen
  home_moves_since_seen  moves  since then, at the home's rate; 1 where it was never seen
  own_moves_since_seen  moves  since then, at its own rate; 1 where it was never seen
  any_moved  probability  that any thing has moved in the last step, as far as questions ask that
  crossing  share  of the moves that lead to another room
  moves  count  moves in the home
  miss_rate  probability  that a look misses what is there
stays
  log_home_left_rate  rate  at which things of the home were found gone
  log_left_rate  rate  at which this thing was found gone
  num_left_anywhere  count  looks that found it gone, at all places
  left_since_last_seen  moves  since its latest sighting, at the rate at which it was found gone
  unplaced  share  what stays.per_known_look of all places lacks to 1; 1 where it was never seen
  num_sought  count  times it was asked for and then looked for where it was seen last
  still_there  share  of these, it was still there
trust
  has_prior  0 or 1  the prior says anything of the thing
  known_share  share  of the things of the home, those of a type that the prior knows
  num_placed  count  places at which a thing of a known type was seen
  prior_lift  nats  by which the prior gives these more than an even guess, on average
  found  share  of the questions asked, those after which it was found
  last_right  share  of these, it was where it had been seen last
  common_right  share  of these, it was where it had been seen most
  prior_right  share  of these, it was where the prior says
words
  is_known  0 or 1  the prior knows the thing's type
  name_cosine  cosine  of its name to the nearest that the prior knows
  most_by_name  share  of the best place by such names
  similar_known  count  things of similar names in this home, by how alike they are
  most_similar  ratio  likeness of the name that is most alike
object
  was_seen  0 or 1  it was ever seen
  num_seen  count  its sightings at all places
  num_seen_places  count  places where it was seen
  entropy  nats  of its sightings by place
  most  share  of its sightings at the place of most of them
  most_prior  share  of the best place by the prior
  is_usual_last  share  it was seen last where it was seen most
  absent_at_last  count  looks that missed it where it was seen last
  same_name  count  sightings of other things of this name
  log_room_size  log  of the number of places in the room where it was seen last
  room_fraction  share  of the home's places, those in that room; 1 where it was never seen
  most_believed  probability  of the best place by filters.belief_asked
  elsewhere  probability  of no place at all by filters.belief_asked
lately
  changes_minutes  count  changes found in the home, e times less after 10 minutes
  changes_hours  count  the same, after an hour
  changes_days  count  the same, after a day
  rate_minutes  log  of changes for each look, both counted so for 10 minutes
  rate_hours  log  the same, for an hour
  rate_days  log  the same, for a day
  hours_since_moved  hours  since this thing was found moved, 10,000 at most
  moved_lately  ratio  exp(-h) of these hours
  asks_moved  share  of the questions that are about what has just moved
elsewhere
  log_belief_learnt  log share  of elsewhere, by filters.belief_learnt
  log_belief_asked  log share  of elsewhere, by filters.belief_asked
  log_belief_left  log share  of elsewhere, by filters.belief_left
  log_belief_anywhere  log share  of elsewhere, by filters.belief_anywhere
  log_belief_rule  log share  of elsewhere, by the rule of `sgm.evidence.elsewhere`
  looked  share  of where it goes, what was looked at since its latest sighting
  places  share  of the home's places, the same
  rounds  count  looks since then, on average over where it goes
  missing  share  of the things of the home, those that no place is known to hold
  is_carried  0 or 1  people carry such things
copies
  most_things  log  of the most things of its type that homes have
  most_alike  log  of these for each name
  num_places_now  count  places that are known to hold it now
  double_share  share  of the things of the home, those known at several places
hour
  has_clock  0 or 1  it is known what time it is
  hour_sine  ratio  sine of the hour of the day
  hour_cosine  ratio  cosine of the hour of the day
  away_at_this_hour  share  of its sightings at this hour, those away from its usual place
  gone_at_this_hour  share  of the looks at this hour where it was seen last, those that missed it
week
  in_at_this_hour  ratio  looks at this hour of the week that showed it, by those that should
  home_in_at_this_hour  ratio  the same, of all things of the home
"""


def _read(table: str) -> Iterator[EvidenceColumn]:
    """Read the rows of a table."""
    group = ""
    for line in table.strip().splitlines():
        if line.startswith(" "):
            name, unit, text = line.strip().split("  ")
            yield EvidenceColumn(group=group, name=name, unit=unit, text=text)
        else:
            group = line


def _group(columns: tuple[EvidenceColumn, ...]) -> dict[str, tuple[str, ...]]:
    """Return the names of each group."""
    names: dict[str, tuple[str, ...]] = {}
    for column in columns:
        names[column.group] = (*names.get(column.group, ()), column.name)
    return names


# In the order of the last axis of `Features`.
COLUMNS_OF_PLACES, COLUMNS_OF_QUESTIONS = tuple(_read(_OF_PLACES)), tuple(_read(_OF_QUESTIONS))
PLACE_GROUP_COLUMNS = _group(COLUMNS_OF_PLACES)
QUESTION_GROUP_COLUMNS = _group(COLUMNS_OF_QUESTIONS)
PLACE_COLUMNS = tuple(f"{column.group}.{column.name}" for column in COLUMNS_OF_PLACES)
QUESTION_COLUMNS = tuple(f"{column.group}.{column.name}" for column in COLUMNS_OF_QUESTIONS)
# What only a home with a clock can say.
CLOCK_GROUPS = ("hours", "hour", "week")
