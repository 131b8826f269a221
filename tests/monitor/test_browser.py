"""The monitor in a real browser: it moves by itself, and can be clicked through."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from played_collection import make_collection
from training_runs import make_finetuning, make_policy

from benchmarks.monitor.directories import Directories
from er_gym.rollout.run_directory import EPISODES, RunDirectory

sync_api = pytest.importorskip(
    "playwright.sync_api", reason="needs playwright: pip install playwright"
)

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("needs the browser: apt-get install chromium", allow_module_level=True)


AXE = "{runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'wcag22aa'], resultTypes: ['violations']}"
"""The rules of the Web Content Accessibility Guidelines."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_api.sync_playwright() as playwright:
        # Chromium's sandbox does not start for root; the pages are this test's own.
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


def patient(context: Any) -> Any:
    """A browser's context that waits for two minutes: the machine may be busy."""
    context.set_default_timeout(120_000)
    return context


@pytest.fixture
def page(browser) -> Iterator[Any]:
    """A page; nothing may be asked of another host, and nothing may go wrong in the console."""
    context = patient(browser.new_context())
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda one: one.type == "error" and wrong.append(one.text))
    page.on("request", lambda one: "127.0.0.1" in one.url or wrong.append(one.url))
    page.wrong = wrong
    yield page
    context.close()
    # While a server is away, the browser tells that it does not reach it.
    assert [each for each in wrong if "net::ERR_" not in each] == []


