"""The page to play with, in Chromium: its numbers are those of Python, to the bit, its digests those of the library.

`make site-test` runs it, with selenium and ziglang of the group `site`, and Debian's chromium and chromium-driver.
"""

import importlib.util
import re
import shutil
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform._export import selftest
from hopform._robots import Provenance
from hopform.hopping._commands import OUTCOMES

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "play"
MISSING = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
MISSING += [name for name in ("selenium", "ziglang") if importlib.util.find_spec(name) is None]
browser = pytest.mark.skipif(bool(MISSING), reason=f"the page is not opened: {', '.join(MISSING)} absent")
pytestmark = pytest.mark.site

COLUMNS = ("ground", "touchdown_time", "v2", "u", "duration", "apex", "aed")
"""Columns of a run's table that the page shows too."""
SHOWN = dict(zip(COLUMNS, (1, 2, 3, 4, 7, 8, 9), strict=True))

MODULE = """
const text = document.getElementById("wasm").textContent.trim();
const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const done = arguments[arguments.length - 1];
WebAssembly.instantiate(bytes, {}).then(({instance: {exports: c}}) => {
  const view = (name, length) => new Float64Array(c.memory.buffer, c[`play_${name}`].value, length);
  const all = (name, length) => Array.from(view(name, length), String);
"""
"""Opens the module anew, without the page's program; numbers are passed on as text, for the sake of NaN."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    spec = importlib.util.spec_from_file_location("play", PAGE / "build.py")
    assert spec is not None and spec.loader is not None
    play = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(play)
    return play.build(tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for argument in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "window-size=1300,2200"):
        options.add_argument(f"--{argument}")
    options.add_argument("--force-prefers-reduced-motion")
    options.add_experimental_option(
        "prefs", {"download.default_directory": str(tmp_path_factory.getbasetemp() / "downloads")}
    )
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    found = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    yield found
    found.quit()


@pytest.fixture
def page(driver, built):
    """Opens the page with a state; at the end nothing may stand on the browser's console."""

    def opened(**state):
        driver.get("about:blank")
        driver.get(f"{built.as_uri()}#{urlencode(state)}")
        wait(lambda: driver.find_element("css selector", "html").get_attribute("data-ready") == "yes")
        return driver

    yield opened
    assert driver.get_log("browser") == []


