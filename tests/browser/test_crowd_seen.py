"""The page of many robots in a real browser: it plays frame by frame, hides robots, and stands still as it played."""

import pytest

from tests.browser.devtools import CHROMIUM, Browser, Tab
from tests.helpers.serving.crowd_pages import crowd_page

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at the pages"),
]

ROBOTS = 24

SCENE = "document.getElementById('scene')"
COLOURED = """
(() => {
  const canvas = document.querySelector("#scene .overlay");
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 3; i < pixels.length; i += 4) if (pixels[i] > 128) count++;
  return count;
})()
"""
"""Pixels of the overlay on which a robot is."""


@pytest.fixture(scope="module")
def tab(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Tab:
    page = tmp_path_factory.mktemp("crowd") / "crowd.html"
    page.write_text(crowd_page(ROBOTS), encoding="utf-8")
    return browser.open(page).to_front()


def play(tab: Tab, *, frames: int) -> None:
    before = int(tab.run(f"Number({SCENE}.dataset.drawn || 0)"))
    tab.run("document.getElementById('play').click()")
    tab.wait(f"Number({SCENE}.dataset.drawn || 0) >= {before + frames}")


def test_a_scene_of_many_has_a_handful_of_traces_and_plays_over_them(tab: Tab) -> None:
    assert tab.run(f"{SCENE}.data.length") <= 5
    assert tab.run(f"{SCENE}.data.at(-1).x.length") == ROBOTS
    scene_draws = f"""{SCENE}._fullLayout.scene._scene.glplot"""
    tab.run(f"window.redrawn = 0; {scene_draws}.onrender = () => redrawn++")
    play(tab, frames=10)
    assert tab.run("redrawn") <= 2, "while robots move the scene behind them stays"
    assert 12 * ROBOTS < tab.run(COLOURED) < 200 * ROBOTS
    assert tab.run(f"{SCENE}.data.at(-1).x.length") == 0, "no robot is seen twice"
    tab.run("document.getElementById('play').click()")
    assert tab.run("document.querySelector('.overlay')") is None
    assert tab.run(f"{SCENE}.data.at(-1).x.length") == ROBOTS
    assert tab.complaints() == []


def test_circles_are_where_the_scene_has_its_markers(tab: Tab) -> None:
    centres = tab.run(
        f"""(() => {{
          const drawn = {SCENE}._fullLayout.scene._scene, camera = drawn.glplot.cameraParams, trace = {SCENE}.data.at(-1);
          const times = (m, v) => [0, 1, 2, 3].map((i) => [0, 1, 2, 3].reduce((sum, j) => sum + m[4 * j + i] * v[j], 0));
          const box = drawn.glplot.canvas.getBoundingClientRect();
          return trace.x.map((_, k) => {{
            const at = ["x", "y", "z"].map((a, i) => trace[a][k] * drawn.dataScale[i]);
            const [x, y, , w] = times(camera.projection, times(camera.view, times(camera.model, [...at, 1])));
            return [box.left + (1 + x / w) * box.width / 2, box.top + (1 - y / w) * box.height / 2];
          }});
        }})()"""
    )
    tab.run("document.getElementById('speed').selectedOptions[0].value = '0'")  # so that time stands while it plays
    play(tab, frames=2)
    alphas = tab.run(
        f"""(() => {{
          const canvas = document.querySelector(".overlay"), box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
          const alpha = (x, y) => canvas.getContext("2d").getImageData((x - box.left) * scale, (y - box.top) * scale, 1, 1).data[3];
          return {centres}.map(([x, y]) => [alpha(x, y), alpha(x, y - 60)]);
        }})()"""
    )
    tab.run("document.getElementById('play').click()")
    tab.run("document.getElementById('speed').selectedOptions[0].value = '1'")
    assert [middle for middle, _ in alphas] == [255] * ROBOTS
    assert any(above == 0 for _, above in alphas), "the rest shows the scene behind"


@pytest.mark.parametrize("playing", [False, True], ids=["standing", "playing"])
def test_a_robot_is_hidden_with_its_path_and_comes_back(tab: Tab, playing: bool) -> None:
    if playing:
        play(tab, frames=2)
    whole = tab.run(f"{SCENE}.data.at(-2).x.filter((x) => x !== null).length")
    button = "document.querySelector('#letters button')"
    tab.run(f"{button}.click()")
    tab.wait(f"{SCENE}.data.at(-2).x.filter((x) => x !== null).length < {whole}")
    left = tab.run(f"{SCENE}.data.at(-2).x.flatMap((x, i) => x === null ? [] : [{SCENE}.data.at(-2).customdata[i]])")
    assert "q0" not in left
    assert len(set(left)) == ROBOTS - 1
    assert tab.run(f"{button}.getAttribute('aria-pressed')") == "false"
    if not playing:
        assert tab.run(f"{SCENE}.data.at(-1).x[0]") is None
    tab.run(f"{button}.click()")
    tab.wait(f"{SCENE}.data.at(-2).x.filter((x) => x !== null).length === {whole}")
    if playing:
        tab.run("document.getElementById('play').click()")
    assert tab.run(f"{SCENE}.data.at(-1).x[0]") is not None
    assert tab.complaints() == []
