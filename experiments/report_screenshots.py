"""Pictures of a report as people see it: desktop, phone, dark and on paper.  Needs Chromium, and no network.

    python experiments/report_screenshots.py demo/report.html --out docs/figures/report
    python experiments/report_screenshots.py out/report.html --section unexplained     # one section alone

It ends with an error if the page scrolls sideways on a phone, or if its cursor reads nothing.
"""

import argparse
import html
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--hide-scrollbars", "--virtual-time-budget=4000",
)  # fmt: skip
DARK = "--blink-settings=preferredColorScheme=0"
PHONE = 390  # width [CSS pixels]
FIRST_SCREEN, HEIGHT, SECTION = 1290, 2900, 600  # of the pictures [CSS pixels]
PATIENCE = 120  # [s]


def chromium(*words: str) -> str:
    """Run Chromium with a profile of its own; what it prints."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not program:
        raise SystemExit("report_screenshots: no Chromium here; install it (on Debian: apt-get install chromium)")
    with tempfile.TemporaryDirectory() as profile:
        command = [program, *FLAGS, f"--user-data-dir={profile}", *words]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE).stdout


def phone_page(report: str, width: int) -> str:
    """The report in a frame as wide as a phone (Chromium's own windows are wider), and how wide it would like to be."""
    measure = ("const f = document.querySelector('iframe'); f.onload = () => { const d = f.contentDocument; "
               "document.body.dataset.width = d.documentElement.scrollWidth; "
               "document.body.dataset.height = d.documentElement.scrollHeight; };")  # fmt: skip
    style = f"border:0;width:{width}px;height:9000px"
    return (f'<!doctype html><meta charset="utf-8"><body style="margin:0"><iframe style="{style}" '
            f'srcdoc="{html.escape(report)}"></iframe><script>{measure}</script></body>')  # fmt: skip


def pointed_at(report: str) -> str:
    """The report with a pointer over its first drawing, so that the pictures show the cursor and what it reads."""
    point = ("const d = document.querySelector('#over-t svg'); if (d) { const r = d.getBoundingClientRect(); "
             "d.dispatchEvent(new PointerEvent('pointermove', {bubbles: true, clientX: r.left + 0.4 * r.width, "
             "clientY: r.top + 50})); }")  # fmt: skip
    return report.replace("</body>", f"<script>{point}</script></body>")


def taken(report: pathlib.Path, out: pathlib.Path) -> list[pathlib.Path]:
    """Write the pictures and the PDF."""
    out.mkdir(parents=True, exist_ok=True)
    source = pointed_at(report.read_text(encoding="utf-8"))
    made = [out / name for name in ("desktop.png", "dark.png", "phone.png", "paper.pdf")]
    with tempfile.TemporaryDirectory() as folder:
        phone = pathlib.Path(folder) / "phone.html"
        phone.write_text(phone_page(source, PHONE), encoding="utf-8")
        file = pathlib.Path(folder) / "report.html"
        file.write_text(source, encoding="utf-8")
        page = file.as_uri()
        chromium(f"--window-size=1200,{FIRST_SCREEN}", f"--screenshot={made[0]}", page)
        chromium(f"--window-size=1200,{HEIGHT}", DARK, f"--screenshot={made[1]}", page)
        chromium(f"--window-size={PHONE},{HEIGHT}", f"--screenshot={made[2]}", phone.as_uri())
        chromium("--no-pdf-header-footer", f"--print-to-pdf={made[3]}", page)
        width = re.search(r'data-width="(\d+)"', chromium("--dump-dom", phone.as_uri()))
        read = re.search(r'id="readout"[^>]*>t <b>', chromium("--dump-dom", page))
    if width is None or int(width[1]) > PHONE:
        raise SystemExit(f"report_screenshots: on a phone of {PHONE} pixels the page is {width and width[1]} wide")
    if read is None:
        raise SystemExit("report_screenshots: the cursor reads nothing; the page's script has failed")
    for picture in made[:3]:
        _compressed(picture)
    return made


def section(report: pathlib.Path, name: str, out: pathlib.Path) -> pathlib.Path:
    """Write a picture of one section."""
    source = report.read_text(encoding="utf-8")
    found = re.search(rf'<section id="{name}">.*?</section>', source, re.S)
    if found is None:
        raise SystemExit(f"report_screenshots: {report} has no section {name!r}")
    alone = "section h2 { margin-top: 0; border: 0; } main { padding-top: 0; }"
    head = source[: source.index("<main>")].replace("</style>", f"{alone}</style>", 1)
    picture = out / f"{name}.png"
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "section.html"
        file.write_text(f"{head}<main>{found[0]}</main></body></html>", encoding="utf-8")
        chromium(f"--window-size=1000,{SECTION}", f"--screenshot={picture}", file.as_uri())
    _compressed(picture)
    return picture


def _compressed(picture: pathlib.Path) -> None:
    """256 colours are enough for a page of text and lines, at a third of the size."""
    from PIL import Image

    with Image.open(picture) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(picture, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("report", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs/figures/report"))
    parser.add_argument("--section", help="identifier of a section to take alone")
    words = parser.parse_args()
    made = [section(words.report, words.section, words.out)] if words.section else taken(words.report, words.out)
    for path in made:
        print(f"{path}: {path.stat().st_size // 1024} kB", file=sys.stderr)


if __name__ == "__main__":
    main()