def wait(holds, seconds=10.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def values(driver):
    """The numbers of the table of hops, by column of a run's table."""
    rows = driver.execute_script(
        "return [...document.querySelectorAll('#hops-table tbody tr')].map(r => [...r.cells].map(d => d.dataset.value))"
    )
    return {name: [float(row[place]) for row in rows] for name, place in SHOWN.items()}


def write(driver, name, value):
    driver.execute_script(
        "const e = document.getElementById(arguments[0]); e.value = arguments[1];e.dispatchEvent(new Event('change'));",
        name,
        value,
    )


def compare(found, run):
    assert len(found["u"]) == len(run.hops) > 0
    for name in COLUMNS:
        np.testing.assert_array_equal(found[name], run.table[name], err_msg=name)


@browser
def test_the_digests_are_those_of_the_native_library(page):
    rows = page().execute_script(
        "return [...document.querySelectorAll('#digests tbody tr')].map(r => [...r.cells].map(d => d.textContent))"
    )
    expected = {"f32": f"{selftest('float32'):08x}", "f64": f"{selftest('float64'):08x}"}
    assert rows == [[name, digest, digest, "yes"] for name, digest in expected.items()]


@browser
@pytest.mark.parametrize(
    ("robot", "state"),
    [
        ("hopper_c", {"size": 0.03, "seed": 7, "hops": 40}),
        ("hopper_b", {"h_des": 0.12, "terrain": "steps", "size": 0.02}),
        ("hopper_c", {"mode": "constant", "u": 3, "height": 0.1, "terrain": "steps", "size": -0.02}),
        ("ideal", {"mode": "constant", "u": 0, "hops": 5}),
        ("hopper_c", {"mode": "constant", "u": 1.2, "height": 0.05}),
        ("hopper_c", {"wrong": 5, "terrain": "flat"}),
        ("hopper_c", {"wrong": -12.5, "size": 0.04, "seed": 3, "travel": 0.11}),
        ("hopper_c", {"mode": "constant", "u": -3.5, "terrain": "flat"}),
        ("hopper_c", {"h_des": 0.4, "terrain": "flat", "hops": 4}),
        ("hopper_c", {"mode": "constant", "u": 0, "height": 0.5, "k": 150, "terrain": "flat", "hops": 2}),
    ],
    ids=str,
)
def test_a_run_has_the_bits_of_python(page, robot, state):
    driver = page(robot=robot, **state)
    found, hopper = values(driver), hopform.load_robot(robot)
    hopper = replace(hopper, **{name: float(state[name]) for name in ("travel", "k") if name in state})
    constant, wrong = state.get("mode") == "constant", state.get("wrong", 0.0)
    model = replace(hopper, gamma2=hopper.gamma2 * (1.0 + wrong / 100.0)) if wrong else None
    controller = state["u"] if constant else hopform.hopping.controllers.FeedForward(state.get("h_des", 0.2))
    count = state.get("hops", 12)
    terrain = [*found["ground"], *[found["ground"][-1]] * (count - len(found["ground"]))]
    run = hopform.hopping.simulate(
        hopper, terrain, controller, height=state.get("height", 0.2), errors=hopform.hopping.Errors(model=model)
    )
    compare(found, run)
    shown = "return [...document.querySelectorAll('#warnings li')].map(e => e.textContent)"
    assert driver.execute_script(shown) == list(run.warnings)
    count, ends = len(run.hops), driver.find_element("id", "status").text
    assert ends.startswith(f"{OUTCOMES[run.status].format(count, '' if count == 1 else 's')}, {run.duration:.5g} s")
    highest = hopform.choose_current(hopper, v2=run.hops[0].touchdown.v2, h_des=0.4)
    words = f"desired apex not reached in {count} of {count} hops"
    assert (words in ends) == (state.get("h_des") == 0.4 != highest.apex)


@browser
def test_samples_of_a_run_are_those_of_python(page, hopper_c):
    terrain = [0.0, 0.02, -0.01]
    numbers = page().execute_async_script(
        MODULE + "view('robot', arguments[0].length).set(arguments[0]); view('terrain', 3).set(arguments[1]);"
        "c.play_run(0.2, 1, 0.2, 3, 0); const end = view('duration', 1)[0];"
        "c.play_sample(0, end, 501); done([String(end), all('samples', 501 * 15)]); });",
        [getattr(hopper_c, field.name) for field in hopform.Robot.fields()], terrain,
    )  # fmt: skip
    run = hopform.hopping.simulate(hopper_c, terrain, hopform.hopping.controllers.FeedForward(0.2), height=0.2)
    assert float(numbers[0]) == run.duration
    t, x1, v1, x2, v2, foot, ground, u, y, spring, motor, body, energy, predicted, hop = (
        np.array(numbers[1], float).reshape(501, 15).T
    )
    inside = t <= run.duration
    assert inside.sum() >= 500
    at = run.at(t[inside])
    for column, expected in ((x1, at.x1), (v1, at.v1), (x2, at.x2), (v2, at.v2)):
        np.testing.assert_array_equal(column[inside], expected)
    np.testing.assert_array_equal(foot[inside], run.foot(t[inside]))
    np.testing.assert_array_equal(ground[inside], run.ground(t[inside]))
    np.testing.assert_array_equal(u[inside], run.current(t[inside]))
    by_state = hopper_c.m_s * (at.v2**2 / 2.0 + hopper_c.g * at.x2)
    np.testing.assert_allclose(body[inside], by_state, rtol=0, atol=1e-13)
    # Python sums the ledger once over all times, the page from the start to each: some roundings of 20 J.
    np.testing.assert_allclose(energy[inside], run.energy(t[inside]).body, rtol=0, atol=1e-13)
    np.testing.assert_allclose(predicted[inside], run.aed(t[inside]), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(spring, hopper_c.k * y)
    np.testing.assert_array_equal(motor, -hopper_c.gamma2 * u)
    assert set(hop) == {0.0, 1.0, 2.0, 3.0}
    assert y.max() > 0.05 and (y[foot > ground] == 0.0).all()


@browser
def test_the_map_is_the_reachability_of_python(page, hopper_c):
    heights, currents = np.linspace(0.01, 0.3, 12), np.array([0.0, 1.0, 2.0, 3.0])
    apex, admissible, lowest, highest = page().execute_async_script(
        MODULE + "view('robot', arguments[0].length).set(arguments[0]); view('heights', 12).set(arguments[1]);"
        "view('currents', 4).set(arguments[2]); c.play_reach(12, 4);"
        "done([all('apex', 48), all('admissible', 48), all('lowest', 12), all('highest', 12)]); });",
        [getattr(hopper_c, field.name) for field in hopform.Robot.fields()], heights.tolist(), currents.tolist(),
    )  # fmt: skip
    reach = hopform.reachability(hopper_c, heights, currents)
    # Touchdown velocities: a square root there, a solved flight here, apart by some units in the last place.
    np.testing.assert_allclose(np.array(apex, float).reshape(12, 4), reach.apex, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(np.array(admissible, float).reshape(12, 4), reach.admissible)
    np.testing.assert_allclose(np.array(lowest, float), reach.lowest, rtol=0, atol=1e-9)  # `nearest` is within 1e-9 m
    np.testing.assert_allclose(np.array(highest, float), reach.highest, rtol=0, atol=1e-9)


@browser
def test_a_robot_file_is_loaded_saved_and_kept_in_the_address(page, tmp_path, tmp_path_factory):
    own = tmp_path / "own.toml"
    fit = Provenance(("m_s",), (3.25,), (3.2,), (3.3,), ((1e-4,),), (), "hopper_c", True)
    own.write_text(replace(hopform.load_robot("hopper_c"), m_s=3.25, travel=0.15, fit=fit).to_toml(), "utf-8")
    driver = page(mode="constant", u=3)
    driver.find_element("id", "load").send_keys(str(own))
    wait(lambda: "m_s=3.25" in driver.current_url)
    found = values(driver)
    robot = hopform.load_robot(own)
    compare(found, hopform.hopping.simulate(robot, found["ground"], 3.0, height=0.2))
    driver.find_element("id", "save").click()
    saved = tmp_path_factory.getbasetemp() / "downloads" / "mine.toml"
    wait(saved.exists)
    assert hopform.load_robot(saved).parameters == robot.parameters
    assert hopform.load_robot(saved).travel == robot.travel == 0.15
    address = driver.current_url
    write(driver, "m_s", "3.5")
    wait(lambda: "m_s=3.5" in driver.current_url)
    assert values(driver)["apex"] != found["apex"]
    driver.get("about:blank")
    driver.get(address)
    wait(lambda: driver.find_element("css selector", "html").get_attribute("data-ready") == "yes")
    assert values(driver) == found


@browser
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("m_s = 3\nm_z = 4\n", "line 2: unknown parameter m_z"),
        ("k = soft\n", "line 1: k must be a number"),
        ("", "m_eff is"),
    ],
    ids=["unknown", "no number", "missing"],
)
def test_a_bad_robot_file_is_refused_by_name_and_line(page, tmp_path, text, message):
    bad = tmp_path / "bad.toml"
    bad.write_text(text, "utf-8")
    driver = page()
    driver.find_element("id", "load").send_keys(str(bad))
    wait(lambda: message in driver.find_element("id", "status").text)
    assert "bad.toml" in driver.find_element("id", "status").text


@browser
@pytest.mark.parametrize("name", ["robot", "terrain", "mode", "window"])
def test_a_word_of_the_address_that_is_in_no_list_is_left_out(page, name):
    """Names that every object of the language has are no robots, and no grounds."""
    plain = values(page())
    for word in ("toString", "__proto__", "constructor"):
        driver = page(**{name: word})
        assert values(driver) == plain
        assert name not in driver.current_url or driver.find_element("id", name).get_attribute("value") != word


@browser
def test_a_parameter_out_of_its_domain_is_refused_by_name_and_limit(page):
    driver = page(k=-1)
    assert driver.find_element("id", "status").text == "No run: k must be > 0 N/m, got -1.0."
    assert values(driver)["u"] == []


@browser
def test_everything_is_done_by_keyboard_and_has_a_name(page):
    from selenium.webdriver import ActionChains, Keys

    driver = page()
    nameless = driver.execute_script(
        "return [...document.querySelectorAll('input, select, button')].filter(e => !(e.labels?.length"
        " || e.ariaLabel || e.textContent.trim())).map(e => e.outerHTML)"
    )
    assert nameless == []
    reached = []
    for _ in range(60):
        ActionChains(driver).send_keys(Keys.TAB).perform()
        reached.append(driver.execute_script("return document.activeElement.id"))
    named = {"mode", "h_des-range", "h_des", "terrain", "robot", "load", "save", "k", "play", "time-range", "travel"}
    assert named <= set(reached)
    assert reached[:3] == ["skip", "play", "time-range"]
    driver.find_element("id", "skip").send_keys(Keys.ENTER)
    assert driver.execute_script("return document.activeElement.id") == "mode"
    wanted = driver.find_element("id", "h_des-range")
    wanted.send_keys(Keys.ARROW_RIGHT)
    wait(lambda: "h_des=0.205" in driver.current_url)
    np.testing.assert_allclose(values(driver)["apex"], 0.205, rtol=0, atol=1e-9)


@browser
def test_it_stands_still_where_motion_is_unwanted_and_plays_at_a_button(page):
    driver = page(size=0)
    at = lambda: driver.find_element("id", "time").get_attribute("value")  # noqa: E731
    assert at() == "0.0000"
    time.sleep(0.2)
    assert at() == "0.0000"
    driver.find_element("id", "play").click()
    wait(lambda: float(at()) > 0.05)
    driver.find_element("id", "play").click()
    stopped = at()
    time.sleep(0.2)
    assert at() == stopped


@contextmanager
def screen(driver, width, height=844):
    """A telephone, where the controls are a drawer, or a screen."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        yield
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


STATES = (
    {"mode": "constant", "u": 3.5},
    {"mode": "constant", "u": 0.75, "terrain": "flat", "hops": 3, "start": "touchdown"},
    {"h_des": 0.4, "hops": 40, "seed": 3},
)
"""Runs with many curves, with the longest names of events, and with the longest words and numbers of hops."""


@browser
@pytest.mark.parametrize("state", STATES, ids=str)
@pytest.mark.parametrize("width", [320, 390, 768, 1280])
def test_nothing_is_wider_than_the_window(page, driver, width, state):
    """Of a telephone, a tablet and a screen, the controls open: nothing scrolls sideways, no table is cut, and legends
    stay in their pictures.
    """
    with screen(driver, width):
        page(**state)
        driver.execute_script("document.querySelectorAll('details').forEach(each => { each.open = true; })")
        assert driver.execute_script("return document.scrollingElement.scrollWidth") <= width
        scrolled = driver.execute_script(
            "return [...document.querySelectorAll('body *')].filter(e => e.scrollWidth > e.clientWidth + 1"
            " && ['auto', 'scroll', 'hidden', 'clip'].includes(getComputedStyle(e).overflowX) && e.clientWidth"
            " && !e.matches('svg, svg *, input, select')).map(e => e.outerHTML.slice(0, 80))"
        )
        assert scrolled == []
        cut = driver.execute_script(
            "const cut = e => e.scrollWidth > e.clientWidth + 1 || e.getBoundingClientRect().right > innerWidth;"
            "return [...document.querySelectorAll('td')].filter(e => cut(e)).map(e => e.textContent)"
        )
        assert cut == []
        assert len(values(driver)["u"]) > 2
        beyond = driver.execute_script(
            "return [...document.querySelectorAll('svg')].flatMap(svg => [...svg.querySelectorAll('text')].filter(t =>"
            "t.getBoundingClientRect().right > svg.getBoundingClientRect().right + 1).map(t => t.textContent))"
        )
        assert beyond == []
        assert driver.execute_script("return document.getElementById('time-range').clientWidth") > 150


@browser
@pytest.mark.parametrize("width", [390, 1280])
def test_each_value_of_a_hop_stands_beside_its_heading(page, driver, width):
    """In the head of the table, or in the card where the table would be cut."""
    with screen(driver, width):
        page(hops=2)
        heads, cells, shown = driver.execute_script(
            "const of = tag => [...document.querySelectorAll(`#hops-table ${tag}`)];"
            "const text = e => getComputedStyle(e, '::before').content;"
            "return [of('th').map(e => e.textContent), of('tbody tr').map(r => [...r.cells].map(e => text(e))),"
            "of('thead')[0].getBoundingClientRect().width > 300]"
        )
        assert len(heads) == 11 and "apex [m]" in heads
        assert shown == (width == 1280)
        assert cells == [["none"] * 11 if shown else [f'"{head}"' for head in heads]] * 2


FOOT = """
const foot = document.querySelector('#scene .foot').getBoundingClientRect();
const scene = document.getElementById('scene').getBoundingClientRect();
const under = [...document.querySelectorAll('#scene .ground')].map(e => e.getBoundingClientRect())
  .find(e => e.left <= foot.left + foot.width / 2 && foot.left + foot.width / 2 < e.right);
return [foot.width, foot.height, scene.bottom - foot.bottom, under.top - foot.bottom];
"""
"""Width and height of the drawn foot, how far it is above the picture's lower edge and above the ground, in pixels."""


@browser
@pytest.mark.parametrize("width", [390, 1280])
def test_the_foot_is_drawn_and_stands_on_the_ground_in_stance(page, driver, width):
    with screen(driver, width):
        page(terrain="flat", start="drop")
        wide, tall, inside, above = driver.execute_script(FOOT)
        assert wide > 20 and tall > 4 and inside > 0
        assert above > 30  # at the drop
        page(terrain="flat", start="touchdown")
        wide, tall, inside, above = driver.execute_script(FOOT)
        assert wide > 20 and tall > 4 and inside > 0
        assert abs(above) < 1.5  # the outline of the ground


@browser
def test_a_telephone_shows_the_hopper_first_and_keeps_it_in_sight(page, driver):
    edges = "const b = document.querySelector('#scene .body').getBoundingClientRect(); return [b.top, b.bottom]"
    with screen(driver, 390):
        page()
        top, bottom = driver.execute_script(edges)
        assert 0.0 < top < bottom < 844 / 2
        assert not driver.find_element("id", "mode").is_displayed()
        driver.find_element("css selector", "#drawer > summary").click()
        assert driver.find_element("id", "mode").is_displayed()
        driver.execute_script("document.getElementById('hops').scrollIntoView()")
        assert driver.execute_script("return scrollY") > 100
        top, bottom = driver.execute_script(edges)
        assert 0.0 <= top < bottom < 844 / 2
        stage = driver.execute_script("return document.getElementById('stage').getBoundingClientRect().bottom")
        assert driver.execute_script("return document.getElementById('hops').getBoundingClientRect().top") >= stage
    with screen(driver, 1280):
        page()
        assert driver.find_element("id", "k").is_displayed()


@browser
def test_an_example_sets_what_it_names(page):
    driver = page()
    for words, asked, event in (
        ("stick-slip", "u=0.75", "x1_sticks"), ("5 % model error", "wrong=5", ""), ("rough", "", ""),
    ):  # fmt: skip
        driver.find_element("partial link text", words).click()
        wait(lambda asked=asked: driver.current_url.partition("#")[2].count(asked) > 0 or not asked)
        driver.execute_script("document.getElementById('time-range').focus()")
        assert len(values(driver)["u"]) > 2
        assert not event or event in driver.find_element("id", "events-table").text
    wait(lambda: driver.current_url.endswith("#"))
    np.testing.assert_allclose(values(driver)["apex"], 0.2, rtol=0, atol=1e-9)


@browser
def test_the_first_example_starts_at_touchdown(page):
    """Its playback, too, and again after its end; the other examples start at the drop."""
    driver = page()
    time_of = lambda: float(driver.find_element("id", "time").get_attribute("value"))  # noqa: E731
    assert time_of() == 0.0
    first, *others = driver.find_elements("css selector", "#examples a")
    first.click()
    wait(lambda: time_of() > 0.0)
    (touchdown, *_) = values(driver)["touchdown_time"]
    assert time_of() == round(touchdown, 4)
    assert driver.find_element("id", "start").get_attribute("value") == "touchdown"
    assert "start=touchdown" in driver.current_url
    write(driver, "time", "1e9")
    write(driver, "speed", "0.01")  # from the drop it would take 20 s
    driver.find_element("id", "play").click()
    wait(lambda: touchdown - 1e-4 <= time_of() < touchdown + 0.5)
    driver.find_element("id", "play").click()
    for other in others:
        other.click()
        wait(lambda: time_of() == 0.0)


@browser
def test_where_playback_starts_is_chosen(page):
    driver = page()
    time_of = lambda: float(driver.find_element("id", "time").get_attribute("value"))  # noqa: E731
    for start in ("touchdown", "drop"):
        write(driver, "start", start)
        wait(lambda start=start: (time_of() > 0.0) == (start == "touchdown"))
    assert time_of() == 0.0
    write(driver, "time", "0.3")
    write(driver, "u", "1")
    assert time_of() == 0.3  # a change of the robot or the task moves no time


@pytest.mark.skipif("ziglang" in MISSING, reason="the page is not built: ziglang is absent")
def test_a_page_alone_links_to_no_file_and_has_its_version_and_licence(built):
    text = built.read_text("utf-8")
    links = re.findall(r'(?:href|src)="([^"]*)"', text)
    assert len(links) > 3 and [link for link in links if not link.startswith(("#", "data:"))] == []
    assert f"<footer><p>hopform {hopform.__version__}, MIT licence." in text
    assert (ROOT / "LICENSE").read_text("utf-8") in text


def test_the_page_has_no_physics_in_its_program():
    """Of the functions of numbers it takes those that scale, round and draw ground."""
    used = set(re.findall(r"Math\.(\w+)", (PAGE / "play.js").read_text("utf-8")))
    assert used <= {"min", "max", "floor", "ceil", "round", "log10", "imul"}
    names = {field.name for field in hopform.Robot.fields()} - {"c"}
    text = re.sub(r"//.*", "", (PAGE / "play.js").read_text("utf-8"))
    assert set(re.findall(r"parameters\.(\w+)", text)) & names == {"L0", "u_max"}  # to scale a picture, to end a slider


def luminance(colour):
    parts = (int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5))
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


