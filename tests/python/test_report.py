"""Opens the report in headless Chromium. Screenshots are left in build/artefacts to look at."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from sample import ARTEFACTS, PROGRAM, write_sample

CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
PROFILES = ["P1 tracking", "P2 anti-slosh", "P3 waiter"]
PER_RUN, PER_PROFILE = 14, 2  # plots

# Runs in the page after it has been built; what it returns comes back as JSON.
PROBE = """
<script>
(async () => {
  const read = (selector) => [...document.querySelectorAll(selector)];
  const wait = () => new Promise((done) => setTimeout(done, 50));
  const hover = async (figure, share) => {
    const over = figure.querySelector('.u-over');
    const box = over.getBoundingClientRect();
    const at = { clientX: box.left + share * box.width, clientY: box.top + box.height / 2, bubbles: true };
    over.dispatchEvent(new MouseEvent('mouseenter', at));
    over.dispatchEvent(new MouseEvent('mousemove', at));
    await wait();
  };
  const legend = (figure) => [...figure.querySelectorAll('.u-value')].map((cell) => cell.textContent);
  const painted = (canvas) => {
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    const colors = new Set();
    for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 3] === 255) colors.add(pixels[i] << 16 | pixels[i + 1] << 8 | pixels[i + 2]);
    return colors.size;
  };
  const result = {};
  try {
    while (!document.documentElement.dataset.charts) await wait();
    result.resources = performance.getEntriesByType('resource').map((entry) => entry.name);
    result.canvases = read('figure canvas:not(#story *)').length;
    result.colors = read('figure canvas:not(#story *)').map(painted);
    result.rows = read('.card').map((card) => [...card.querySelectorAll('dt')].map((row) => Math.round(row.getBoundingClientRect().top)));
    result.tables = read('#tables table').map((table) => ({
      heads: [...table.querySelectorAll('thead th')].slice(1).map((head) => head.textContent),
      cells: [...table.querySelectorAll('tbody tr')].map((row) => row.querySelectorAll('td').length),
    }));
    result.bold = read('td.best').length;
    result.overflow = document.documentElement.scrollWidth - innerWidth;

    const figures = read('figure');
    const figure = (name) => document.querySelector(`[data-chart="${name}"]`);
    await hover(figure('y'), 0.5);
    result.y = legend(figure('y'));
    result.lateral = legend(figure('lateral'));
    result.speeds = legend(figures.at(-1));
    result.objective = legend(document.querySelector('[data-per-profile="objective"] figure'));
    await hover(figure('tail'), 0.5);
    result.tail = legend(figure('tail'));

    document.getElementById('relative').click();
    await wait();
    await hover(figure('y'), 0.5);
    result.relative = legend(document.querySelector('[data-per-profile="objective"] figure'));

    const background = () => getComputedStyle(document.body).backgroundColor;
    result.themes = [background()];
    document.getElementById('theme').click();
    await wait();
    result.themes.push(background());
    result.canvasesAfterTheme = read('figure canvas:not(#story *)').length;

    document.querySelector('[data-profile="1"]').click();
    await wait();
    result.off = read('figure[data-chart] .u-series.u-off').length;
    result.hiddenFigures = read('figure[data-of-profile][hidden]').length;
    result.unlabelled = read('input, button').filter((e) => !(e.labels?.length || e.ariaLabel || e.textContent.trim())).length;
    result.done = true;
  } catch (error) {
    result.error = String(error.stack);
  }
  document.documentElement.dataset.probe = JSON.stringify(result);
})();
</script>
"""


def chromium(*arguments: str) -> subprocess.CompletedProcess:
    # The log is mostly Chromium's own messages; only CONSOLE lines concern the page, or Chromium's internal pages.
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=20000"]
    return subprocess.run(
        [CHROMIUM, *flags, "--enable-logging=stderr", *arguments], capture_output=True, text=True, timeout=300
    )


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Path:
    return write_sample(tmp_path_factory.mktemp("report")) / "report.html"


@pytest.fixture(scope="module")
def probed(report) -> dict:
    if CHROMIUM is None:
        pytest.skip("no chromium here")
    page = report.with_name("probed.html")
    page.write_text(report.read_text().replace("</body>", PROBE + "</body>"))
    run = chromium("--dump-dom", "--window-size=1400,1000", page.as_uri())
    match = re.search(r'data-probe="([^"]*)"', run.stdout)
    assert match, run.stderr[-3000:]
    result = json.loads(match[1].replace("&quot;", '"').replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    result["console"] = [line for line in run.stderr.splitlines() if "CONSOLE" in line and "source: chrome://" not in line]
    assert result.get("done"), result
    return result


def number(text: str) -> float:
    return float(re.match(r"-?[\d.]+", text)[0])


def clock(text: str) -> float:
    """s, of m:ss.ss."""
    minutes, seconds = re.fullmatch(r"(\d+):(\d\d\.\d\d)", text).groups()
    return 60 * int(minutes) + float(seconds)


def test_file_stands_alone(report):
    text = report.read_text()
    assert not re.search(r'(?:src|href)\s*=\s*"(?!data:)', re.sub(r"<script.*?</script>", "", text, flags=re.S))
    assert "{{" not in re.sub(r"<script.*?</script>", "", text, flags=re.S)
    assert "default-src 'none'" in text
    assert len(text) < 2_000_000


def test_two_reports_are_equal(report, tmp_path):
    assert report.read_bytes() == (write_sample(tmp_path) / "report.html").read_bytes()


def test_figures_have_a_column_for_each_profile(probed):
    assert len(probed["tables"]) == 4 and probed["bold"] >= 1
    for table in probed["tables"]:
        assert table["heads"] == PROFILES and set(table["cells"]) == {len(PROFILES)}


def test_every_plot_is_drawn(probed):
    assert probed["canvases"] == probed["canvasesAfterTheme"] == PER_RUN + PER_PROFILE * len(PROFILES)
    assert min(probed["colors"]) > 5, probed["colors"]


def test_nothing_is_loaded_and_nothing_complains(probed):
    assert probed["resources"] == []
    assert probed["console"] == []


def test_hovering_one_plot_reads_them_all(probed):
    time, target, *planned = probed["y"]
    assert abs(clock(time) - 5.45) < 0.2
    assert all(value.endswith("m") for value in [target, *planned]) and len(planned) == 3
    assert probed["lateral"][0] == time and all(v.endswith("m/s²") for v in probed["lateral"][1:])
    assert abs(clock(probed["speeds"][0]) - clock(time)) < 0.1 and len(probed["speeds"]) == 7
    assert all(v.endswith("%") for v in probed["tail"][1:] if v != "–") and probed["tail"][0].endswith("ms")


def test_cards_side_by_side_have_their_rows_in_line(probed):
    assert len(probed["rows"]) == len(PROFILES) and len(probed["rows"][0]) >= 3
    assert all(rows == probed["rows"][0] for rows in probed["rows"]), probed["rows"]


def test_shares_in_percent_add_up(probed):
    assert len(probed["objective"]) == len(probed["relative"]) == 7
    assert abs(sum(number(value) for value in probed["relative"][1:]) - 100) < 1
    total = sum(number(value) for value in probed["objective"][1:])
    for absolute, relative in zip(probed["objective"][1:], probed["relative"][1:]):
        assert abs(100 * number(absolute) / total - number(relative)) < 1


def test_theme_button_changes_the_page(probed):
    assert len(set(probed["themes"])) == 2


def test_a_profile_can_be_taken_out(probed):
    assert probed["off"] == PER_RUN
    assert probed["hiddenFigures"] == PER_PROFILE


def test_controls_are_labelled(probed):
    assert probed["unlabelled"] == 0


@pytest.mark.parametrize("width, theme", [(1600, "light"), (1600, "dark"), (800, "light"), (360, "light"), (360, "dark")])
def test_fits(report, width, theme):
    """No sideways scrolling. The report stands in a frame: a headless window is never narrower than 500 px."""
    if CHROMIUM is None:
        pytest.skip("no chromium here")
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    height = {1600: 3700, 800: 6300, 360: 8000}[width]
    screenshot = ARTEFACTS / f"report-{width}-{theme}.png"
    themed = report.with_name(f"{theme}.html")
    screenshot.unlink(missing_ok=True)
    measure = "<script>setTimeout(() => parent.postMessage(document.documentElement.scrollWidth, '*'), 100)</script>"
    themed.write_text(report.read_text().replace("<html", f'<html class="{theme}"').replace("</body>", measure + "</body>"))
    frame = report.with_name(f"frame-{width}-{theme}.html")
    frame.write_text(
        "<body style='margin:0'><script>onmessage = (e) => document.body.dataset.width = e.data</script>"
        f"<iframe src='{themed.as_uri()}' width={width} height={height} style='border:0;display:block'></iframe>"
    )
    size = f"--window-size={max(width, 500)},{height}"
    dom = chromium(size, f"--screenshot={screenshot}", "--dump-dom", frame.as_uri()).stdout
    assert screenshot.stat().st_size > 100_000
    assert int(re.search(r'data-width="(\d+)"', dom)[1]) <= width


def test_a_replay_tells_how_to_make_it_again(tmp_path):
    options = ["--until", "1", "--profile", "tracking", "--scale", "0.4"]
    subprocess.run([PROGRAM, "replay", *options, "--out", tmp_path / "a b"], check=True, capture_output=True)
    page = (tmp_path / "a b/report.html").read_text()
    assert f'"command":"./steadyhand replay {" ".join(options)}"' in page
