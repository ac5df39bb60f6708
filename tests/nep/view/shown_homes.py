"""Homes that the page is looked at with: in metres, large, and after ten days of looks."""

from datetime import datetime

import numpy as np

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from sgm.layout.box import Box
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.memory_event import read_events
from simulator import SceneGraphMemory, Sighting
from simulator.story.past_memory import PastMemory

CLOCK = Clock(datetime(2026, 11, 16, 7), 3600.0)
DOORS = [(4.1, 2.0), (2.0, 4.1), (5.6, 4.1), (8.6, 4.1)]
# Corners of floors; furniture with the middle and size of its box, or a point where it is.
ROOMS = {
    "kitchen": [(0, 0), (4, 0), (4, 4), (0, 4)],
    "living room": [(4.2, 0), (10, 0), (11, 1), (11, 3), (10, 4), (4.2, 4)],
    "bedroom": [(0, 4.2), (4, 4.2), (4, 8), (0, 8)],
    "bathroom": [(4.2, 4.2), (7, 4.2), (7, 8), (4.2, 8)],
    "study": [(7.2, 4.2), (11, 4.2), (11, 8), (7.2, 8)],
}
COUNTER = [(0, 0), (3.2, 0), (3.2, 0.6), (0.6, 0.6), (0.6, 2.4), (0, 2.4)]
FURNITURE = [
    ("kitchen", "fridge", Box((0.4, 3.6, 0.9), (0.7, 0.7, 1.8), interior="door")),
    ("kitchen", "counter", Box.of_polygon(COUNTER, 0, 0.9)),
    ("kitchen", "kitchen table", Box((2.5, 2.2, 0.4), (1.4, 0.8, 0.8))),
    ("living room", "sofa", Box((7.0, 0.5, 0.4), (2.2, 0.9, 0.8))),
    ("living room", "coffee table", Box((7.0, 1.8, 0.2), (1.1, 0.6, 0.4))),
    ("living room", "armchair", Box((9.3, 1.6, 0.4), (0.8, 0.8, 0.8), yaw=0.7)),
    ("living room", "tv stand", Box((7.0, 3.75, 0.3), (1.6, 0.4, 0.5))),
    ("living room", "shelf", (10.3, 3.0)),
    ("bedroom", "bed", Box((1.1, 6.9, 0.3), (2.0, 1.8, 0.6))),
    ("bedroom", "left night stand", Box((0.3, 5.6, 0.3), (0.4, 0.4, 0.5))),
    ("bedroom", "right night stand", Box((2.4, 7.7, 0.3), (0.4, 0.4, 0.5))),
    ("bedroom", "wardrobe", Box((3.6, 6.0, 1.0), (0.6, 1.8, 2.0), interior="door")),
    ("bathroom", "sink", Box((4.6, 6.5, 0.4), (0.5, 0.6, 0.8))),
    ("bathroom", "washing machine", Box((6.6, 7.6, 0.4), (0.6, 0.6, 0.8), interior="door")),
    ("bathroom", "laundry basket", None),
    ("study", "desk", Box((9.2, 7.6, 0.4), (1.6, 0.7, 0.8))),
    ("study", "bookshelf", Box((10.8, 6.0, 1.0), (0.35, 1.8, 2.0), interior="open")),
    ("study", "chair", (9.2, 6.8)),
]  # fmt: skip
THINGS = """red mug;blue mug;kettle;bread;milk;butter;knife;cutting board;phone;laptop;charger;keys;
wallet;glasses;newspaper;remote control;blanket;cushion;book;notebook;pen;scissors;tape;towel;soap;
toothbrush;toothpaste;shirt;socks;jacket;umbrella;bag;camera;headphones;plant;vase;candle;bowl;plate;
<script>alert(1)</script>""".replace("\n", "").split(";")


