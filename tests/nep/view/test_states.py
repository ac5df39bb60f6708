"""Six states of the page, each photographed and held to what a reader needs.

`pytest tests/nep/view/test_states.py --basetemp shots` leaves the pictures in the folder `shots`.
"""

from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("selenium", reason="selenium is not installed")

from nep.view.__main__ import main
from tests.nep.view.page_driver import find, open_page, read, read_answer, run_on_map, wait_for
from tests.nep.view.page_driver import resize as set_size
from tests.nep.view.shown_homes import DOORS, THINGS, make_flat, make_large_home, open_desk

pytestmark = pytest.mark.slow

WIDE = (1400, 1000)
IS_DRAWN = "return map.canvas.width === map.canvas.clientWidth"
LIST_MISPLACED = """
    const isOn = (label, [left, top, right, bottom]) =>
        label.left + 5 < right && left + 5 < label.left + label.width
        && label.top + 5 < bottom && top + 5 < label.top + label.height;
    const isPiece = row => map.plan.furniture[row].name !== 'floor';
    const isSmall = ([left, top, right, bottom]) => right - left < 24 && bottom - top < 24;
    const isFree = label => isSmall(map.bounds[label.row]) && label.text.includes("%");
    return map.labels.filter(label => label.row !== undefined && !isFree(label)
        && map.bounds.some((box, row) => row !== label.row && isPiece(row) && isOn(label, box)))
        .map(label => label.text);
"""


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    """A flat in metres after thirty hours."""
    return open_desk(make_flat(tmp_path_factory.mktemp("flat")), DOORS)


def check_page(browser, path, size):
    """What holds in every state; takes the picture."""
    set_size(browser, *size)
    wait_for(browser, lambda: browser.execute_script("return innerWidth") == size[0])
    wait_for(browser, lambda: run_on_map(browser, IS_DRAWN))
    browser.save_screenshot(str(path))
    assert path.stat().st_size > 20_000
    wide = browser.execute_script("return document.documentElement.scrollWidth")
    assert wide <= size[0]  # no horizontal scrollbar
    labels = run_on_map(
        browser,
        "return [...map.labels, ...map.stops.map(stop => stop.box)]"
        ".map(box => [box.left, box.top, box.left + box.width, box.top + box.height])",
    )
    boxes = np.array(labels).reshape(-1, 4)
    overlaps = [
        (one, other)
        for one, other in combinations(boxes, 2)
        if (np.maximum(one[:2], other[:2]) < np.minimum(one[2:], other[2:])).all()
    ]
    assert overlaps == []
    # A name of furniture stands on no other piece, where it would be taken for its name.
    assert run_on_map(browser, LIST_MISPLACED) == []
    width, height = run_on_map(browser, "return [view.width, view.height]")
    assert (boxes[:, :2] >= 0).all()
    assert (boxes[:, 2] <= width).all()
    assert (boxes[:, 3] <= height).all()
    rows = read_answer(browser)
    assert rows[0][1] == "elsewhere"
    assert (
        browser.execute_script(
            "return document.querySelectorAll('.answer .is-elsewhere .track i').length"
        )
        == 1
    )
    return run_on_map(browser, "return map.labels.map(label => label.text)")


def check_scale(browser, desk, step):
    """Boxes and floors have on the screen the shape that they have in metres, by one scale."""
    memory = desk.stage.story.memory_at(step)
    drawn = run_on_map(
        browser,
        "return map.shapes.map(points => points.map(point => view.toHome(point)))",
    )
    scale = run_on_map(browser, "return view.scale")
    pixels = run_on_map(browser, "return map.shapes")
    for node, number in enumerate(memory.furniture_ids):
        box = memory.boxes.get(number)
        if box is None:
            continue
        np.testing.assert_allclose(drawn[node], box.corners, atol=0.002)
        sides = np.linalg.norm(np.diff(np.array(pixels[node]), axis=0), axis=1)
        own = np.linalg.norm(np.diff(box.corners, axis=0), axis=1)
        np.testing.assert_allclose(sides, scale * own, atol=0.002 * scale)


def read_changes(browser):
    """Rows of the list of changes: kind, thing, how sure, places, between which looks."""
    return browser.execute_script(
        "return [...document.querySelectorAll('#changes button')]"
        ".map(row => [...row.children].map(cell => cell.textContent))"
    )


