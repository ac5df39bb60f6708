"""The page in a real browser: ask, move the slider, click, read what it says."""

import re

import pytest

pytest.importorskip("selenium", reason="selenium is not installed")

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from nep.view.saved_page import save_page

pytestmark = pytest.mark.slow

WAIT_S = 60  # a busy machine is not a failure


def wait_for(browser, is_so):
    """Wait until a condition holds, and return what it gave."""
    return WebDriverWait(browser, WAIT_S).until(lambda driver: is_so())


def read_rows(browser, where):
    """Cells of all rows of the tables in an element."""
    return browser.execute_script(
        "return [...document.querySelectorAll(arguments[0] + ' tbody tr')]"
        ".map(row => [...row.children].map(cell => cell.textContent))",
        where,
    )


def read(browser, where):
    return browser.find_element(By.CSS_SELECTOR, where).text


def ask(browser, words):
    """Type a question, as a person does."""
    box = browser.find_element(By.ID, "words")
    box.send_keys(Keys.CONTROL, "a")
    box.send_keys(words, Keys.ENTER)


def click_map(browser, x, y):
    """Click at a point of the map, given in its own coordinates."""
    at = browser.execute_script(
        "const plot = document.querySelector('#map-a .js-plotly-plot') ||"
        " document.querySelector('#map-a');"
        "const {xaxis, yaxis} = plot._fullLayout, box = plot.getBoundingClientRect();"
        "return [box.left + xaxis._offset + xaxis.d2p(arguments[0]),"
        " box.top + yaxis._offset + yaxis.d2p(arguments[1])]",
        x, y,
    )  # fmt: skip
    ActionChains(browser).move_by_offset(*map(round, at)).pause(0.3).click().perform()
    ActionChains(browser).move_by_offset(*(-round(value) for value in at)).perform()


def test_ask_move_and_click(browser, serve, desk):
    browser.get(serve(desk))
    wait_for(browser, lambda: read(browser, "#events"))
    assert read(browser, "h1") == "my home"

    ask(browser, "the red mug")
    rows = wait_for(browser, lambda: read_rows(browser, "#answer-a"))
    assert rows[0][1:] == ["counter top in kitchen, on top", "seen here in this step; prior 60%"]
    # What is seen in this step is there with 97 % (`Corrections.seen_now`); all parts sum to one.
    shares = [float(row[0][:-1]) for row in rows if row[0].endswith("%")]
    assert shares[0] == 97.0
    assert sum(shares) == pytest.approx(100, abs=0.3)
    assert rows[3][1] == "elsewhere"
    assert "looked at counter top in kitchen: saw red mug" in read(browser, "#events")

    thumb = browser.find_element(By.CSS_SELECTOR, "#step [role=slider]")
    for _ in range(6):
        thumb.send_keys(Keys.ARROW_LEFT)
    wait_for(browser, lambda: read(browser, "#time") == "step 0")
    wait_for(browser, lambda: read_rows(browser, "#answer-a")[0][1] == "desk in study, on top")
    assert "saw red mug, laptop" in read(browser, "#events")

    wait_for(browser, lambda: browser.find_elements(By.CSS_SELECTOR, "#map-a .scatterlayer"))
    plan = desk.stage.get_plan(0)
    click_map(browser, *plan.centre[2])
    wait_for(browser, lambda: "desk in study" in read(browser, "#furniture"))
    rows = read_rows(browser, "#furniture")
    assert ["red mug", "there", "step 0", "0", "1 of 1"] in rows
    assert ["step 0", "saw red mug, laptop"] in rows

    browser.find_element(By.ID, "play").click()
    wait_for(browser, lambda: read(browser, "#time") == "step 6")
    wait_for(browser, lambda: ["step 5", "saw laptop"] in read_rows(browser, "#furniture"))

    outside = browser.execute_script(
        "return performance.getEntriesByType('resource').map(entry => entry.name)"
        ".filter(name => !name.startsWith(location.origin) && !name.startsWith('data:'))"
    )
    assert outside == []


def test_two_answers_side_by_side_and_a_bad_question(browser, serve, desk):
    browser.get(serve(desk, "laptop"))
    wait_for(browser, lambda: read_rows(browser, "#answer-a"))
    browser.find_element(By.ID, "judge-b").click()
    options = wait_for(
        browser,
        lambda: [
            option
            for option in browser.find_elements(By.CSS_SELECTOR, "[role=option]")
            if option.text.strip() == "last_seen_prior"
        ],
    )  # fmt: skip
    options[0].click()
    wait_for(browser, lambda: "says last_seen_prior" in read(browser, "#answer-b"))
    assert "says bayesian" in read(browser, "#answer-a")
    ask(browser, "<b>butter</b>")
    wait_for(browser, lambda: "white fridge" in read(browser, "#answer-a"))
    ask(browser, "___")
    wait_for(browser, lambda: "must" in read(browser, "#answer-a .problem"))


def test_a_click_on_an_object_draws_its_history(browser, serve, desk):
    browser.get(serve(desk))
    wait_for(browser, lambda: browser.find_elements(By.CSS_SELECTOR, "#map-a .scatterlayer"))
    plan, memory = desk.stage.get_plan(6), desk.stage.story.memory_at(6)
    edges = memory.batch.edges
    milk = memory.descriptions.index("milk")
    seen = [row for row in range(len(edges)) if edges["num_true"][row]]
    spots = plan.list_spots(edges["furniture"][seen] * 2 + edges["relation"][seen])
    spot = next(at for at, row in zip(spots, seen, strict=True) if edges["object"][row] == milk)
    click_map(browser, *spot)
    wait_for(browser, lambda: "milk" in read(browser, "#history"))
    assert "white fridge in kitchen" in read(browser, "#history")


def test_a_zoom_stays(browser, serve, desk):
    def get_width():
        return browser.execute_script(
            "const plot = document.querySelector('#map-a .js-plotly-plot');"
            "const {range} = plot._fullLayout.xaxis; return range[1] - range[0]"
        )

    browser.get(serve(desk))
    area = wait_for(browser, lambda: browser.find_elements(By.CSS_SELECTOR, "#map-a .nsewdrag"))[0]
    wait_for(browser, lambda: read(browser, "#events"))
    before = get_width()
    wheel = ScrollOrigin.from_element(area)
    for _ in range(3):  # a tenth each
        ActionChains(browser).scroll_from_origin(wheel, 0, -400).pause(1).perform()
    zoomed = wait_for(browser, lambda: get_width() < 0.85 * before and get_width())
    ask(browser, "laptop")
    wait_for(browser, lambda: read_rows(browser, "#answer-a"))
    assert get_width() == pytest.approx(zoomed, rel=0.05)


def test_a_saved_page_needs_no_server(browser, desk, tmp_path):
    page = tmp_path / "page.html"
    save_page(desk, ["red mug", "milk"], page)
    text = page.read_text("utf-8")
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=", text)
    browser.get(page.as_uri())
    rows = wait_for(browser, lambda: read_rows(browser, "#answer-a"))
    assert rows[0][1] == "counter top in kitchen, on top"
    browser.find_element(By.ID, "step").send_keys(Keys.HOME)
    wait_for(browser, lambda: read(browser, "#time") == "step 0")
    assert read_rows(browser, "#answer-a")[0][1] == "desk in study, on top"
    browser.find_element(By.CSS_SELECTOR, "#words option:nth-child(2)").click()
    wait_for(browser, lambda: "milk" in read(browser, "#answer-a h3"))
    click_map(browser, *desk.stage.get_plan(6).centre[2])
    wait_for(browser, lambda: "desk in study" in read(browser, "#furniture"))