def bench(out: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "benchmarks.cli", "bench", "--suite", "mini", "--agent"]
    return subprocess.Popen(
        [*command, "random", "--out", str(out)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def stop_after(page: Any, process: subprocess.Popen[bytes], run: Path, episodes: int) -> None:
    """Let the run stand still once it has so many episodes, however slow the page is."""
    while len([*(run / EPISODES).glob("*.json")]) <= episodes:  # one may not be told of yet
        assert process.poll() is None
        page.wait_for_timeout(10)
    os.killpg(process.pid, signal.SIGSTOP)


def finished(page: Any) -> int:
    """How many episodes the page says have ended."""
    found = re.search(r"(\d+) of 132", page.inner_text("#summary"))
    return int(found[1]) if found else -1


def wait_until(page: Any, enough: int) -> None:
    page.wait_for_function(
        "enough => Number((/(\\d+) of 132/.exec(document.querySelector('#summary')?.innerText)"
        " || [0, -1])[1]) >= enough",
        arg=enough,
    )


def test_a_run_fills_by_itself_though_run_and_server_are_killed(page, serve, tmp_path):
    server = serve(tmp_path)
    page.goto(server.address)
    assert "Nothing here yet" in page.inner_text("main")
    page.evaluate("window.here = 1")
    process = bench(tmp_path / "runs" / "live")
    try:
        stop_after(page, process, tmp_path / "runs" / "live", 5)
        page.click("a:has-text('runs/live')")  # it has appeared without reload
        page.evaluate("window.here = 1")
        wait_until(page, 5)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        page.wait_for_selector(".state.stopped")
        killed_at = finished(page)
        server.stop()
        process = bench(tmp_path / "runs" / "live")  # goes on where it was
        page.wait_for_selector("#away:not([hidden])")
        serve(tmp_path, server.port)
        page.wait_for_selector("#away", state="hidden")
        wait_until(page, killed_at + 5)
        wait_until(page, 132)
        assert page.evaluate("window.here") == 1
        page.wait_for_selector(".state.finished")
        assert page.locator("#rows tbody tr").count() == 100
        page.click("#rows >> text=Next >> nth=0")
        page.wait_for_function("document.querySelectorAll('#rows tbody tr').length === 32")
        process.wait()  # the last that it does is to remove its lock
        shutil.rmtree(tmp_path / "runs")
        page.wait_for_selector("text=There is nothing at this address any more")
        page.wrong[:] = [one for one in page.wrong if "404" not in one]
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def test_twenty_open_pages_are_served_and_all_are_renewed(page, serve, runs, tmp_path):
    """A browser has six connections to a server: no page may keep one."""
    address = serve(tmp_path).address
    pages = [page, *(page.context.new_page() for _ in range(19))]
    for each in pages:
        each.goto(address)
    shutil.copytree(runs / "random", tmp_path / "late")
    for each in pages:
        each.wait_for_selector("a:has-text('/late')")


def test_news_leave_scrolling_rows_and_selected_text_as_they_are(page, serve, runs, tmp_path):
    shutil.copytree(runs / "random", tmp_path / "m")
    page.set_viewport_size({"width": 400, "height": 700})
    page.goto(serve(tmp_path).address)
    page.evaluate("document.querySelector('.scroll').scrollLeft = 150")
    page.evaluate("window.row = document.querySelector('tbody tr')")
    shutil.copytree(runs / "oracle", tmp_path / "a")
    page.wait_for_selector("tbody tr:nth-child(1) a:has-text('/a')")
    left = "() => [document.querySelector('.scroll').scrollLeft, row.rowIndex]"
    assert page.evaluate(left) == [150, 2]

    page.evaluate("getSelection().selectAllChildren(row.querySelector('a'))")
    with page.expect_event("requestfinished", lambda one: one.url == page.url):
        shutil.rmtree(tmp_path / "a")
    page.wait_for_timeout(100)
    assert page.evaluate("getSelection().toString()").endswith("/m")
    assert page.evaluate(left) == [150, 2], "it waits"
    page.evaluate("getSelection().empty()")
    page.wait_for_function(
        "() => row.rowIndex === 1 && document.querySelectorAll('tr').length === 2"
    )
    assert page.evaluate(left) == [150, 1]


def test_a_link_of_another_site_with_the_token_opens_the_page(browser, serve, tmp_path):
    """And a later one without it; but a form of that site is not let in."""
    address = serve(tmp_path, token="secret").address
    context = patient(browser.new_context())
    page = context.new_page()
    body = ""
    context.route(
        "http://elsewhere.example/",
        lambda route: route.fulfill(content_type="text/html", body=body),
    )
    for path, status, body in (
        ("/data", 403, f"<a href='{address}/data'>go</a>"),
        ("/", 200, f"<a href='{address}/?token=secret'>go</a>"),
        ("/data", 200, f"<a href='{address}/data'>go</a>"),
        ("/play", 403, f"<form method=post action='{address}/play'><button>go</button></form>"),
    ):
        with page.expect_response(address + path) as got:
            page.goto("http://elsewhere.example/")
            page.click("text=go")
        assert got.value.status == status, body
    page.goto(address)
    assert page.reload().status == 200
    context.close()


def test_filter_slider_keys_and_comparison(page, serve, runs, tmp_path):
    for name in ("oracle", "random"):
        shutil.copytree(runs / name, tmp_path / name)
    page.goto(serve(tmp_path).address)
    page.click("a:has-text('/random')")
    page.select_option("select[name=outcome]", "failure")
    page.fill("input[name=steps]", "2-")
    page.click("button:has-text('Filter')")
    page.wait_for_url(re.compile("outcome=failure"))
    page.click("th a:has-text('Steps')")
    page.click("#rows tbody a >> nth=0")
    page.wait_for_selector("li.now")
    last = int(page.get_attribute("[data-player]", "data-last"))
    page.keyboard.press("End")
    assert page.locator("li.now").get_attribute("data-step") == str(last)
    page.keyboard.press("ArrowLeft")
    assert page.locator("li.now").get_attribute("data-step") == str(last - 1)
    page.locator("[data-slider]").fill("1")
    assert page.url.endswith("#step-1")
    page.wait_for_selector("svg.room .stand.now")
    page.select_option("[data-speed]", "8")
    page.click("[data-play]")
    page.wait_for_function(
        "last => document.querySelector('li.now').dataset.step === last", arg=str(last)
    )
    page.wait_for_selector("[data-play][aria-pressed=false]")
    page.click("[data-draw]")
    page.wait_for_function("() => document.querySelector('[data-frame]').naturalWidth > 0")
    page.click(".noting summary")
    page.fill("textarea[name=text]", "odd")
    page.click(".noting button")
    page.wait_for_selector("text=Saved.")
    address = page.url
    page.keyboard.press("j")
    page.wait_for_function(
        "address => location.href.split('#')[0] !== address.split('#')[0]", arg=address
    )

    page.goto(page.url.split("/runs/")[0] + "/")
    for box in page.locator("input[name=of]").all():
        box.check()
    page.click("button:has-text('Compare')")
    page.wait_for_selector("#flipped tbody a")  # the address is there before the page
    assert page.locator("#differences tbody tr").count() == 1
    page.click("#flipped tbody a >> nth=0")
    page.wait_for_selector(".sides svg.room >> nth=1")
    page.wait_for_selector("li.now >> nth=1")
    page.keyboard.press("ArrowRight")
    assert page.locator("li.now").count() == 2


def begin_to_play(page: Any, shown: str) -> None:
    page.click("button.main")
    page.wait_for_selector(shown, state="attached")
    page.wait_for_load_state("domcontentloaded")  # keys are heard once the scripts have run


def test_a_person_plays_a_whole_task_to_success(page, serve, runs, tmp_path):
    """The oracle's actions by mouse, the last one by keyboard; then the replay of them."""
    record = next(iter(RunDirectory.open(runs / "oracle").episodes()))
    page.goto(serve(tmp_path, play=tmp_path / "played").address)
    page.click("text=Play")
    page.select_option("select[name=type]", record.task_type)  # the tasks are those of this type
    page.wait_for_function(
        "() => { const n = document.forms.choose.elements.task.length; return n > 1 && n < 50; }"
    )
    assert page.input_value("select[name=task]") == ""  # until one is chosen, the next one
    page.select_option("select[name=task]", record.task_id)
    begin_to_play(page, "input[name=step]")
    for number, step in enumerate(record.steps[1:], 1):
        action = f"{step.verb} {step.object_type}".strip()
        page.wait_for_selector(f"input[name=step][value='{number}']", state="attached")
        button = page.locator(f"button[name=action][value='{action}']")
        button.wait_for()
        assert page.locator("figure img").first.evaluate(
            "image => image.decode().then(() => image.naturalWidth)"
        )
        if number == 1:
            page.keyboard.press("/")
            page.keyboard.type(action.lower())
            page.keyboard.press("Enter")
        elif step.verb == "end":
            page.keyboard.press("Escape")
            page.keyboard.press("e")
            page.keyboard.press("Enter")
        else:
            button.click()
    page.wait_for_selector("p.result.good")
    page.click("a:has-text('See the episode again')")
    page.wait_for_selector("li.now")
    assert page.locator("[data-step]").count() == len(record.steps)
    assert page.locator(".outcome.success").count() == 1
    page.keyboard.press("ArrowRight")
    page.wait_for_function(
        "() => document.querySelector('.pictures img:not([hidden])').naturalWidth"
    )


def test_a_type_counts_that_was_chosen_before_the_script_had_come(page, serve, tmp_path):
    script = "**/choose.js*"
    held: list[Any] = []
    page.route(script, lambda route: held.append(route))
    page.goto(f"{serve(tmp_path, play=tmp_path / 'played').address}/play", wait_until="commit")
    page.select_option("select[name=type]", "single_search")
    page.wait_for_function("() => document.forms.choose.elements.task.length > 100")
    while not held:
        page.wait_for_timeout(20)
    held[0].continue_()
    page.wait_for_function("() => document.forms.choose.elements.task.length < 50")
    assert page.input_value("select[name=type]") == "single_search"


def test_news_that_are_none_do_not_take_the_focus_between_two_keys(page, serve, tmp_path):
    """The page hears of another version after the first of two keys, and finds the same."""
    held: list[Any] = []
    page.goto(f"{serve(tmp_path, play=tmp_path / 'played').address}/play?suite=mini")
    begin_to_play(page, "button[data-verb=e]")
    page.route(re.compile(r"/version$"), lambda route: held.append(route))
    while not held:
        page.wait_for_timeout(20)
    page.keyboard.press("e")
    with page.expect_event("requestfinished", lambda one: re.search(r"/play/[^/]+$", one.url)):
        held[0].fulfill(body="another")
    page.wait_for_timeout(100)
    page.keyboard.press("Enter")
    page.wait_for_selector("p.result.bad")


def test_keys_are_kept_while_an_action_is_on_its_way_and_pictures_lie_as_seen(
    page, serve, tmp_path
):
    page.goto(f"{serve(tmp_path, play=tmp_path / 'played').address}/play?suite=mini")
    begin_to_play(page, "button[data-verb=l]")
    page.keyboard.press("l")
    page.keyboard.press("Enter")
    page.wait_for_selector("input[name=step][value='2']", state="attached")
    page.wait_for_function("() => document.activeElement.value === 'observe'")
    across = "one => document.querySelector('figure.' + one).getBoundingClientRect().x"
    left, ahead, right = (page.evaluate(across, one) for one in ("left", "ahead", "right"))
    assert left < ahead < right < page.evaluate("document.querySelector('.choices').offsetLeft")

    page.click("figure.right a")
    page.wait_for_function(
        "() => document.querySelector('dialog[open] img').getBoundingClientRect().width > 900"
    )
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")

    held: list[Any] = []
    page.route(
        re.compile(r"/play/[^/]+$"),
        lambda route: route.continue_() if held else held.append(route),
    )
    page.focus("button[value=observe]")
    page.keyboard.press("Enter")
    page.keyboard.press("e")
    page.keyboard.press("Enter")
    while not held:
        page.wait_for_timeout(20)
    held[0].continue_()
    page.wait_for_selector("p.result.bad")
    actions = page.locator(".played-steps b").all_text_contents()
    assert actions == ["end", "observe", "observe"]


def test_it_fits_a_telephone_in_the_dark_and_in_chinese(browser, serve, runs):
    context = patient(
        browser.new_context(
            viewport={"width": 360, "height": 740}, color_scheme="dark", locale="zh-CN"
        )
    )
    page = context.new_page()
    address = serve(runs).address
    page.goto(address)
    assert page.locator("html").get_attribute("lang") == "zh"
    places = [address, *(f"{address}{a.get_attribute('href')}" for a in page.locator("td a").all())]
    page.goto(places[1])
    places.append(address + page.locator("#rows tbody a").first.get_attribute("href"))
    places.append(f"{address}/compare")
    for each in places:
        page.goto(each)
        too_wide = page.evaluate("document.documentElement.scrollWidth > innerWidth")
        assert not too_wide, each
        style = "getComputedStyle(document.body)"
        paper, ink = page.evaluate(f"[{style}.backgroundColor, {style}.color]")
        assert brightness(paper) < 60 < 180 < brightness(ink)
    context.close()


def brightness(colour: str) -> float:
    return sum(map(int, re.findall(r"\d+", colour)[:3])) / 3


def test_pages_of_all_kinds_can_be_used_without_eyes_or_mouse(browser, serve, runs, tmp_path):
    """Axe finds nothing serious on any kind of page at three widths, light and dark."""
    pytest.importorskip("axe_playwright_python")
    source = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    for name in ("oracle", "random"):
        shutil.copytree(runs / name, tmp_path / name)
    collection = make_collection(tmp_path / "collection", parts=("anomalies",))
    make_finetuning(tmp_path / "finetuning")
    make_policy(tmp_path / "policy")
    address = serve(tmp_path, play=tmp_path / "played").address
    ids = {each.path.name: each.id for each in Directories([tmp_path]).all()}
    episode = next(iter(RunDirectory.open(runs / "random").episodes())).key
    turns = next(collection.trajectories()).id
    pages = [
        "/", "/data", "/training", "/play", "/nothing",
        f"/runs/{ids['oracle']}", f"/runs/{ids['random']}/episode?key={episode}",
        f"/compare?of={ids['random']}&of={ids['oracle']}",
        f"/compare/episode?of={ids['random']}&of={ids['oracle']}&key={episode}",
        f"/data/{ids['collection']}", f"/data/{ids['collection']}/trajectory?key={turns}",
        f"/training/{ids['finetuning']}", f"/training/{ids['policy']}",
        f"/training/curves?of={ids['finetuning']}&of={ids['policy']}",
    ]  # fmt: skip
    wrong = []
    context = patient(browser.new_context(bypass_csp=True, reduced_motion="reduce"))
    page = context.new_page()
    for place in pages:
        page.goto(address + place)
        if "curves" in place:
            page.wait_for_selector("#curves canvas >> nth=1")
        page.evaluate(source)
        for width, scheme in ((1440, "light"), (900, "dark"), (360, "light")):
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)
            found = page.evaluate(f"axe.run(document, {AXE})")
            wrong += [
                (place, width, scheme, one["id"], one["nodes"][0]["html"][:120])
                for one in found["violations"]
                if one["impact"] in ("serious", "critical")
            ]
    context.close()
    assert wrong == []
