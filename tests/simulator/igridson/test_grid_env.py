import warnings

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from minigrid.core.constants import COLORS, IDX_TO_COLOR, OBJECT_TO_IDX

from simulator.igridson.agent import GridAgent
from simulator.igridson.env import GridAction
from simulator.igridson.find_object import Searcher
from simulator.igridson.scene import GridPlacement
from simulator.policies import make_policy
from simulator.tasks.rollout import make_memory

LEFT, RIGHT, FORWARD, LOOK = GridAction


def check_graph_and_grid_agree(env):
    """Every object lies on its furniture's cells, and the agent stands on free floor."""
    homes, layout = env.homes, env.layout
    for slot in range(homes.num_slots):
        x, y = env.placement.cell[slot]
        furniture = homes.object_furniture[0, slot]
        if furniture < 0:
            assert (x, y) == (-1, -1)
            continue
        assert (x, y) in layout.furniture[furniture].cells
        assert layout.furniture_at[y, x] == furniture
        assert not layout.is_wall[y, x]
        assert env.grid.get(int(x), int(y)).furniture == furniture
    x, y = env.position
    assert layout.is_free[y, x]


@pytest.mark.slow
def test_gymnasium_accepts_the_environment(make_env):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make_env())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_graph_and_grid_agree_after_every_step(make_env, seed):
    env = make_env(max_steps=60)
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    for _ in range(6):
        check_graph_and_grid_agree(env)
        before = env.homes.object_place.copy()
        is_over = False
        while not is_over:
            _, _, terminated, truncated, _ = env.step(rng.choice(4, p=[0.15, 0.15, 0.5, 0.2]))
            is_over = terminated or truncated
            x, y = env.position
            assert env.layout.is_free[y, x]
        assert (env.homes.object_place == before).all()  # static within an episode
        env.reset()
        assert (env.homes.object_place != before).any()


def test_objects_that_do_not_move_keep_their_cells(make_env):
    env = make_env()
    env.reset(seed=2)
    for _ in range(20):
        cell, furniture = env.placement.cell.copy(), env.placement.furniture.copy()
        env.reset()
        stayed = env.homes.object_furniture[0] == furniture
        assert (env.placement.cell[stayed] == cell[stayed]).all()
        assert not stayed.all()
    assert env.homes.is_present.sum() == 21 * 6  # nothing comes or goes


def test_objects_spread_over_the_cells_of_their_furniture(make_env):
    env = make_env()
    env.reset(seed=4)
    fresh = GridPlacement(env.layout, env.homes)
    for furniture, piece in enumerate(env.layout.furniture):
        cells = fresh.cell[fresh.furniture == furniture]
        counts = [(cells == cell).all(axis=1).sum() for cell in piece.cells]
        assert max(counts) - min(counts) <= 1


def play(env, seed, actions):
    """Everything that comes out of an environment."""
    out = [env.reset(seed=seed)]
    for action in actions:
        out.append(env.step(action))
        if out[-1][2] or out[-1][3]:
            out.append(env.reset())
    return out


def test_same_seed_same_course(make_env):
    actions = np.random.default_rng(1).integers(0, 4, 150)
    first, second = play(make_env(), 7, actions), play(make_env(), 7, actions)
    again = play(make_env(), 8, actions)
    for a, b in zip(first, second, strict=True):
        assert a[1:] == b[1:]
        for name, value in a[0].items():
            assert np.array_equal(value, b[0][name])
    assert any(a[0]["mission"] != b[0]["mission"] for a, b in zip(first, again, strict=False))


def test_actions_move_turn_and_look(make_env):
    env = make_env()
    observation, info = env.reset(seed=0)
    assert observation["position"].tolist() == list(env.layout.start) == [11, 4]
    assert (observation["direction"], observation["looked"]) == (0, 0)
    assert info == {"is_found": False, "num_looks": 0, "path_length": 0}
    observation, *_, info = env.step(FORWARD)
    assert observation["position"].tolist() == [12, 4]
    assert info["path_length"] == 1
    observation, *_, info = env.step(LEFT)  # up
    assert observation["direction"] == 3
    observation, *_, info = env.step(LOOK)  # floor ahead: nothing to look at
    assert (observation["looked"], info["num_looks"]) == (0, 0)
    env.step(FORWARD)
    env.step(FORWARD)  # (12, 2), the side table is at (11, 1) and (12, 1)
    observation, *_, info = env.step(FORWARD)  # furniture does not give way
    assert observation["position"].tolist() == [12, 2]
    assert info["path_length"] == 3
    table = env.layout.places.index(("living room", "side table"))
    observation, *_, info = env.step(LOOK)
    assert (observation["looked"], info["num_looks"]) == (table + 1, 1)
    observation, *_ = env.step(RIGHT)
    assert observation["looked"] == 0
    assert not observation["seen"].any()


