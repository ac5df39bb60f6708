"""Homes that people live in, as a robot sees them: by the minute, with rests, or by the hour."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import Any, Literal

import numpy as np

from sgm.checks import check_choice, check_shares
from sgm.memory.clock import Clock, make_clock_rows
from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.mixture.copies import HomesWithCopies
from simulator.world.mixture.source import EARLIEST, Mixture, MixtureSource, draw_rate
from simulator.world.mixture.views import draw_views
from simulator.world.sessions.dynamics import SessionDynamics
from simulator.world.streams import SPLITS, Streams

PACES = ("minutes", "hours")
# Lengths of steps and of lives, in steps.
_SETTINGS = {
    "minutes": ((30, 60, 120, 300), (30, 100, 300)),
    "hours": ((600, 1200, 1800, 3600, 7200), (30, 100, 300, 1000)),
}
_PAUSES = 400  # that are drawn; then the same again
_ROUND = 12  # places of a home that a robot may look at all in one step, ...
_ROUND_STEPS = 100  # ... where the home is not lived in for longer: more is costly to simulate
_WAKING_HOURS = 16.0
_MOST_MOVES = 3000.0  # a day
_MOST_USES = 5.0  # of an average thing in an hour of a session
_MOST_SESSIONS = 30.0  # a day


class LivedInSource(MixtureSource):
    """Homes of all sizes that people live in, where things move as in homes that were recorded.

    In a share of them things move in sessions (`SessionDynamics`), all rates drawn for each home
    from hardly ever to a busy kitchen. In the others residents have routines. The clock of some is
    hidden. A robot looks at one to three places at a time, or goes its round; where the policy
    answers, on patrol, or at random.

    By minutes, it looks around for some minutes, and rests for minutes to a day. By hours, it looks
    at every step, with a rest now and then. All homes of a group rest at the same steps, which are
    of different lengths. What a home shows only after weeks is learnt from the questions of long
    lives, a tenth of which is kept.
    """

    name = "lived in"
    title = "homes that people live in"
    kept_share = 0.1

    def __init__(
        self,
        prior: PriorGraph | None = None,
        home: HomeConfig | None = None,
        mixture: Mixture | None = None,
        pace: Literal["minutes", "hours"] = "minutes",
        session_share: float = 0.7,
        hidden_share: float = 0.25,
        round_share: float = 0.3,
    ) -> None:
        """Keep the distribution.

        Args:
            prior: what homes look like; None for the prior that ships with the package.
            home: the rules that are not drawn: noise of the prior.
            mixture: sizes, looks, people with routines; None for what goes with the pace.
            pace: lengths of steps and rests.
            session_share: share of the homes where things move in sessions.
            hidden_share: share of the homes whose agents do not know what time it is.
            round_share: share of the homes of up to 12 places, lived in for up to 100 steps, in
                which the robot looks at all places in each step.

        Raises:
            ValueError: if a share is not in [0, 1], or there is no such pace.
        """
        check_choice("pace", pace, PACES)
        shares = {"session": session_share, "hidden": hidden_share, "round": round_share}
        check_shares(**{f"{name}_share": share for name, share in shares.items()})
        if mixture is None:
            mixture = make_mixture(*_SETTINGS[pace])
        super().__init__(prior, home, mixture)
        self.pace, self.shares = pace, shares

    def make(self, streams: Streams) -> HomesWithCopies:
        """Draw homes at t = 0; raises ValueError if the prior has nothing for a room."""
        drawn = [self.draw_home(streams, i) for i in range(len(streams.homes))]
        homes = HomesWithCopies(self.prior, [config for config, _ in drawn], streams)
        homes.clock = make_clock_rows([clock for _, clock in drawn])
        homes.pauses = self.draw_pauses(streams)
        homes.set_views(draw_views(streams, dict(self.mixture.views)))
        return homes

    def draw_home(self, streams: Streams, position: int) -> tuple[HomeConfig, Clock | None]:
        """Draw the rules of the home at a position of the streams, and what time it is there."""
        rng = streams.generator("lived in", position)
        config, clock = self.mixture.draw_home(rng, self.home)
        num_places = sum(config.room_sizes)
        life = self.mixture.draw_num_steps(np.random.default_rng(streams.homes[position]))
        goes_round = rng.random() < self.shares["round"]
        if goes_round and num_places <= _ROUND and life <= _ROUND_STEPS:
            config = replace(config, looks="patrol", looks_per_step=num_places)
        if rng.random() < self.shares["session"]:
            start = EARLIEST + timedelta(
                hours=24 * int(rng.integers(366)) + int(rng.integers(6, 22))
            )
            step_seconds = float(rng.choice(self.mixture.step_seconds))
            num_objects = num_places * config.objects_per_furniture
            dynamics = draw_sessions(rng, start.isoformat(), step_seconds, num_objects)
            config, clock = replace(config, dynamics=dynamics), dynamics.clock
        return config, None if rng.random() < self.shares["hidden"] else clock

    def draw_pauses(self, streams: Streams) -> np.ndarray:
        """Draw how many steps pass before each question, (n,), alike for all homes of a split."""
        rng = np.random.default_rng((streams.seed, SPLITS.index(streams.split)))
        rests = np.ceil(np.exp(rng.uniform(np.log(5), np.log(1500), _PAUSES))).astype(int)
        if self.pace == "hours":
            rests = np.ceil(rests / 50).astype(int)
        is_rest = rng.random(_PAUSES) < 1 / rng.choice((5, 10, 20, 40), _PAUSES)
        return np.where(is_rest, rests, 1)

    def describe(self) -> dict[str, Any]:
        """Return the distribution and the checksum of the prior."""
        settings = {"kept_share": self.kept_share, "pace": self.pace, "shares": self.shares}
        return {**super().describe(), **settings}


def make_mixture(
    step_seconds: tuple[float, ...], lives: tuple[int, ...] = (30, 100, 300)
) -> Mixture:
    """Return the distribution of sizes, looks and people for `LivedInSource`, by lengths."""
    return Mixture(
        routine_share=1.0,
        carrying_share=0.5,
        resettling_share=0.3,
        step_seconds=step_seconds,
        lives=lives,
    )


def draw_sessions(
    rng: np.random.Generator, start_time: str, step_seconds: float, num_objects: int
) -> SessionDynamics:
    """Draw the rules of a home with sessions: from hardly ever to a busy kitchen.

    Ranges are wide, so that they hold what was measured of recorded homes (`results/realism.md`).
    """
    busy_hours = _WAKING_HOURS * float(rng.uniform(0.03, 0.9))  # with a resident about
    minutes = max(draw_rate(rng, 5, 90), 60 * busy_hours / _MOST_SESSIONS)
    most_moves = min(_MOST_MOVES / busy_hours, _MOST_USES * num_objects)
    moves = min(draw_rate(rng, 5, 2500), most_moves)
    back, stay, handed = rng.dirichlet([0.7, 1.5, 1.5]).tolist()
    is_consuming, is_resettling, works = rng.random(3) < 0.5
    return SessionDynamics(
        start_time=start_time,
        step_seconds=step_seconds,
        sessions_per_day=60 * busy_hours / minutes,
        session_minutes=minutes,
        moves_per_hour=moves,
        idle_share=float(rng.uniform(0, 0.15)),
        regular_share=float(rng.uniform()),
        hour_spread=draw_rate(rng, 0.2, 3),
        away_share=float(rng.uniform(0, 0.3)),
        out_hours=draw_rate(rng, 0.5, 10),
        work_share=float(rng.uniform(0.5, 1)) if works else 0.0,
        work_hour=float(rng.normal(8.5, 1.5)),
        work_hours=float(rng.uniform(4, 11)),
        work_spread=draw_rate(rng, 0.05, 1),
        tidy_share=0.7 * float(rng.uniform()) ** 2,
        again_share=0.6 * float(rng.uniform()) ** 2,
        back_share=back,
        stay_share=stay,
        handed_share=handed,
        resettled_share=draw_rate(rng, 0.005, 0.3) if is_resettling else 0.0,
        manner_spread=draw_rate(rng, 0.5, 8),
        use_minutes=draw_rate(rng, 0.5, 120),
        way_share=float(rng.uniform(0.1, 1)),
        way_spread=float(rng.uniform(0, 2)),
        way_next=float(rng.uniform(0.05, 0.7)),
        return_share=float(rng.uniform(0, 0.8)),
        static_share=float(rng.uniform(0, 0.5)),
        favourites=float(rng.uniform(0, 1.2)),
        carried_share=1 - float(rng.uniform()) ** 2,
        consumed_share=draw_rate(rng, 0.002, 0.1) if is_consuming else 0.0,
        restocked_share=float(rng.uniform()),
        restock_days=draw_rate(rng, 0.5, 14),
        missing_share=float(rng.uniform(0, 0.15)),
        gathering=draw_rate(rng, 0.5, 10),
        second_place_share=float(rng.uniform(0, 0.3)),
    )