def make_flat(folder, num_steps=30, looks_per_step=2, seed=0):
    """Return the log of a robot that patrols a flat of five rooms."""
    path = folder / "looks.sgm"
    memory = SceneGraphMemory(clock=CLOCK, path=path)
    rooms = {name: memory.add_room(name) for name in ROOMS}
    for name, corners in ROOMS.items():
        memory.add_furniture("floor", rooms[name], box=Box.of_polygon(corners, -0.1, 0))
    places = []
    for room, name, at in FURNITURE:
        where = {"box": at} if isinstance(at, Box) else {"position": at}
        places.append(memory.add_furniture(name.split()[-1], rooms[room], name, **where))
    rng, stands = np.random.default_rng(seed), memory.layout.compute_positions()
    at = rng.choice(places, len(THINGS))
    turn = 0
    for _ in range(num_steps):
        moved = rng.random(len(THINGS)) < 0.04
        at[moved] = rng.choice(places, moved.sum())
        for _ in range(looks_per_step):
            place = places[turn % len(places)]
            turn += 1
            look(memory, place, stands[place], at == place, rng)
        memory.step()
    look(memory, places[2], stands[places[2]], at == places[2], rng)
    memory.save(folder / "home.sgm")
    return path


def look(memory, place, stand, is_there, rng):
    """Look at furniture from where one stands, missing a tenth."""
    own = np.flatnonzero(is_there & (rng.random(len(THINGS)) < 0.9))
    box = memory.boxes.get(place)
    relation = "in" if box is not None and box.interior != "none" else "onTop"
    viewpoint = None
    if box is not None and stand is not None:
        yaw = float(np.arctan2(box.center[1] - stand[1], box.center[0] - stand[0]))
        viewpoint = Viewpoint(*stand, 1.2, yaw, 1.2, 4.0)
    seen = [Sighting(THINGS[thing], relation) for thing in own]
    memory.observe(place, seen, viewpoint=viewpoint)


def make_large_home(folder, num_rooms=100, num_steps=60, num_things=2000, seed=0):
    """Return the log of ten days in a home of many rooms with eight pieces of furniture each."""
    path = folder / "looks.sgm"
    memory = SceneGraphMemory(clock=CLOCK, path=path)
    kinds = ["office", "kitchen", "bedroom", "living room", "bathroom"]
    names = ["desk", "shelf", "cabinet", "table", "sofa", "bed", "counter", "chair"]
    wide = int(np.ceil(np.sqrt(num_rooms * 1.6)))
    for number in range(num_rooms):
        x, y = 5.4 * (number % wide), 4.4 * (number // wide)
        room = memory.add_room(kinds[number % len(kinds)])
        floor = [(x, y), (x + 5.2, y), (x + 5.2, y + 4.2), (x, y + 4.2)]
        memory.add_furniture("floor", room, box=Box.of_polygon(floor, -0.1, 0))
        for piece, name in enumerate(names):
            centre = (x + 0.8 + 1.2 * (piece % 4), y + 0.6 + 3.0 * (piece // 4), 0.4)
            box = Box(centre, (0.9, 0.8, 0.8))
            memory.add_furniture(name, room, f"{name} {number}", box=box)
    rng, stands = np.random.default_rng(seed), memory.layout.compute_positions()
    places = [n for n, node in memory.layout.furniture.items() if node.label != "floor"]
    at = rng.choice(places, num_things)
    turn = 0
    for _ in range(num_steps):
        moved = rng.random(num_things) < 0.002
        at[moved] = rng.choice(places, moved.sum())
        for _ in range(10):
            place = places[turn % len(places)]
            turn += 7
            stand = stands[place]
            seen = [Sighting(f"thing {thing}") for thing in np.flatnonzero(at == place)]
            memory.observe(place, seen, viewpoint=Viewpoint(*stand, 1.2, 0.5, 1.2, 2.0))
        memory.step(4)
    return path


def open_desk(path, doors=()):
    """Return answers about a log, by a policy that needs no network."""
    desk = Desk(
        Stage(lambda: PastMemory(read_events(path), path.parent.name), doors=doors), Judges()
    )
    desk.judges.names = ["bayesian", "last_seen_prior"]
    return desk
