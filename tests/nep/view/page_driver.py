"""What tests do with the page in a browser: ask, click, and read what it says."""

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

WAIT_S = 60  # a busy machine is not a failure


def wait_for(browser, is_so):
    """Wait until a condition holds, and return what it gave."""
    return WebDriverWait(browser, WAIT_S).until(lambda driver: is_so())


def read_answer(browser, side="a"):
    """Shares, places and reasons of an answer."""
    return browser.execute_script(
        "return [...document.querySelectorAll(`#answer-${arguments[0]} .answer li`)]"
        ".map(row => [...row.querySelectorAll('b, span:not(.track), small')])"
        ".map(row => row.map(cell => cell.textContent))",
        side,
    )


def read_rows(browser, where):
    """Cells of all rows of the tables in an element."""
    return browser.execute_script(
        "return [...document.querySelectorAll(arguments[0] + ' tbody tr')]"
        ".map(row => [...row.children].map(cell => cell.textContent))",
        where,
    )


def read(browser, where):
    """The text of an element as it is shown; empty if there is none."""
    code = "return (document.querySelector(arguments[0])?.innerText ?? '').trim()"
    return browser.execute_script(code, where)


def find(browser, name):
    return browser.find_element(By.ID, name)


def run_on_map(browser, code, *values):
    """Run a line about the first map: `map` and its `view`."""
    return browser.execute_script(
        "const map = document.getElementById('map-a').homeMap, view = map.viewport;" + code, *values
    )


def ask(browser, words):
    """Type a question, as a person does."""
    find(browser, "words").send_keys(Keys.CONTROL, "a")
    find(browser, "words").send_keys(words, Keys.ENTER)


def click_map(browser, x, y, right=0, down=0):
    """Click at a point of the home, or some pixels from it."""
    browser.execute_script("document.getElementById('map-a').scrollIntoView({block: 'center'})")
    at = run_on_map(
        browser,
        "const box = map.canvas.getBoundingClientRect(), [x, y] = view.toScreen([...arguments]);"
        "return [box.left + x, box.top + y]",
        float(x),
        float(y),
    )
    place = [round(at[0]) + right, round(at[1]) + down]
    ActionChains(browser).move_by_offset(*place).pause(0.2).click().perform()
    ActionChains(browser).move_by_offset(-place[0], -place[1]).perform()


def open_page(browser, address):
    browser.get(address)
    wait_for(browser, lambda: read(browser, "#events") and read(browser, "#changes"))


def resize(browser, width, height):
    """Give the page a size, which may be that of a phone."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
