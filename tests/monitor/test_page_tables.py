"""Tables of pages as files, and the list of runs that they come from."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil

from benchmarks.monitor.directories import Directories
from benchmarks.monitor.notes import tag_run
from benchmarks.monitor.page_tables import saved_table

PAGE = """<table data-table="other"><tr><td>x</td></tr></table>
<table data-table="t"><thead><tr><th></th><th><a href="?">Name ▾</a></th><th>n</th>
<th>Rate</th></tr>
</thead><tbody><tr data-row="a&amp;b"><td><input></td><td>=1+1</td><td class="number">−1,234</td>
<td><span data-value="0.5" data-low="0.25">50 %</span></td></tr>
<tr data-row="c"><td></td><td>a<br>b, &quot;c&quot;</td><td>–</td><td>–</td></tr></tbody></table>"""


def test_a_table_is_saved_with_its_values_and_without_formulas():
    text = saved_table(PAGE, "t", "csv")
    assert list(csv.reader(io.StringIO(text))) == [
        ["id", "Name", "n", "Rate", "Rate low"],
        ["a&b", "'=1+1", "-1234", "0.5", "0.25"],
        ["c", 'a b, "c"', "", "", ""],
    ]
    assert json.loads(saved_table(PAGE, "t", "json")) == [
        {"id": "a&b", "Name": "=1+1", "n": -1234, "Rate": 0.5, "Rate low": 0.25},
        {"id": "c", "Name": 'a b, "c"', "n": None, "Rate": None, "Rate low": None},
    ]
    assert saved_table(PAGE, "none", "csv") is None


def test_every_table_of_a_page_can_be_saved(runs, visit):
    client = visit(runs)
    ids = {each.path.name: each.id for each in Directories([runs]).all()}
    both = f"of={ids['random']}&of={ids['oracle']}"
    for place in ("/?sort=agent", f"/runs/{ids['random']}?outcome=failure", f"/compare?{both}"):
        page = client.get(place).text
        names = re.findall(r'<table data-table="([^"]+)"', page)
        links = [
            each.replace("&amp;", "&") for each in re.findall(r'href="([^"]+as=csv[^"]+)"', page)
        ]
        assert len(names) == page.count("<table") == len(links) > 0
        for link in links:
            answer = client.get(link)
            assert answer.headers["content-type"] == "text/csv; charset=utf-8"
            assert answer.headers["content-disposition"].startswith("attachment; filename=")
            table = list(csv.reader(io.StringIO(answer.text)))
            assert len({len(row) for row in table}) == 1 < len(table), link
    failed = client.get(f"/runs/{ids['random']}?outcome=failure&as=json&table=episodes").json()
    assert {each["Outcome"] for each in failed} == {"failure"}
    for bad in ("as=csv", "as=exe&table=runs", "as=csv&table=../runs"):
        assert client.get(f"/?{bad}").status_code == 404


def test_runs_are_searched_sorted_tagged_and_ticked(runs, tmp_path, visit):
    for name in ("oracle", "random"):
        shutil.copytree(runs / name, tmp_path / name)
    tag_run(tmp_path / "random", "base line, <b>x</b>")
    client = visit(tmp_path)

    def listed(query: str) -> list[str]:
        return re.findall(
            r"<tr data-row.*?<wbr>([a-z]+)</a>", client.get(f"/?{query}").text, re.DOTALL
        )

    assert listed("") == ["oracle", "random"]
    assert listed("sort=success") == ["random", "oracle"]
    assert listed("sort=-success") == ["oracle", "random"]
    assert listed("text=BASE") == listed("tag=base+line") == ["random"]
    assert listed("tag=none") == listed("state=playing") == []
    page = client.get("/").text
    assert "<b>x</b>" not in page
    assert "&lt;b&gt;x&lt;/b&gt;" in page
    boxes = re.findall(r'<input type="checkbox" form="ticked" name="of" value="(\w+)"', page)
    assert (
        "Each run beside" in client.get("/compare?" + "&".join(f"of={each}" for each in boxes)).text
    )
