import os

import pytest

# No window opens in tests.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

SMALL = """iGridson layout 1
rooms
k kitchen
b bedroom
map
#########
#kkk#bbb#
#kkk+bbb#
#kkk#bbb#
#########
furniture
1 1  1x1  fridge
1 3  2x1  counter top
7 1  1x3  bed
start
2 2
"""


@pytest.fixture
def small_text() -> str:
    """Two rooms of 3 x 3 cells with three furniture nodes."""
    return SMALL


@pytest.fixture(scope="session")
def home():
    from simulator.igridson.layout_file import load_layout

    return load_layout()


@pytest.fixture
def make_env():
    import gymnasium

    import simulator.igridson

    made = []

    def make(**options):
        env = gymnasium.make(simulator.igridson.ENV_ID, **options).unwrapped
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()
