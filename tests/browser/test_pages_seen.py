"""Every page, opened in a real browser without a network: it draws to scale, plays, fits a phone, and complains of nothing."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.browser.devtools import CHROMIUM, Browser, Tab

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at the pages"),
]

Page = Callable[[str], Path]
Desk = Callable[[str], Tab]
Narrow = Callable[[str, bool], Tab]

PAGES = ("report", "show", "campaign", "online")
ONLINE = pytest.param("online", marks=pytest.mark.slow)
"""Pages like the report's, which take long to open."""
RECORDED, REPRODUCTION = (pytest.param(name, marks=pytest.mark.slow) for name in ("recorded", "reproduction"))

BOXES = """
(() => {
  const box = (e) => { const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
  const seen = (e) => e.textContent.trim() !== "" && e.getBoundingClientRect().width > 0;
  return Array.from(document.querySelectorAll(".figure")).filter((f) => f.data).map((figure) => ({
    name: figure.id,
    box: box(figure),
    plot: box(figure.querySelector(".gl-container > div, .nsewdrag")),
    legend: Array.from(figure.querySelectorAll(".legend text")).filter(seen).map(box),
    words: Array.from(figure.querySelectorAll("text")).filter(seen).map((e) => [e.textContent, box(e)]),
    notes: Array.from(figure.querySelectorAll(".annotation text")).filter(seen).map(box),
  }));
})()
"""

SCENES = """
Array.from(document.querySelectorAll(".figure.scene")).filter((f) => f.data).map((figure) => {
  const scene = figure._fullLayout.scene, drawn = scene._scene, camera = drawn.glplot.cameraParams;
  const times = (m, v) => [0, 1, 2, 3].map((i) => [0, 1, 2, 3].reduce((sum, j) => sum + m[4 * j + i] * v[j], 0));
  const corners = [];
  for (let k = 0; k < 8; k++) {
    const at = ["x", "y", "z"].map((a, i) => scene[a + "axis"].range[(k >> i) & 1] * drawn.dataScale[i]);
    const [x, y, , w] = times(camera.projection, times(camera.view, times(camera.model, [...at, 1])));
    corners.push([x / w, y / w]);
  }
  return {
    ratio: ["x", "y", "z"].map((a) => scene.aspectratio[a]),
    range: ["x", "y", "z"].map((a) => scene[a + "axis"].range[1] - scene[a + "axis"].range[0]),
    metre: [0, 1, 2].map((i) => drawn.dataScale[i] * Math.hypot(...[0, 1, 2].map((j) => camera.model[4 * i + j]))),
    corners,
  };
})
"""
"""Of each scene: its stated ratios, how long a metre is drawn along each axis, where the workspace's corners are (-1 to 1)."""

ROOM = 0.88
"""Share of a picture that the workspace may fill, so that the words along its axes are inside."""


@pytest.mark.parametrize(
    "name",
    [*(pytest.param(name, marks=pytest.mark.slow) for name in ("report", "show", "campaign")), ONLINE, RECORDED, REPRODUCTION],
)
def test_a_page_draws_from_its_file_alone_without_a_complaint(desk: Desk, name: str) -> None:
    tab = desk(name)
    assert tab.complaints() == []
    assert tab.fetched() == []
    assert tab.run("document.getElementById('unseen').hidden")
    drawn = tab.run("Array.from(document.querySelectorAll('.figure')).filter(f => f.data).length")
    assert drawn >= 1
    assert len(tab.picture()) > 30_000, "a blank page is smaller"