def test_a_look_sees_a_part_of_what_lies_there(make_env):
    env = make_env()
    num_seen = num_there = 0
    for seed in range(30):
        env.reset(seed=seed)
        for action in (FORWARD, LEFT, FORWARD, FORWARD, LOOK):
            observation, *_ = env.step(action)
        homes, place = env.homes, observation["looked"] - 1
        there = homes.object_furniture[0] == place
        truth = np.zeros_like(observation["seen"])
        truth[homes.object_code[0, there], homes.object_place[0, there] % 2] = 1
        assert (observation["seen"] <= truth).all()
        num_seen += observation["seen"].sum()
        num_there += truth.sum()
    # 25 % are missed: about 200 objects, the standard error is 3 %
    assert num_there > 150
    assert abs(num_seen / num_there - 0.75) < 0.1


def test_reward_and_end(make_env):
    env = make_env(attempts=2, max_steps=500)
    env.reset(seed=0)
    walk = (FORWARD, LEFT, FORWARD, FORWARD)
    for action in walk:
        env.step(action)
    table = env.layout.places.index(("living room", "side table"))
    env.search.answers[0] = np.arange(21) == table
    _, reward, terminated, truncated, info = env.step(LOOK)
    # five actions of at most 500: 1 - 0.9 * 5 / 500
    assert reward == pytest.approx(0.991)
    assert (terminated, truncated, info["is_found"]) == (True, False, True)

    env.reset(seed=0)
    env.search.answers[:] = False
    for action in walk:
        env.step(action)
    assert env.step(LOOK)[1:4] == (0.0, False, False)
    assert env.step(LOOK)[1:4] == (0.0, True, False)  # no attempt is left


def test_truncation(make_env):
    env = make_env(max_steps=3)
    env.reset(seed=0)
    assert [env.step(LEFT)[2:4] for _ in range(3)] == [
        (False, False),
        (False, False),
        (False, True),
    ]


def test_when_a_new_home_is_drawn(make_env):
    env = make_env(queries_per_home=3)
    env.reset(seed=5)
    env.step(FORWARD)
    first = env.homes
    env.reset()
    assert env.homes is first
    assert env.position == (12, 4)  # the agent goes on from where it stands
    env.reset()
    assert env.homes is first
    env.reset()  # the fourth search
    assert env.homes is not first
    assert env.position == env.layout.start
    second = env.homes
    env.reset(options={"new_home": True})
    assert env.homes is not second


def test_observations_are_symbolic_and_need_no_picture(make_env, monkeypatch):
    import simulator.igridson.env as module

    def refuse(*args):
        raise AssertionError("a picture was drawn")

    monkeypatch.setattr(module, "HomePicture", refuse)
    for mode in (None, "rgb_array"):
        env = make_env(render_mode=mode)
        play(env, 0, [FORWARD, LEFT, LOOK] * 5)
    with pytest.raises(AssertionError, match="a picture was drawn"):
        env.render()


def test_views_hold_the_furniture_index(make_env):
    env = make_env()
    env.reset(seed=0)
    for action in (FORWARD, LEFT, FORWARD, FORWARD):
        observation, *_ = env.step(action)
    table = env.layout.places.index(("living room", "side table"))
    ahead = observation["image"][3, 5]  # the agent is at (3, 6) of its view, facing up
    assert ahead.tolist()[0] == 7  # MiniGrid's number of a box
    assert ahead.tolist()[2] == table


