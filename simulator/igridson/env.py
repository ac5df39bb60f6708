"""The grid home as a Gymnasium environment on MiniGrid: iGridson-v0."""

from __future__ import annotations

import string
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import pygame
from gymnasium import spaces
from minigrid.core.constants import COLOR_NAMES, COLOR_TO_IDX, COLORS, OBJECT_TO_IDX
from minigrid.core.grid import Grid
from minigrid.core.mission import MissionSpace
from minigrid.core.world_object import Door, Wall, WorldObj
from minigrid.minigrid_env import MiniGridEnv
from minigrid.utils.rendering import fill_coords, point_in_rect

from sgm.checks import check_at_least
from sgm.messages import shorten
from sgm.policies.heuristics import Bayesian
from sgm.policies.policy import Policy
from sgm.prior.prior_graph import PriorGraph
from simulator.gym.place_rows import PLACE_COLUMNS, compute_place_rows
from simulator.gym.reset_options import reads_new_home
from simulator.igridson.drawing import HomePicture
from simulator.igridson.find_object import make_homes
from simulator.igridson.layout import GridLayout
from simulator.igridson.layout_file import load_layout
from simulator.igridson.navigation import DIRECTIONS, Routes
from simulator.igridson.scene import GridPlacement, GridScene, list_things
from simulator.tasks.rollout import Rollout
from simulator.tasks.search import Search
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import Observation
from simulator.world.streams import Streams


class GridAction(IntEnum):
    """What the agent can do; the first three as MiniGrid numbers them."""

    left = 0
    right = 1
    forward = 2
    look = 3


class FurnitureBlock(WorldObj):
    """A cell of a furniture node: blocks the way, but not the view."""

    def __init__(self, furniture: int, room: int) -> None:
        super().__init__("box", COLOR_NAMES[room % len(COLOR_NAMES)])
        self.furniture = furniture

    def encode(self) -> tuple[int, int, int]:
        """Return MiniGrid's type and colour (the room's), and the furniture index."""
        return OBJECT_TO_IDX["box"], COLOR_TO_IDX[self.color], self.furniture

    def render(self, r: np.ndarray) -> np.ndarray:
        """Fill a tile of MiniGrid's own pictures, such as the agent's view, with the colour."""
        return fill_coords(r, point_in_rect(0.04, 0.96, 0.04, 0.96), COLORS[self.color])