def check_changes(browser, desk, step):
    """The list is what the memory says has changed."""
    memory = desk.stage.story.memory_at(step)
    changes = memory.changes(0)
    assert len(changes) > 5
    rows = read_changes(browser)
    assert len(rows) == min(len(changes), 300)
    for row, change in zip(rows, changes, strict=False):
        sure = f"{100 * round(change.probability, 4):.{1 if change.probability < 0.1 else 0}f}%"
        assert row[:3] == [change.kind, change.thing, sure]
        for place in (change.from_place, change.to_place):
            assert place is None or memory.describe(place) in row[3]
        for time in (change.after, change.time):
            if time is not None:
                date = memory.clock.get_time(time)
                assert f"{date:%a} {date.day} {date:%b %H:%M}" in row[4]


def test_demo(browser, tmp_path, monkeypatch):
    monkeypatch.setattr("nep.view.page_state.list_shipped", list)  # no seconds for torch
    monkeypatch.setattr("nep.view.page_state.POLICIES", ("bayesian",))
    page = tmp_path / "page.html"
    main(["routine", "--steps", "40", "--ask", "small phone", "--save", str(page)])
    set_size(browser, *WIDE)
    open_page(browser, page.as_uri())
    labels = check_page(browser, tmp_path / "demo.png", WIDE)
    furniture = run_on_map(browser, "return map.plan.furniture.map(own => own.name)")
    assert len(furniture) == 24
    said = {label.partition("% ")[2] or label for label in labels}
    assert {"kitchen", "living room", "bedroom", "bathroom"} <= said
    assert len(said & set(furniture)) >= 20  # there is room for almost all
    assert read(browser, "#time") == "Mon 6 May 20:00"
    for axis in ("axis", "history"):
        ticks = browser.execute_script(
            "return [...document.getElementById(arguments[0]).querySelectorAll('.major, .minor')]"
            ".map(text => text.textContent)",
            axis,
        )
        assert "Mon 6 May" in ticks
        assert "12:00" in ticks


def test_metres(browser, serve, flat, tmp_path):
    set_size(browser, *WIDE)
    open_page(browser, serve(flat, "phone"))
    labels = check_page(browser, tmp_path / "metres.png", WIDE)
    check_scale(browser, flat, 30)
    check_changes(browser, flat, 30)
    assert len(labels) >= 20
    # The way of the search goes through doors: none of its parts leads from room to room else.
    ways = run_on_map(browser, "return map.shown.answer.search.ways")
    assert all(list(map(float, door)) in [list(at) for at in DOORS] for way in ways for door in way)
    assert any(ways)
    # A name that looks like markup is a text, and nothing of it has run.
    script = THINGS[-1]
    assert browser.execute_script(
        "return map.things.flat().some(thing => thing.name === arguments[0])".replace(
            "map.", "document.getElementById('map-a').homeMap."
        ),
        script,
    )
    find(browser, "words").clear()
    find(browser, "words").send_keys(script, "\n")
    wait_for(browser, lambda: read(browser, "#answer-a h3").startswith(script))
    wait_for(browser, lambda: read(browser, "#history h3") == script)
    assert browser.execute_script("return document.querySelectorAll('script').length") == 2


def test_a_change_leads_to_when_and_where_it_was(browser, serve, flat, tmp_path):
    set_size(browser, *WIDE)
    open_page(browser, serve(flat, "phone"))
    changes = flat.stage.story.memory_at(30).changes(0)
    number, change = next(
        (n, one) for n, one in enumerate(changes) if one.kind == "moved" and one.time < 25
    )
    before = read_changes(browser)
    browser.execute_script(
        "document.querySelectorAll('#changes button')[arguments[0]].click()", number
    )
    date = flat.stage.story.clock.get_time(change.time)
    wait_for(browser, lambda: read(browser, "#time") == f"{date:%a} {date.day} {date:%b %H:%M}")
    wait_for(browser, lambda: read(browser, "#history h3") == change.thing)
    name = flat.stage.story.memory_at(30).describe(change.to_place)
    wait_for(browser, lambda: name in read(browser, "#furniture"))
    assert run_on_map(browser, "return map.shown.change.thing") == change.thing
    browser.save_screenshot(str(tmp_path / "change.png"))
    assert read_changes(browser) == before  # the next one is still there to be clicked
    current = browser.execute_script(
        "return [...document.querySelectorAll('#changes button')]"
        ".findIndex(row => row.getAttribute('aria-current') === 'true')"
    )
    assert current == number
    find(browser, "since").send_keys("in 6 hours")
    recent = [one for one in changes if one.time >= 24]
    wait_for(browser, lambda: len(read_changes(browser)) == len(recent))