def test_text_and_curves_stand_out_in_light_and_dark():
    """WCAG 2: 4.5 for text, 3 for what is drawn, on paper and on what is shaded."""
    css = (PAGE / "play.css").read_text("utf-8")
    found = {name: (light, dark) for name, light, dark in re.findall(r"--(\w+): light-dark\((#\w+), (#\w+)\)", css)}
    assert len(found) == 11
    for mode in (0, 1):
        for front, back, least in (
            *((name, back, 4.5) for name in ("ink", "accent") for back in ("paper", "panel")),
            *((name, "stance", 3.0) for name in ("first", "second", "third", "fourth", "ink")),
            *((name, "held", 3.0) for name in ("first", "second", "third", "ink")),
        ):
            low, high = sorted((luminance(found[front][mode]), luminance(found[back][mode])))
            assert (high + 0.05) / (low + 0.05) >= least, (front, back, mode)


@browser
def test_pictures_follow_where_the_address_cannot_be_written(page):
    """As in Safari after 100 changes in 30 s."""
    driver = page(terrain="flat", hops=2)
    driver.execute_script("history.replaceState = () => { throw new DOMException('insecure', 'SecurityError'); };")
    before = values(driver)["u"]
    write(driver, "h_des", "0.25")
    wait(lambda: values(driver)["u"] != before)
    wait(lambda: driver.find_element("id", "h_des").get_attribute("value") == "0.25")
