"""The gallery: every table of the examples can be read, and its kinds of entries make what the pages show."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from checked_gallery import QUICKLY, checked
from tables import Chapter, Curve, Driver, Picture, chapters
from worlds_references import EXAMPLES

DRIVEN = [chapter.folder for chapter in chapters(EXAMPLES) if any(isinstance(x, Driver) for x in chapter.entries)]
PROGRAM = r"""
def part(t) integral [0, 1] [x < t] d(x)
def pixel(x, y, r) [x^2 + y^2 < r^2]
def disc(x, y, r) integral ([x, x + 0.25], [y, y + 0.25]) pixel(u, v, r) d(u, v)
"""
TABLE = r"""
title = "Small & plain"
[[curve]]
title = "A step"
program = "small"
function = '\t . part(t^2)'
over = "the end"
range = [0.1, 0.9]
[[picture]]
title = "A disc"
program = "small"
function = "disc"
given = { r = "0.6" }
wrt = ["r"]
quick = [4, 4]
[[driver]]
title = "By Python"
file = "drawn.py"
"""
DRIVER = r"""
def pictures(folder, quick):
    (folder / "mine.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    return [{"file": "mine.svg", "caption": f"quick: {quick}", "error": 1e-9}]
"""


def gallery(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLES / "gallery"), "--quick", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=600)


@pytest.fixture
def examples(tmp_path: Path) -> Path:
    folder = tmp_path / "examples" / "small"
    folder.mkdir(parents=True)
    for name, text in (("small.po", PROGRAM), ("gallery.toml", TABLE), ("drawn.py", DRIVER)):
        (folder / name).write_text(text, encoding="utf-8")
    return folder.parent


def test_each_kind_of_entry_is_made(examples: Path, tmp_path: Path) -> None:
    out = tmp_path / "pages"
    done = gallery("--root", str(examples), "--out", str(out))
    assert done.returncode == 0, done.stderr
    made = {file.name for file in out.iterdir()}
    assert made == {"index.html", "contact.svg", "small-a-step.svg", "small-a-disc.png", "small-a-disc-dr.png",
                    "mine.svg"}  # fmt: skip
    page = (out / "index.html").read_text(encoding="utf-8")
    # what has two pictures has a row of its own, what has one stands beside others
    assert page.count('<section class="entry">') == 2 and page.count('<section class="entry several">') == 1
    assert "Small &amp; plain" in page and "quick: True" in page and "largest estimated error 1.0e-09" in page
    sheet = ET.parse(out / "contact.svg").getroot()
    assert len(sheet.findall("{http://www.w3.org/2000/svg}image")) == 4
    lines = ET.parse(out / "small-a-step.svg").getroot().findall("{http://www.w3.org/2000/svg}polyline")
    value, slope = ([float(point.split(",")[1]) for point in line.attrib["points"].split()] for line in lines)
    assert value == sorted(value, reverse=True) and slope == sorted(slope, reverse=True)  # t^2 and 2t: upwards


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('program = "small"', 'program = "large"', "there is no large.po beside it"),
        ('over = "the end"', 'ouer = "the end"', "a [[curve]] is not right"),
        ("[[curve]]", "[[curves]]", "`curves` is none of title, about, order, curve, picture, driver"),
        ("range = [", "range = ", "gallery.toml"),
    ],
)
def test_a_table_that_is_wrong_is_told(examples: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    (examples / "small" / "gallery.toml").write_text(TABLE.replace(old, new, 1), encoding="utf-8")
    done = gallery("--root", str(examples), "--out", str(tmp_path / "pages"))
    assert done.returncode == 2 and said in done.stderr and "Traceback" not in done.stderr


def test_one_that_fails_does_not_stop_the_others(examples: Path, tmp_path: Path) -> None:
    (examples / "small" / "gallery.toml").write_text(TABLE.replace("t^2", "q"), encoding="utf-8")
    out = tmp_path / "pages"
    done = gallery("--root", str(examples), "--out", str(out))
    assert done.returncode == 1 and "A step" in done.stderr and "Traceback" not in done.stderr
    assert (out / "small-a-disc.png").exists() and "not made" in (out / "index.html").read_text(encoding="utf-8")


def test_programs_are_shown_beside_samples(tmp_path: Path) -> None:
    done = gallery("paper", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    row = page.partition("<code>paper/image</code>")[2].partition("</tr>")[0]
    assert "-0.19649107" in row and "github.com/ChezJrk/Teg" in row  # the slope of the sum lacks the edge
    assert f"by {'JAX' if importlib.util.find_spec('jax') else 'numpy'}.</p>" in page


@pytest.mark.slow
@pytest.mark.parametrize("folder", DRIVEN, ids=lambda folder: folder.name)
def test_what_python_draws_is_made(folder: Path, tmp_path: Path) -> None:
    """What tables say by themselves is made above, and held to references below."""
    copy = tmp_path / "examples" / folder.name
    shutil.copytree(folder, copy)
    head, *entries = re.split(r"\n(?=\[\[)", (copy / "gallery.toml").read_text(encoding="utf-8"))
    drivers = [entry for entry in entries if entry.startswith("[[driver]]")]
    (copy / "gallery.toml").write_text("\n".join((head, *drivers)), encoding="utf-8")
    done = gallery("--root", str(copy.parent), "--out", str(tmp_path / "pages"))
    assert done.returncode == 0, done.stderr


SHOWN = [
    (entry, chapter) for chapter in chapters(EXAMPLES) for entry in chapter.entries if not isinstance(entry, Driver)
]


@pytest.mark.slow
@pytest.mark.parametrize(("entry", "chapter"), SHOWN, ids=[e.title for e, _ in SHOWN])
def test_what_is_shown_is_right(entry: Curve | Picture, chapter: Chapter) -> None:
    """To 1e-8 by another method, at edges and corners too; where Potto is less sure it is so within its own error.
    (`make gallery` looks at more places, and at their times.)"""
    found = checked(entry, chapter, QUICKLY)
    assert found.places >= 5 and not found.wrong, str(found)
    assert found.unsure <= 2, str(found)
