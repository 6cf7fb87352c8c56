#!/usr/bin/env python3
"""Makes the pictures of docs/workbench.md: docs/make_workbench_pictures.py [PROGRAM]

Drives the workbench in headless Chromium through the page's first ten minutes, in a folder of its own. Look at what it has made.
"""
import base64
import pathlib
import re
import subprocess
import sys
import tempfile

DOCS = pathlib.Path(__file__).resolve().parent
sys.path.append(str(DOCS.parent / "tests/integration"))
sys.dont_write_bytecode = True
from workbench_browser import CONTROL, EDITOR, VIEWER, Browser, press, put_cursor  # noqa: E402

FIRST, CONTACT = "trench_deposition.toml", "contact.toml"
CONTACT_TEXT = re.search(r"contact\.toml <<'END'\n(.*?)END\n", (DOCS / "tutorial.md").read_text(), re.S)[1]


def picture(page, name, above=0, height=768):
    page.send("Emulation.setDeviceMetricsOverride", width=1366, height=height, deviceScaleFactor=1, mobile=False)
    page.js(f"scrollTo(0, {above}); new Promise((done) => setTimeout(done, 1500))")
    for quality in range(90, 20, -5):  # files of the guide have less than 100 kB
        data = base64.b64decode(page.send("Page.captureScreenshot", format="jpeg", quality=quality)["data"])
        if len(data) < 98_000:
            break
    (DOCS / f"pictures/workbench_{name}.jpg").write_bytes(data)


def line_of(page, key):
    return page.js(f"{EDITOR}.text.split('\\n').findIndex((x) => x.startsWith('{key}'))")


def finished(page, run):
    page.until(f"Sidewall.workbench.state.runs.some((r) => r.path === 'results/{run}' && r.state === 'finished')", 600)
    page.until("document.querySelectorAll('.results figure').length > 1")


def tour(page):
    page.until(f"Sidewall.workbench.open('{FIRST}', '{FIRST}').then(() => true)")
    page.until("document.querySelector('.findings').textContent.includes('wall time')")
    picture(page, "edit")
    width = line_of(page, "width")
    put_cursor(page, width, "wdith = 3.0")
    page.until("Boolean(document.querySelector('.CodeMirror .problem'))")
    picture(page, "mistake", height=620)
    put_cursor(page, width, "width = 4.0")
    page.until("!document.querySelector('.CodeMirror .problem')")
    page.js("document.activeElement.blur()")
    page.key("Enter", "Enter", 13, CONTROL)
    page.until("parseFloat(((document.querySelector('.pane .frame-label') || {}).textContent || '').slice(4)) > 0.3", 600)
    picture(page, "run", height=1000)
    finished(page, "trench_deposition")
    put_cursor(page, line_of(page, "sticking"), "sticking = 1.0")
    page.until("Sidewall.workbench.state.dirty")
    press(page, "Run")
    finished(page, "trench_deposition-2")
    page.js("document.querySelectorAll('.runs input[type=checkbox]').forEach((box) => box.click())")
    press(page, "Compare")
    page.until("[...document.querySelectorAll('.results h2')].some((x) => x.textContent === 'Last profiles')")
    picture(page, "compare", page.js("document.querySelector('.runs').getBoundingClientRect().top + scrollY - 60"), 1100)
    page.js("document.querySelectorAll('.runs input[type=checkbox]').forEach((box) => box.click())")
    (pathlib.Path(page.folder) / CONTACT).write_text(CONTACT_TEXT)
    page.until(f"Sidewall.workbench.open('{CONTACT}').then(() => true)")
    page.until("document.querySelector('.findings').textContent.includes('wall time')")
    picture(page, "contact")
    page.js("document.querySelector('.masks').open = true; document.querySelector('.masks button').click()")
    page.until(f"document.querySelector('.pane.drawing') && {VIEWER}.fitted.name === 'Top'")
    x, y, w, h = page.js(f"(({{ x, y, width, height }}) => [x, y, width, height])({VIEWER}.canvas.getBoundingClientRect())")
    page.drag([(x + a * w, y + b * h) for a, b in ((0.66, 0.3), (0.74, 0.7), (0.74, 0.7))], lambda: picture(page, "masks"))
    page.js(f"{EDITOR}.mirror.undo()")
    page.key("Escape", "Escape", 27)
    page.until("!document.querySelector('.pane.drawing')")
    press(page, "Run")
    finished(page, "contact")
    sticking = line_of(page, "sticking")
    page.js(f"{EDITOR}.mirror.setCursor({{line: {sticking}, ch: 0}}); document.querySelector('.study').open = true;"
            "[...document.querySelectorAll('.study button')].find((b) => b.textContent.startsWith('Number')).click();"
            "for (const [name, value] of Object.entries({ from: .05, to: .8, runs: 3 }))"
            "  document.querySelector(`.study [aria-label=${name}]`).value = value;"
            "document.querySelector('.study [type=checkbox]').click();"
            "[...document.querySelectorAll('.study button')].find((b) => b.textContent === 'Sweep').click()")
    finished(page, "contact-sweep")
    page.until("[...document.querySelectorAll('.results h2')].some((x) => x.textContent === 'Response curves')")
    picture(page, "sweep", page.js("document.querySelector('.runs').getBoundingClientRect().top + scrollY - 60"), 900)


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else str(DOCS.parent / "build/release/sidewall")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as profile:
        server = subprocess.Popen([program, "open", folder, "--no-browser"], stdout=subprocess.PIPE, text=True)
        page = Browser(profile)
        try:
            page.folder = folder
            page.send("Page.navigate", url=server.stdout.readline().strip())
            page.until("typeof Sidewall === 'object' && Sidewall.workbench && Boolean(Sidewall.workbench.editor)")
            tour(page)
        finally:
            page.process.kill()
            page.process.wait()
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
