"""A story to show, and a page on it in a real browser, where one is installed."""

import shutil
import threading

import pytest

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from nep.view.server import PageServer
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from simulator.story.past_memory import PastMemory

_FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--window-size=1400,1000"
).split()


@pytest.fixture
def log(tmp_path):
    """A robot's log: a red mug on the desk, gone at step 5, on the counter at step 6."""
    path = tmp_path / "looks.sgm"
    memory = SceneGraphMemory(path=path)
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    fridge = memory.add_furniture("fridge", kitchen, "white fridge")
    counter = memory.add_furniture("counter top", kitchen)
    desk = memory.add_furniture("desk", study)
    memory.observe(fridge, [Sighting("milk", "in"), Sighting("<b>butter</b>", "in")])
    memory.observe(desk, [Sighting("red mug"), Sighting("laptop")])
    memory.step(5)
    memory.observe(desk, [Sighting("laptop")])
    memory.step()
    memory.observe(counter, [Sighting("red mug")])
    memory.save(tmp_path / "home.sgm")
    return path


@pytest.fixture
def desk(log):
    """Answers about that log."""
    desk = Desk(Stage(lambda: PastMemory(read_events(log), "my home")), Judges())
    desk.judges.names = ["bayesian", "last_seen_prior"]  # no seconds for torch
    return desk


@pytest.fixture
def serve():
    """Serve desks until the test ends; returns the address of each page."""
    servers = []

    def run(desk, asked=""):
        server = PageServer(desk, 8050, asked)
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        servers.append((server, thread))
        return server.address

    yield run
    for server, thread in servers:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.fixture
def browser(tmp_path, serve):
    """A headless Chromium, closed before any server; its console may not hold an error."""
    selenium = pytest.importorskip("selenium", reason="selenium is not installed")
    del selenium
    program = shutil.which("chromium") or shutil.which("google-chrome")
    driver_program = shutil.which("chromedriver")
    if program is None or driver_program is None:
        pytest.skip("no browser: Chromium and chromedriver are not installed")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (*_FLAGS, f"--user-data-dir={tmp_path / 'browser'}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver_program))
    yield driver
    said = driver.get_log("browser")
    driver.quit()
    assert [line for line in said if line["level"] == "SEVERE"] == []