@pytest.mark.parametrize(
    ("name", "phone"),
    [
        pytest.param("report", True, marks=pytest.mark.slow),
        *(pytest.param(name, True, marks=pytest.mark.slow) for name in ("show", "campaign", "online")),
        pytest.param("campaign", False, marks=pytest.mark.slow),
        pytest.param("online", False, marks=pytest.mark.slow),
        pytest.param("recorded", True, marks=pytest.mark.slow),
        pytest.param("reproduction", True, marks=pytest.mark.slow),
    ],
    ids=[*(f"{name} on a phone" for name in PAGES), "campaign in a window", "online in a window", "recorded on a phone", "reproduction on a phone"],
)  # fmt: skip
def test_nothing_scrolls_sideways_or_lies_over_words_on_a_narrow_screen(narrow: Narrow, name: str, phone: bool) -> None:
    tab = narrow(name, phone)
    assert tab.run("document.documentElement.scrollWidth <= innerWidth")
    assert tab.run("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    for figure in tab.run(BOXES):
        left, top, right, bottom = figure["box"]
        for words, (a, b, c, d) in figure["words"]:
            assert left - 1 <= a, f"{figure['name']}: {words} is clipped"
            assert c <= right + 1, f"{figure['name']}: {words} is clipped"
            assert top - 1 <= b, f"{figure['name']}: {words} is clipped"
            assert d <= bottom + 1, f"{figure['name']}: {words} is clipped"
        for _, _, _, low in figure["legend"]:
            assert low <= figure["plot"][1] + 1, f"{figure['name']}: the legend lies over the picture"
    for scene in tab.run(SCENES):
        assert max(abs(part) for corner in scene["corners"] for part in corner) < ROOM, "axes are clipped"


@pytest.mark.parametrize(
    "name", [*(pytest.param(name, marks=pytest.mark.slow) for name in ("report", "show")), ONLINE, RECORDED]
)
def test_scenes_are_to_scale(desk: Desk, name: str) -> None:
    tab = desk(name)
    scenes = tab.run(SCENES)
    assert scenes
    for scene in scenes:
        expected = [span / scene["range"][0] for span in scene["range"]]
        assert [part / scene["ratio"][0] for part in scene["ratio"]] == pytest.approx(expected)
        assert scene["metre"] == pytest.approx([scene["metre"][0]] * 3, rel=1e-3)
        assert max(abs(part) for corner in scene["corners"] for part in corner) < ROOM, "axes are clipped"


@pytest.mark.slow  # opens the page of a mission
def test_scenes_far_down_the_page_are_drawn_when_they_come_near(desk: Desk) -> None:
    tab = desk("show")
    names = tab.run("Array.from(document.querySelectorAll('.figure')).map(f => f.id)")
    assert not tab.run(f"Boolean(document.getElementById('{names[-1]}').data)")
    tab.run(f"document.getElementById('{names[-1]}').scrollIntoView()")
    tab.wait(f"document.getElementById('{names[-1]}').data && document.querySelectorAll('#{names[-1]} canvas').length")
    assert tab.complaints() == []


@pytest.mark.slow
def test_the_error_curve_can_be_read_beside_its_margin(desk: Desk) -> None:
    tab = desk("report")
    height = tab.run("document.getElementById('errors').getBoundingClientRect().height")
    curves = tab.run(
        "Array.from(document.querySelectorAll('#errors .scatterlayer path.js-line')).map(p => p.getBoundingClientRect().height)"
    )
    assert max(curves) > 0.25 * height
    assert "margin 50 mm" in tab.run("document.getElementById('errors').textContent")


@pytest.mark.parametrize("name", ["report", ONLINE])
def test_a_flight_plays(desk: Desk, name: str) -> None:
    tab = desk(name)
    assert text(tab, "time") == "0.0 s"
    markers = "document.getElementById('scene').data.slice(-3).map(t => [t.x[0], t.y[0], t.z[0]])"
    start = tab.run(markers)
    tab.run(f"window.atStart = JSON.stringify({markers})")
    tab.run("document.getElementById('play').click()")
    gone = f"Number(document.getElementById('clock').value) > 1 && JSON.stringify({markers}) !== window.atStart"
    tab.wait(f"{gone} && (document.getElementById('play').click(), true)")  # some hover for a second first
    assert text(tab, "play") == "Play"
    assert tab.run(markers) != start
    assert float(text(tab, "time").removesuffix(" s")) > 0.9


def test_a_robot_s_name_beside_the_scene_hides_it_and_shows_it_again(desk: Desk) -> None:
    tab = desk("report")
    seen = """
      document.getElementById('scene').data.filter(t => t.name === 'quad1' || t.legendgroup === 'quad1').map(t => String(t.visible))
    """
    pressed = "document.querySelectorAll('#letters button')[1].getAttribute('aria-pressed')"
    for shown in ("false", "true"):
        tab.run("document.querySelectorAll('#letters button')[1].click()")
        assert tab.run(pressed) == shown
        assert set(tab.run(seen)) == ({"legendonly"} if shown == "false" else {"true"})
        tab.move_clock("1" if shown == "false" else "0")  # a hidden robot's marker moves unseen


@pytest.mark.parametrize("name", ["report", ONLINE])
def test_the_slider_shows_the_end_of_the_mission(desk: Desk, name: str) -> None:
    tab = desk(name)
    for robot, index in (("quad0", 0), ("quad1", 1), ("quad2", 2)):
        assert robot in tab.run("document.getElementById('letters').textContent")
        assert text(tab, f"letter{index}") == "{} (in no region)"
    tab.move_clock("clock.max")
    assert text(tab, "letter0") == "{carrying}", "quad0 has its water at the end"
    todo = tab.run("Array.from(document.querySelectorAll('#todo li')).map(e => e.textContent)")
    assert "F loc2 done" in todo
    assert tab.run("document.querySelector('.bars').style.getPropertyValue('--now')") == "1"


@pytest.mark.slow  # opens the page of an online flight
def test_a_hoop_that_moved_is_seen_where_it_was_at_the_time(desk: Desk) -> None:
    tab = desk("online")
    seen = """
      document.getElementById('scene').data.filter(t => t.type === 'mesh3d' && t.name === 'water' && t.visible !== false)
        .map(t => Math.round(50 * (Math.max(...t.y) + Math.min(...t.y))) / 100)
    """
    before = tab.run(seen)
    tab.move_clock("4")
    tab.wait(f"JSON.stringify({seen.strip()}) !== {str(before)!r}")
    assert tab.run(seen) == [-0.7]
    assert len(before) == 1
    assert before != [-0.7]
    assert re.search(r"3\.0 s: water moves to", text(tab, "happened"))


def test_colours_follow_the_reader(narrow: Narrow, desk: Desk) -> None:
    lightness = "getComputedStyle(document.querySelector('#errors .xtick text')).fill.match(/[0-9]+/g).map(Number)"
    assert sum(desk("report").run(lightness)) < 200 < 500 < sum(narrow("report", False).run(lightness))


@pytest.mark.parametrize("name", ["report", *(pytest.param(name, marks=pytest.mark.slow) for name in PAGES[1:])])
def test_a_browser_that_cannot_unpack_the_pictures_says_so(browser: Browser, page: Page, name: str) -> None:
    tab = browser.open(page(name), before="delete window.DecompressionStream", ready="document.body.dataset.unseen === 'yes'")
    assert "too old for the pictures" in text(tab, "unseen")
    assert tab.run("document.getElementById('unseen').getBoundingClientRect().height") > 10
    assert tab.complaints() == []
    tab.close()


def text(tab: Tab, name: str) -> str:
    """Return the text of an element."""
    return tab.run(f"document.getElementById('{name}').textContent")