def test_minigrid_draws_what_the_agent_sees(make_env):
    env = make_env()
    image = env.reset(seed=0)[0]["image"]
    assert (image[..., 0] == OBJECT_TO_IDX["box"]).any()  # there is furniture in view
    picture = env.get_frame(tile_size=8, agent_pov=True)
    assert picture.shape == (7 * 8, 7 * 8, 3)
    column, row, _ = np.argwhere(image[..., :1] == OBJECT_TO_IDX["box"])[0]
    middle = picture[row * 8 + 4, column * 8 + 4].astype(int)
    color = COLORS[IDX_TO_COLOR[image[column, row, 1]]]
    assert (middle >= color).all()  # cells in view are drawn lighter


@pytest.mark.parametrize("options", [{"attempts": 0}, {"max_steps": 0}, {"queries_per_home": 0}])
def test_bad_options_are_refused(make_env, options):
    (name, value), *_ = options.items()
    with pytest.raises(ValueError, match=f"{name} must be at least 1, got {value}"):
        make_env(**options)


def test_bad_actions_are_refused(make_env):
    env = make_env()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="0 left, 1 right, 2 forward, 3 look, got 4"):
        env.step(4)


def test_another_layout(make_env, small_text, tmp_path):
    path = tmp_path / "small.txt"
    path.write_text(small_text, "utf-8")
    env = make_env(layout=path)
    env.reset(seed=0)
    check_graph_and_grid_agree(env)
    assert env.homes.num_furniture == 3


def test_human_mode_shows_a_window_of_the_pictures_size(make_env):
    env = make_env(render_mode="human")
    env.reset(seed=0)
    env.step(FORWARD)
    window = env._window
    assert window.get_size() == (22 * 40, round((14 + 1.9) * 40))
    env.close()
    env.close()


def test_the_memory_holds_what_the_observations_say(make_env):
    """Whoever keeps a memory of his own from observations alone believes the same."""
    env = make_env(max_steps=5000)
    agent = GridAgent(env, Searcher(lambda homes: make_policy("bayesian", homes)))
    for number in range(8):
        for moment, _ in enumerate(agent.search(seed=3 if number == 0 else None)):
            if (number, moment) == (0, 0):
                own = make_memory(env.homes)
            observation = env.gen_obs()
            if moment == 0:
                own.step()
                codes = np.array([observation["query"]])
            elif env.is_looking:
                codes, relations = np.nonzero(observation["seen"])
            else:
                continue
            home, types = codes * 0, env.homes.object_descriptions.type_of_code[codes]
            if moment == 0:
                own.query(home, codes, types, types)
            else:
                rows = own.ensure_objects(home, codes, types, types)
                place = np.array([observation["looked"] - 1])
                own.observe(place * 0, place, rows, relations)
    assert list_edges(own) == list_edges(env.rollout.memory)
    assert len(list_edges(own)) > 50


def list_edges(memory):
    """What is remembered, in an order that does not depend on when it was first seen."""
    names = ("furniture", "relation", "num_observed", "num_true", "last_observed", "is_true")
    keys = memory.objects["key"][memory.edges["object"]]
    return sorted(zip(keys, *(memory.edges[name] for name in names), strict=True))


def test_a_second_look_shows_the_same_and_is_an_attempt(make_env):
    env = make_env(attempts=3)
    env.reset(seed=0)
    for action in (FORWARD, LEFT, FORWARD, FORWARD):
        env.step(action)
    env.search.answers[:] = False
    first, *_ = env.step(LOOK)
    again, _, is_over, _, info = env.step(LOOK)
    assert first["seen"].any()
    np.testing.assert_array_equal(first["seen"], again["seen"])
    assert (again["looked"], info["num_looks"], is_over) == (first["looked"], 2, False)
    assert env.rollout.memory.furniture_num_observed.sum() == 1
    assert env.step(LOOK)[2]


def test_a_small_home_with_more_attempts_than_places(make_env, small_text, tmp_path):
    path = tmp_path / "small.txt"
    path.write_text(small_text, "utf-8")
    env = make_env(layout=path, attempts=10)
    for travel in (False, True):
        searcher = Searcher(lambda homes: make_policy("priors", homes), is_travel_aware=travel)
        agent = GridAgent(env, searcher)
        for number in range(10):
            for _ in agent.search(seed=1 if number == 0 else None):
                pass
            assert env.is_found
            assert len(env.looked_at) == len(set(env.looked_at)) <= 3
