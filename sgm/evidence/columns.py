"""Names of the features of an answer, by the group that can be switched off."""

from __future__ import annotations

from collections.abc import Mapping

EVIDENCE_VERSION = 3  # raised with every change of the columns or of what they mean


def _list_names(groups: Mapping[str, str]) -> Mapping[str, tuple[str, ...]]:
    """Return the names of each group, which stand between spaces."""
    return {group: tuple(names.split()) for group, names in groups.items()}


PLACE_GROUP_COLUMNS = _list_names(
    {
        "sightings": (
            "num_true share per_look per_look_smooth is_last was_seen share_rank recency_rank "
            "is_usual is_usual_and_away"
        ),
        "looks": (
            "absent_since_seen absent_never_seen looks was_looked_at looks_share is_looked_at_since"
        ),
        "times": (
            "hours_since_seen home_moves_since_seen own_moves_since_seen hours_since_look "
            "home_moves_since_look own_moves_since_look"
        ),
        "stays": "num_left left_since_seen per_known_look presence log_presence",
        "prior": (
            "prior log_prior prior_rank is_possible place_share log_place_share "
            "place_share_rank prior_in_room posterior_0.5 posterior_2 posterior_8"
        ),
        "words": "by_name log_by_name by_name_rank similar_here log_similar_here furniture_cosine",
        "filters": (
            "belief_anywhere log_belief_anywhere belief_in_room log_belief_in_room "
            "belief_learnt log_belief_learnt belief_slow log_belief_slow belief_fast "
            "log_belief_fast belief_moved log_belief_moved belief_moved_in_room "
            "log_belief_moved_in_room belief_asked log_belief_asked belief_left "
            "log_belief_left belief_left_asked log_belief_left_asked belief_rank"
        ),
        "places": "popularity log_popularity arrivals log_arrivals onward log_onward log_back",
        "others": (
            "name_at_label name_at_label_share name_at_label_in_room looks_at_label_in_room "
            "same_name same_name_share companions_now companions_often strays strays_share"
        ),
        "ways": "own alike log_alike label log_label",
        "lately": "changes_minutes changes_hours",
        "rooms": "is_same_room room_share log_room_size",
        "hours": (
            "hour_wide log_hour_wide presence_wide hour_narrow log_hour_narrow "
            "presence_narrow strays_at_hour log_strays_at_hour"
        ),
    }
)
QUESTION_GROUP_COLUMNS = _list_names(
    {
        "size": "log_num_places log_num_rooms num_known sightings_per_object age log_step",
        "movement": (
            "log_home_rate log_own_rate own_moves hours_since_seen home_moves_since_seen "
            "own_moves_since_seen any_moved crossing moves miss_rate"
        ),
        "stays": (
            "log_home_left_rate log_left_rate num_left_anywhere left_since_last_seen unplaced "
            "num_sought still_there"
        ),
        "trust": (
            "has_prior known_share num_placed prior_lift found last_right common_right prior_right"
        ),
        "words": "is_known name_cosine most_by_name similar_known most_similar",
        "object": (
            "was_seen num_seen num_seen_places entropy most most_prior is_usual_last "
            "absent_at_last same_name log_room_size room_fraction most_believed elsewhere"
        ),
        "lately": (
            "changes_minutes changes_hours changes_days rate_minutes rate_hours rate_days "
            "hours_since_moved moved_lately asks_moved"
        ),
        "elsewhere": (
            "log_belief_learnt log_belief_asked log_belief_left log_belief_anywhere "
            "log_belief_rule looked places rounds missing is_carried"
        ),
        "copies": "most_things most_alike num_places_now double_share",
        "hour": "has_clock hour_sine hour_cosine away_at_this_hour gone_at_this_hour",
        "week": "in_at_this_hour home_in_at_this_hour",
    }
)

# Each "group.name", in the order of the last axis of `Features`.
PLACE_COLUMNS = tuple(
    f"{group}.{name}" for group, names in PLACE_GROUP_COLUMNS.items() for name in names
)
QUESTION_COLUMNS = tuple(
    f"{group}.{name}" for group, names in QUESTION_GROUP_COLUMNS.items() for name in names
)
# What only a home with a clock can say.
CLOCK_GROUPS = ("hours", "hour", "week")