def test_a_hundred_rooms(browser, serve, tmp_path):
    desk = open_desk(make_large_home(tmp_path))
    set_size(browser, *WIDE)
    open_page(browser, serve(desk, "thing 7"))
    labels = check_page(browser, tmp_path / "rooms.png", WIDE)
    assert run_on_map(browser, "return map.plan.rooms.length") == 100
    rows = desk.answer(240, "thing 7")["rows"]
    likely = [row for row in rows if "furniture" in row and row["p"] > 0.1]
    assert likely
    for place in likely:  # these find room
        share = f"{100 * place['p']:.0f}% "
        assert [label for label in labels if label.startswith(share)], place
    assert len(labels) > 20
    check_scale(browser, desk, 240)
    times = run_on_map(
        browser,
        "return Array.from({length: 21}, () => { map.draw(); return map.drawMs; })"
        ".sort((one, other) => one - other)",
    )
    print(f"a redraw of 100 rooms takes {times[10]:.0f} ms (median), {times[-1]:.0f} at most")
    # Closer, names that found no room are written.
    hidden = run_on_map(browser, "return map.plan.furniture[5].name")
    assert hidden not in labels
    run_on_map(browser, "[view.x, view.y] = map.getMiddle(5); view.zoom(9); map.draw();")
    check_page(browser, tmp_path / "closer.png", WIDE)
    assert hidden in run_on_map(browser, "return map.labels.map(label => label.text)")


def test_after_ten_days(browser, serve, tmp_path):
    desk = open_desk(make_flat(tmp_path, num_steps=240, looks_per_step=3), DOORS)
    set_size(browser, *WIDE)
    open_page(browser, serve(desk, "phone"))
    check_page(browser, tmp_path / "ten_days.png", WIDE)
    check_changes(browser, desk, 240)
    # What has been missing for days is drawn no more; marks of old looks are fainter.
    strengths = run_on_map(
        browser, "return map.things.flat().filter(one => !one.isThere).map(one => one.strength)"
    )
    memory = desk.stage.story.memory_at(240)
    edges = memory.batch.edges
    missing = (edges["num_true"] > 0) & ~edges["is_true"]
    assert 0 < len(strengths) < 0.7 * missing.sum()
    assert min(strengths) > 0.1
    wait_for(browser, lambda: read(browser, "#history h3") == "phone")
    shades = browser.execute_script(
        "const read = (path, kind) => path.getAttribute(`${kind}-opacity`);"
        "return [...document.querySelectorAll('#history path')]"
        ".map(path => Number(read(path, 'stroke') ?? read(path, 'fill')))"
    )
    assert len(shades) <= 12  # one path for all marks of an age
    assert min(shades) < 0.3 * max(shades)


def test_narrow(browser, serve, flat, tmp_path):
    set_size(browser, 360, 740)
    open_page(browser, serve(flat, "phone"))
    labels = check_page(browser, tmp_path / "narrow.png", (360, 740))
    assert len(labels) > 8
    wide = browser.execute_script(
        "return [...document.querySelectorAll('body *')].filter(node => node.offsetParent &&"
        " node.getBoundingClientRect().right > innerWidth && !node.closest('.scroll'))"
        ".map(node => node.outerHTML.slice(0, 80))"
    )
    assert wide == []
    set_size(browser, 360, 3200)
    browser.save_screenshot(str(tmp_path / "narrow_whole.png"))


def read_corner(browser):
    """Colours of the page and of a corner of the map."""
    return browser.execute_script(
        "const pen = document.getElementById('map-a').getContext('2d');"
        "return [getComputedStyle(document.body).backgroundColor,"
        " `rgb(${[...pen.getImageData(3, 3, 1, 1).data].slice(0, 3).join(', ')})`]"
    )


def test_dark(browser, serve, flat, tmp_path):
    scheme = [{"name": "prefers-color-scheme", "value": "dark"}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})
    set_size(browser, *WIDE)
    open_page(browser, serve(flat, "phone"))
    check_page(browser, tmp_path / "dark.png", WIDE)
    assert read_corner(browser) == ["rgb(21, 24, 30)"] * 2
    contrasts = browser.execute_script(
        """
        const light = text => {
          const parts = text.match(/[0-9]+/g).slice(0, 3).map(one => one / 255)
            .map(one => one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4);
          return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2];
        };
        const ground = light(getComputedStyle(document.body).backgroundColor);
        return [...document.querySelectorAll('h1, h2, .answer b, .answer small, #events li, .kind')]
          .map(node => (light(getComputedStyle(node).color) + 0.05) / (ground + 0.05));
        """
    )
    assert min(contrasts) > 4.5  # as the guidelines for readable text ask
    find(browser, "theme").click()
    assert read_corner(browser) == ["rgb(255, 255, 255)"] * 2
