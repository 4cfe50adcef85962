"""The report, opened in a real browser without a network: it draws, it plays, and it complains of nothing."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import ltlplan
from ltlplan.report import report_html

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at the page"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    result = ltlplan.run(ltlplan.load_mission("firefighting"))
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_html(result), encoding="utf-8")
    return path


def chromium(page: Path, tmp_path: Path, *more: str) -> subprocess.CompletedProcess[str]:
    assert CHROMIUM is not None
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr",
        f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1280,2400", "--virtual-time-budget=20000", *more, page.as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)


def test_the_page_draws_without_a_complaint(page: Path, tmp_path: Path) -> None:
    done = chromium(page, tmp_path, "--dump-dom")
    assert done.returncode == 0, done.stderr
    assert 'data-ready="yes"' in done.stdout
    complaints = [
        line for line in done.stderr.splitlines() if "CONSOLE" in line and re.search(r"error|refused|failed", line, re.I)
    ]
    assert complaints == []
    for robot in ("quad0", "quad1", "quad2"):
        assert f"</i>{robot}</dt>" in done.stdout
    assert done.stdout.count("{} (in no region)</dd>") == 3
    assert done.stdout.count("js-plotly-plot") >= 4


def with_script(page: Path, name: str, script: str) -> Path:
    changed = page.with_name(name)
    text = page.read_text(encoding="utf-8")
    changed.write_text(text.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
    return changed


def test_the_slider_shows_the_end_of_the_mission(page: Path, tmp_path: Path) -> None:
    script = "drawn.then(() => { clock.value = clock.max; clock.dispatchEvent(new Event('input')); });"
    done = chromium(with_script(page, "end.html", script), tmp_path, "--dump-dom")
    letters = re.findall(r'<dd class="letter"[^>]*>(.*?)</dd>', done.stdout)
    assert letters[0] == "{carrying}", "quad0 has its water at the end"
    todo = re.search(r'id="todo">(.*?)</ul>', done.stdout, re.DOTALL)
    assert todo is not None
    assert "F loc2: done" in re.sub(r"</code>", ":", re.sub(r"<(?!/code)[^>]*>", "", todo.group(1)))


def test_playing_moves_the_clock(page: Path, tmp_path: Path) -> None:
    script = "document.getElementById('play').click();"
    done = chromium(with_script(page, "played.html", script), tmp_path, "--dump-dom")
    shown = re.search(r'<output id="time">([0-9.]+) s</output>', done.stdout)
    assert shown is not None
    assert float(shown.group(1)) > 0.0


def test_the_picture_is_not_blank(page: Path, tmp_path: Path) -> None:
    picture = tmp_path / "report.png"
    chromium(page, tmp_path, f"--screenshot={picture}")
    assert picture.stat().st_size > 60_000


def test_the_page_fetches_nothing_and_is_the_same_each_time(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    markup = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", markup)
    assert report_html(ltlplan.run(ltlplan.load_mission("firefighting"))) == text