class IGridsonEnv(MiniGridEnv):
    """Find Object in a grid home: walk to furniture, face it, look.

    An episode is one search. Every reset lets the home evolve by one step and asks for another
    object; the agent goes on from where it stands. A new home is drawn by `reset(seed=...)`, by
    `reset(options={"new_home": True})` and after `queries_per_home` searches.

    Actions: turn left, turn right, one step forward, look at the furniture in front (any of its
    cells). A look is an attempt; a second one at a place shows the same and changes nothing. The
    search succeeds when the furniture looked at truly holds the object, and ends without success
    after `attempts` looks.

    Observations, all symbolic:
        image: MiniGrid's view of the 7 x 7 cells ahead, uint8 (7, 7, 3): type, colour (of the
            room), state (furniture index for type "box"). Objects are not in it.
        direction: where the agent faces: right, down, left, up.
        mission: "find the ..." with the description asked for.
        position: (column, row).
        query: number of the description asked for.
        looked: furniture looked at in this step, counted from 1; 0 for none.
        seen: what was detected there, int8 (D, 2) by description and relation;
            each object is missed with probability 0.25.

    Reward: 1 - 0.9 steps / max_steps on success, as in MiniGrid, else 0.

    Attributes:
        layout, routes: the grid.
        num_furniture: its furniture nodes, F.
        place_columns: names of what `compute_place_rows` returns.
        rollout: the true home, a batch of one; the memory of what was seen; and who may be asked.
        search: the search that goes on.
        placement: the cell of every object.
        belief: probability per furniture node that pictures show, or None, (F,).
        looked_at: furniture looked at in this episode, in order.
        trail: cells walked over in this episode.

    Source: paper section 4.1 "iGridson" and appendix F.
    """

    place_columns = (*PLACE_COLUMNS, "steps", "ahead", "aside", "is_faced")
    metadata = {  # noqa: RUF012 - an instance variable in Gymnasium's typing
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,
    }

    def __init__(
        self,
        layout: GridLayout | str | Path | None = None,
        prior: PriorGraph | None = None,
        queries_per_home: int = 100,
        attempts: int = 10,
        max_steps: int = 500,
        tile_size: int = 40,
        shows_all: bool = True,
        render_mode: str | None = None,
    ) -> None:
        """Load the layout.

        Args:
            layout: a layout or the path of its file; None for the shipped home.
            prior: what homes look like; None for the shipped prior.
            queries_per_home: searches before a new home is drawn.
            attempts: looks per search.
            max_steps: actions after which a search is truncated.
            tile_size: pixels per cell in pictures.
            shows_all: whether pictures show every object, or only what lies on furniture that
                was looked at in this search.
            render_mode: "human", "rgb_array" or None.

        Raises:
            ValueError: if the layout is broken or a count is below 1.
        """
        check_at_least(1, queries_per_home=queries_per_home, attempts=attempts, max_steps=max_steps)
        self.layout = layout if isinstance(layout, GridLayout) else load_layout(layout)
        self.routes = Routes(self.layout)
        self.num_furniture = len(self.layout.furniture)
        self.queries_per_home = queries_per_home
        self.attempts = attempts
        self.shows_all = shows_all
        self.belief: np.ndarray | None = None
        self._prior = PriorGraph.default() if prior is None else prior
        self._policy: Callable[[SampledHomes], Policy] = _make_bayesian
        self._picture: HomePicture | None = None
        self._is_moving = False
        self.trail = [self.layout.start]
        self.looked_at: list[int] = []
        self._window: pygame.Surface | None = None
        self._frame_clock: pygame.time.Clock | None = None  # of the window
        columns, rows = self.layout.size
        super().__init__(
            MissionSpace(mission_func=_name_mission),
            width=columns,
            height=rows,
            max_steps=max_steps,
            render_mode=render_mode,
            tile_size=tile_size,
        )
        self._sample_home(home_seed=0)  # for the number of descriptions; replaced on reset
        self._wants_new_home = True
        num_codes = self.homes.object_descriptions.num_descriptions
        self.action_space = spaces.Discrete(len(GridAction))
        assert isinstance(self.observation_space, spaces.Dict)
        self.observation_space = spaces.Dict(
            {
                **self.observation_space.spaces,
                "mission": spaces.Text(max_length=200, charset=string.printable),
                "position": spaces.Box(
                    np.zeros(2), np.array([columns - 1, rows - 1]), dtype=np.int64
                ),
                "query": spaces.Discrete(num_codes),
                "looked": spaces.Discrete(self.num_furniture + 1),
                "seen": spaces.MultiBinary([num_codes, 2]),
            }
        )

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy in this or another process has: all but the window."""
        return {**self.__dict__, "_window": None, "_frame_clock": None}

    def set_policy(self, make: Callable[[SampledHomes], Policy]) -> None:
        """Let a policy that is made of the homes be asked from the next search on, in a new one."""
        self._policy = make
        self._wants_new_home = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the next search; see the class for when it is in a new home.

        Raises:
            ValueError, TypeError: if the options are others than `new_home`.
        """
        if reads_new_home(options) or seed is not None:
            self._wants_new_home = True
        observation, _ = super().reset(seed=seed)
        return observation, self._get_info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Turn, walk or look.

        Raises:
            ValueError: if there is no such action.
        """
        if action not in self.action_space:
            raise ValueError(
                f"action must be one of {', '.join(f'{a.value} {a.name}' for a in GridAction)}, "
                f"got {shorten(action)}. Choose one of these."
            )
        before = self.position
        self._looked = -1
        if action == GridAction.look:
            self.step_count += 1
            self._look()
            observation = self.gen_obs()
        else:
            self._is_moving = True
            observation, *_ = super().step(action)
            self._is_moving = False
        if self.position != before:
            self.trail.append(self.position)
        self._pose = (self.position, int(self.agent_dir))
        if self.render_mode == "human":
            self.render()
        is_over = bool(self.search.is_over[0])
        reward = float(self._reward()) if self.is_found else 0.0
        is_truncated = self.step_count >= self.max_steps and not is_over
        return observation, reward, is_over, is_truncated, self._get_info()

    @property
    def position(self) -> tuple[int, int]:
        """(column, row) of the agent."""
        return int(self.agent_pos[0]), int(self.agent_pos[1])

    @property
    def homes(self) -> Homes:
        """The true home, a batch of one."""
        return self.rollout.homes

    @property
    def is_found(self) -> bool:
        """Whether a look of this episode went to furniture that holds the object."""
        return bool(self.search.is_found[0])

    @property
    def path_length(self) -> int:
        """Steps walked in this episode."""
        return len(self.trail) - 1

    @property
    def is_looking(self) -> bool:
        """Whether the last action was a look at furniture."""
        return self._looked >= 0

    def gen_obs(self) -> dict[str, Any]:
        """Return what the agent perceives."""
        seen = np.zeros((self.homes.object_descriptions.num_descriptions, 2), dtype=np.int8)
        if self.is_looking:
            look = self._seen_at[self._looked]
            seen[look.seen_code, look.seen_relation] = 1
        return {
            **super().gen_obs(),
            "direction": int(self.agent_dir),
            "position": np.array(self.position, dtype=np.int64),
            "query": int(self.search.codes[0]),
            "looked": self._looked + 1,
            "seen": seen,
        }

    def action_masks(self) -> np.ndarray:
        """Return which actions change anything, bool (4,), as MaskablePPO asks for it."""
        x, y = (int(c) for c in self.front_pos)
        ahead = int(self.layout.furniture_at[y, x])
        is_new = ahead >= 0 and bool(self.search.is_open[0, ahead])
        return np.array([True, True, bool(self.layout.is_free[y, x]), is_new])

    def compute_place_rows(self) -> np.ndarray:
        """Return what is remembered of each furniture node, and where it is, float32 (F, D).

        To the columns of `simulator.gym.place_rows` come the steps to it, how far ahead it is and
        how far to the right, as shares of the longer side of the grid, and whether it is faced.
        """
        (known,) = compute_place_rows(self.rollout.memory, self.search.queries)  # (F, 6)
        cell = self.routes.find_cell(self.position)
        size = max(self.layout.size)
        across, down = (self.routes.cells[self.routes.stand[cell]] - self.position).T / size
        x, y = DIRECTIONS[int(self.agent_dir)]
        front_x, front_y = (int(c) for c in self.front_pos)
        where = [
            self.routes.to_furniture[cell] / size,
            across * x + down * y,
            down * x - across * y,
            self.layout.furniture_at[front_y, front_x] == np.arange(self.num_furniture),
        ]
        return np.column_stack([known, *where]).astype(np.float32)

    def get_scene(self) -> GridScene:
        """Return what a picture of this moment shows."""
        things = list_things(self.homes, self.placement, int(self.search.codes[0]))
        if not self.shows_all:
            furniture_at = self.layout.furniture_at
            things = tuple(
                t for t in things if furniture_at[t.cell[1], t.cell[0]] in self.looked_at
            )
        return GridScene(
            position=self.position,
            direction=int(self.agent_dir),
            things=things,
            trail=tuple(self.trail),
            looked_at=tuple(self.looked_at),
            is_found=self.is_found,
            belief=self.belief,
            title=self.mission,
            note=f"look {len(self.looked_at)} of {self.attempts}, {self.path_length} steps",
        )

    def get_frame(
        self, highlight: bool = True, tile_size: int = 40, agent_pov: bool = False
    ) -> np.ndarray:
        """Draw the home, uint8 (height, width, 3); the agent's own view is MiniGrid's."""
        if agent_pov:
            return self.get_pov_render(tile_size)
        if self._picture is None or self._picture.tile != tile_size:
            self._picture = HomePicture(self.layout, tile_size)
        return self._picture.draw(self.get_scene())

    def render(self) -> np.ndarray | None:
        """Return a picture, or show it in a window, as `render_mode` says."""
        if self.render_mode is None or self._is_moving:
            return None  # MiniGrid shows a picture in the middle of a step
        frame = self.get_frame(tile_size=self.tile_size)
        if self.render_mode == "rgb_array":
            return frame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((frame.shape[1], frame.shape[0]))
            self._frame_clock = pygame.time.Clock()
            pygame.display.set_caption("iGridson")
        self._window.blit(pygame.surfarray.make_surface(frame.transpose(1, 0, 2)), (0, 0))
        pygame.event.pump()
        assert self._frame_clock is not None
        self._frame_clock.tick(self.metadata["render_fps"])
        pygame.display.flip()
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            pygame.display.quit()
        self._window = None

    def _gen_grid(self, width: int, height: int) -> None:
        """Let the home evolve, ask the next query, and set up the cells."""
        if self._wants_new_home or self._num_queries >= self.queries_per_home:
            self._sample_home(int(self.np_random.integers(2**31)))
        self.search = Search(self.rollout, *self.rollout.ask(), self.attempts)
        self.placement.update(self.homes)
        self._num_queries += 1
        query = self.homes.object_descriptions.text(int(self.search.codes[0]))
        self.mission = f"find the {query}"
        self.agent_pos, self.agent_dir = self._pose
        self.trail = [self.position]
        self.looked_at = []
        self._looked = -1
        self._seen_at: dict[int, Observation] = {}  # by furniture
        self.grid = Grid(width, height)
        for y in range(height):
            for x in range(width):
                self.grid.set(x, y, self._make_cell(x, y))

    def _make_cell(self, x: int, y: int) -> WorldObj | None:
        """Return MiniGrid's content of a cell; doors stand open."""
        layout = self.layout
        furniture = int(layout.furniture_at[y, x])
        if furniture >= 0:
            return FurnitureBlock(furniture, int(layout.room[y, x]))
        if layout.is_wall[y, x]:
            return Wall()
        return Door("grey", is_open=True) if layout.is_door[y, x] else None

    def _sample_home(self, home_seed: int) -> None:
        homes = make_homes(self._prior, self.layout, Streams(home_seed, "test", [0]))
        self.rollout = Rollout(homes, self._policy(homes))
        self.placement = GridPlacement(self.layout, self.homes)
        self._num_queries = 0
        self._pose = (self.layout.start, 0)
        self._wants_new_home = False

    def _look(self) -> None:
        """Look at the furniture in front, if there is some."""
        ahead = self.grid.get(*(int(c) for c in self.front_pos))
        if not isinstance(ahead, FurnitureBlock):
            return
        self._looked = ahead.furniture
        self.looked_at.append(ahead.furniture)
        seen = self.search.look(np.zeros(1, dtype=np.int64), np.array([ahead.furniture]))
        self._seen_at.setdefault(ahead.furniture, seen)

    def _get_info(self) -> dict[str, Any]:
        return {
            "is_found": self.is_found,
            "num_looks": len(self.looked_at),
            "path_length": self.path_length,
        }


def _make_bayesian(homes: SampledHomes) -> Policy:
    return Bayesian()


def _name_mission() -> str:
    return "find the object"
