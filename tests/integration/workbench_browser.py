#!/usr/bin/env python3
"""The workbench in headless Chromium: workbench_browser.py PROGRAM FOLDER [PICTURE.png [PICTURES]]

Drives the page through the browser's DevTools pipe as a user does, in FOLDER, and prints what it found as JSON; PICTURES_masks.png shows masks as they are drawn.
Exit code 77: Chromium is missing or does not start here.
"""
import base64
import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

RECIPE = """# a trench that is filled
[domain]
extent = [2.0, 1.0]
grid_spacing = 0.05

[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 1.0

[[step]]
model = "single_particle"
duration = 1.0
rate = 0.3
sticking = 0.5
deposit = "SiO2"

[flux]
rays = 50_000

[advection]
cfl = 0.02

[output]
profiles = ["y=0"]

[metrology]
measures = ["depth", "film"]
"""


SMALL = RECIPE.replace("duration = 1.0", "duration = 0.3").replace("cfl = 0.02", "cfl = 0.5")
MASKED = SMALL.replace("[[step]]", """[[step]]
model = "mask"
material = "Resist"
thickness = 0.1
polygons = [{ points = [-0.8, -0.3, 0.8, -0.3, 0.8, 0.3, -0.8, 0.3] }]

[[step]]""")


class Browser:
    """A page of headless Chromium, by the DevTools protocol over a pair of pipes."""

    def __init__(self, folder):
        to_browser, self.out = os.pipe()
        self.back, from_browser = os.pipe()

        def files():  # the browser reads 3 and writes 4
            read, write = os.dup(to_browser), os.dup(from_browser)
            os.dup2(read, 3)
            os.dup2(write, 4)

        self.process = subprocess.Popen(
            ["chromium", "--headless", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--window-size=1360,900", "--remote-debugging-pipe",
             f"--user-data-dir={folder}/profile", "about:blank"],
            preexec_fn=files, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.number, self.buffer, self.events = 0, b"", []
        self.session = self.run = None
        target = [t for t in self.send("Target.getTargets")["targetInfos"] if t["type"] == "page"][0]
        self.session = self.send("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.buffer:
                part = os.read(self.back, 1 << 16)
                if not part:
                    raise ConnectionError("the browser has ended")
                self.buffer += part
            text, self.buffer = self.buffer.split(b"\0", 1)
            reply = json.loads(text)
            if reply.get("id") == self.number:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']}")
                return reply["result"]
            self.events.append(reply)
            if reply.get("method") == "Page.javascriptDialogOpening":  # confirms the question
                answer = {"id": 1_000_000, "method": "Page.handleJavaScriptDialog", "params": {"accept": True},
                          "sessionId": self.session}
                os.write(self.out, json.dumps(answer).encode() + b"\0")

    def js(self, expression):
        result = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def until(self, expression, seconds=240):
        end = time.time() + seconds
        while time.time() < end:
            value = self.js(expression)
            if value:
                return value
            time.sleep(0.1)
        raise TimeoutError(f"{expression}; the page says: {self.js('document.querySelector(`.status`).textContent')}; "
                           f"{self.errors()}")

    def key(self, key, code, number, modifiers=0):
        for kind in ("rawKeyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number,
                      modifiers=modifiers)

    def drag(self, places, halfway=lambda: None):
        """Presses the mouse at the first of these places of the window and releases it at the last."""
        for k, (x, y) in enumerate([places[0], *places, places[-1]]):
            if k == len(places):
                halfway()
            kind = "mousePressed" if k == 1 else "mouseReleased" if k == len(places) + 1 else "mouseMoved"
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(0 < k <= len(places)), clickCount=1)

    def type(self, text):
        self.send("Input.insertText", text=text)

    def picture(self, path):
        self.js("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        data = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def errors(self):
        found = []
        for event in self.events:
            params = event.get("params", {})
            if event.get("method") == "Runtime.exceptionThrown":
                found.append(params["exceptionDetails"].get("exception", {}).get("description", "exception"))
            if event.get("method") == "Runtime.consoleAPICalled" and params["type"] == "error":
                found.append(str(params["args"]))
            if event.get("method") == "Log.entryAdded" and params["entry"]["level"] == "error":
                found.append(params["entry"]["text"] + " " + params["entry"].get("url", ""))
        return found


CONTROL = 2
EDITOR = "Sidewall.workbench.editor"
VIEWER = "document.querySelector('.pane').viewer"
ROWS = "[...document.querySelectorAll('.runs tbody tr')]"


def put_cursor(page, line, text):
    """Replaces a line of the editor by typing."""
    page.until(f"(() => {{ const cm = {EDITOR}.mirror; cm.focus(); cm.setSelection({{line: {line}, ch: 0}}, {{line: {line}, ch: 1000}});"
               f"return cm.hasFocus() && getSelection().toString() === cm.getLine({line}); }})()")  # the browser's own selection has followed
    page.type(text)
    page.until(f"{EDITOR}.mirror.getLine({line}) === {json.dumps(text)}")  # the editor has read it


def press(page, text):
    page.until(f"(() => {{ const b = [...document.querySelectorAll('.bar button')].find((x) => x.textContent === {text!r} "
               "&& !x.hidden && !x.disabled); if (b) b.click(); return Boolean(b); })()")


def drawn(page):
    """What the view shows, as a text that differs with it."""
    return page.js("document.querySelector('.pane canvas[tabindex]').toDataURL().length + '' + "
                   "Sidewall.viewer.section.frames.length + Sidewall.viewer.section.frames[0].surface.p.slice(0, 500)")


def duration_line(text):
    return next(k for k, line in enumerate(text.splitlines()) if line.startswith("duration"))


def edit(page, found):
    page.until("Sidewall.viewer && Sidewall.viewer.aspect > 0")
    before = drawn(page)
    found["highlighted"] = page.js("document.querySelectorAll('.cm-property, .cm-number').length")
    found["corner"] = page.js("document.querySelector('.pane .view .note:last-child').textContent")
    found["offered"] = page.js("[...document.querySelectorAll('.bar optgroup')].map((group) => group.children.length)")
    width = next(k for k, line in enumerate(RECIPE.splitlines()) if line.startswith("width"))
    put_cursor(page, width, "wdith = 0.6")
    found["problem"] = page.until("(document.querySelector('.CodeMirror .problem') || {}).textContent")
    found["problem_below"] = page.js("[...document.querySelectorAll('.CodeMirror-code > div')].findIndex("
                                     "(x) => x.querySelector('.problem'))") == width
    found["at_fault"] = page.js("document.querySelector('.fault').textContent")
    put_cursor(page, width, "width = 0.6 x")
    page.until("document.querySelector('.CodeMirror .problem').textContent.includes('not valid TOML')")
    found["no_toml_at"] = page.js(f"(() => {{ const at = {EDITOR}.fault.find().from; return [at.line, at.ch]; }})()") == [width, 12]
    put_cursor(page, width, "wi")
    page.js(f"{EDITOR}.mirror.closeHint(); {EDITOR}.mirror.focus(); {EDITOR}.mirror.setCursor({{line: {width}, ch: 2}})")
    page.until(f"{EDITOR}.mirror.hasFocus() && !document.querySelector('.CodeMirror-hint')")
    page.key(" ", "Space", 32, CONTROL)
    found["completed"] = page.until("[...document.querySelectorAll('.CodeMirror-hint b')].map((x) => x.textContent).join()")
    page.js(f"{EDITOR}.mirror.closeHint(); {EDITOR}.mirror.getInputField().blur(); new Promise((done) => setTimeout(done, 300))")
    put_cursor(page, width, "width = 0.6")
    page.until("!document.querySelector('.CodeMirror .problem')")
    page.until("document.querySelector('.findings').textContent.includes('wall time')")
    found["findings"] = page.js("document.querySelector('.findings').textContent")
    found["wafer_changed"] = drawn(page) != before
    page.js(f"{EDITOR}.mirror.setCursor({{line: {duration_line(RECIPE)}, ch: 0}})")
    found["help"] = page.js("document.querySelector('.help').textContent")
    page.key("s", "KeyS", 83, CONTROL)
    page.until("!Sidewall.workbench.state.dirty")


def process_of(run):
    """The number of the process that works in a folder of results."""
    with open(f"{run}/.sidewall.lock") as file:
        return int(re.search(r"process (\d+)", file.read())[1])


def let_work(page, reached, seconds=240):
    """Lets the page's run work for moments at a time until something is reached, so that a slow page sees it on its way."""
    end = time.time() + seconds
    while not reached():
        if time.time() > end:
            raise TimeoutError(f"{page.errors()}")
        for kind in (signal.SIGCONT, signal.SIGSTOP):
            os.kill(page.run, kind)
            time.sleep(0.3)


def run_stop_resume(page, found):
    page.js("performance.setResourceTimingBufferSize(10000)")
    state = f"({ROWS}.find((r) => r.textContent.includes('results/trench')) || {{}}).textContent"
    page.until(f"({state} || '').includes('running')")
    label, frames = "(document.querySelector('.pane .frame-label') || {}).textContent || ''", set()

    def three_frames():
        frames.update(re.findall("^t = .*", page.js(label)))
        return len(frames) >= 3

    let_work(page, three_frames)
    found["frames_while_running"] = sorted(frames)
    # While the run continues, the view keeps its direction, and the page its scroll position.
    page.js("Sidewall.viewer.zoom(0.6); window.scrollTo({ top: 150, behavior: 'instant' })")
    page.until("scrollY === 150")
    seen = "[Sidewall.viewer.distance() * Sidewall.viewer.size, scrollY]"
    found["seen_before"], before = page.js(seen), page.js(label)
    let_work(page, lambda: page.js(label) != before)
    found["seen_after"] = page.js(seen)
    page.js("window.scrollTo({ top: 0, behavior: 'instant' })")
    found["curves_while_running"] = page.js("document.querySelectorAll('.results figure').length")
    press(page, "Stop")
    os.kill(page.run, signal.SIGCONT)
    page.until(f"({state} || '').includes('stopped')")
    page.run = None
    found["stopped"] = page.js(state)
    found["last_alone"] = page.js("fetch('/api/results?run=results/trench&last=1').then((reply) => reply.json())"
                                  ".then((one) => [one.sections[0].frames[0].label, one.notes.join()])")
    press(page, "Resume")
    page.until(f"({state} || '').includes('finished')", 300)
    page.until("document.querySelectorAll('.results figure').length > 5")
    found["longest_silence"] = page.js("performance.getEntriesByType('resource').filter((x) => x.name.endsWith('/api/contents'))"
                                       ".reduce(([most, last], x) => [Math.max(most, x.startTime - last), x.startTime], [0, 0])[0]")
    found["charts"] = page.js("[...document.querySelectorAll('.results figcaption')].map((x) => x.textContent)")


def leave(page, found, address, folder):
    """A page that is closed stops nothing: the run goes on, and a new page shows it."""
    page.js("document.activeElement.blur()")
    page.key("Enter", "Enter", 13, CONTROL)
    page.until("Sidewall.workbench.state.runs.some((r) => r.path === 'results/trench' && r.state === 'running')")
    page.run = process_of(f"{folder}/results/trench")
    os.kill(page.run, signal.SIGSTOP)
    page.send("Page.navigate", url="about:blank")
    page.until("location.href === 'about:blank'")
    def rows():
        try:
            with open(f"{folder}/results/trench/timeline.csv") as file:
                return len(file.readlines())
        except FileNotFoundError:  # it has just begun
            return 0

    before = rows()
    let_work(page, lambda: rows() >= before + 2)
    page.send("Page.navigate", url=address)
    page.until("typeof Sidewall === 'object' && Sidewall.workbench && Sidewall.workbench.state.digest")
    found["after_leaving"] = page.until("(Sidewall.workbench.state.runs[0] || {}).state")
    page.js("Sidewall.workbench.show(['results/trench'], true)")


def conflict(page, found, folder):
    """A file that an editor has changed meanwhile: both texts, and the choice between them."""
    path = f"{folder}/small.toml"
    with open(path, "w") as file:
        file.write(SMALL)
    page.until("Sidewall.workbench.open('small.toml').then(() => true)")
    put_cursor(page, 0, "# mine")
    page.until("Sidewall.workbench.state.dirty")
    with open(path, "w") as file:
        file.write(SMALL.replace("# a trench that is filled", "# theirs"))
    page.key("s", "KeyS", 83, CONTROL)
    found["conflict"] = page.until("(document.querySelector('.choice pre') || {}).textContent")
    choose = ("(() => {{ const b = [...document.querySelectorAll('.choice button')].find((x) => x.textContent === '{}');"
              "if (b) b.click(); return Boolean(b); }})()")
    page.until(choose.format("Take theirs"))
    page.until(f"{EDITOR}.text.startsWith('# theirs')")
    put_cursor(page, 0, "# mine")
    page.until("Sidewall.workbench.state.dirty")
    with open(path, "w") as file:
        file.write(SMALL)
    page.key("s", "KeyS", 83, CONTROL)
    page.until(choose.format("Keep mine"))
    page.until("!Sidewall.workbench.state.dirty")
    with open(path) as file:
        found["kept"] = file.readline()
    # A file changed again is not run either; opening another recipe closes the question.
    with open(path, "w") as file:
        file.write(SMALL)
    press(page, "Run")
    found["run_refused"] = page.until("(document.querySelector('.choice p') || {}).textContent")
    page.until("Sidewall.workbench.open('trench.toml').then(() => true)")
    found["choices_elsewhere"] = page.js("document.querySelectorAll('[role=alertdialog]').length")
    # A removed file can be written again.
    page.until("Sidewall.workbench.open('small.toml').then(() => true)")
    put_cursor(page, 0, "# mine")
    page.until("Sidewall.workbench.state.dirty")
    os.remove(path)
    page.key("s", "KeyS", 83, CONTROL)
    found["removed"] = page.until("(document.querySelector('.choice p') || {}).textContent")
    page.until(choose.format("Keep mine"))
    page.until("!Sidewall.workbench.state.dirty")
    with open(path) as file:
        found["anew"] = file.readline()


def other_files(page, found, folder):
    """Masks as lines over the wafer, a step of a chemistry, and a file in another encoding."""
    for name, text in (("masked.toml", MASKED.encode()), ("latin.toml", SMALL.replace("filled", "gef\u00fcllt").encode("latin-1"))):
        with open(f"{folder}/{name}", "wb") as file:
            file.write(text)
    page.until("Sidewall.workbench.open('masked.toml').then(() => true)")
    found["masks"] = page.until("Sidewall.viewer && Sidewall.viewer.outlines.children.length")
    page.js("Sidewall.workbench.open('latin.toml').catch((error) => { window.refused = error.message; })")
    found["latin"] = page.until("window.refused")
    found["still_open"] = page.js("Sidewall.workbench.state.path")
    page.until("(() => { const deck = [...document.querySelectorAll('.bar option')].find((o) => o.value.startsWith('c:'));"
               "if (!deck) return false; const list = document.querySelector('.bar select'); list.value = deck.value;"
               "list.dispatchEvent(new Event('change')); return true; })()")
    found["chemistry"] = page.js(f"{EDITOR}.text.includes('chemistry = ')")


def inserted(before, after):
    """What a text has more than before, in one place and as early as it may be; None if it differs otherwise."""
    begin, more = os.path.commonprefix([before, after]), len(after) - len(before)
    places = [k for k in range(len(begin) + 1) if after[k + more:] == before[k:]]
    return after[places[0]:places[0] + more] if places else None


def masks(page, found):
    """Masks drawn by the mouse, by the keyboard and at a profile, each of which the editor's undo takes away."""
    page.until("Sidewall.workbench.open('small.toml').then(() => true)")
    before, text = page.js(f"{EDITOR}.text"), f"{EDITOR}.text"
    form, outlines = "document.querySelector('.masks')", f"(({VIEWER} || {{}}).outlines || {{ children: [] }}).children.length"

    def undo():
        page.js(f"{EDITOR}.mirror.focus()")
        page.key("z", "KeyZ", 90, CONTROL)

    def draw(*shares, halfway=lambda: None):
        had = page.js(text)
        x, y, w, h = page.until(f"(({{ x, y, width, height }}) => y >= 0 && y + height <= innerHeight && [x, y, width, height])"
                                f"({VIEWER}.canvas.getBoundingClientRect())")
        page.drag([(x + a * w, y + b * h) for a, b in shares], halfway)
        page.until(f"{text} !== {json.dumps(had)}")

    def another_view():
        page.js(f"window.old = {VIEWER}; Sidewall.workbench.open('small.toml')")
        page.until(f"{VIEWER} !== window.old && {VIEWER}.fitted.name === 'Top'")

    def press_draw():
        page.js(f"{form}.open = true; {form}.scrollIntoView();"
                f"[...{form}.querySelectorAll('button')].find((b) => b.textContent.startsWith('Draw')).click()")
        page.until(f"document.querySelector('.pane.drawing') && {VIEWER} && {VIEWER}.aspect > 0 && {VIEWER}.fitted.name !== '3-D'")

    page.js("document.documentElement.style.scrollBehavior = 'auto'")  # no smooth scrolling
    page.until(f"{outlines} === 0 && {VIEWER} && {VIEWER}.aspect > 0")
    press_draw()
    draw((0.4, 0.45), (0.5, 0.5), (0.6, 0.55), halfway=another_view)
    page.until(f"{outlines} === 1")
    found["drawn"] = inserted(before, page.js(text))
    draw((0.65, 0.45), (0.7, 0.5), (0.75, 0.55))
    page.until(f"{outlines} === 2")
    found["drawn_twice"] = inserted(before, page.js(text))
    if len(sys.argv) > 4:
        page.picture(sys.argv[4] + "_masks.png")
    page.key("Escape", "Escape", 27)
    undo()
    undo()
    found["undone"] = page.until(f"{text} === {json.dumps(before)}")
    # Drawing by the keyboard, of what stays instead of what is open.
    page.js(f"for (const [name, v] of Object.entries({{ 'x from': -0.5, 'x to': 0.25, 'y from': -0.2, 'y to': 0.3, thickness: 0.2 }}))"
            f"  {form}.querySelector(`[aria-label='${{name}}']`).value = v; {form}.querySelector('select').selectedIndex = 1;"
            f"{form}.querySelector(`[aria-label='y to']`).focus()")
    page.key("Enter", "Enter", 13)
    page.until(f"{text}.includes('openings = false')")
    found["by_fields"] = inserted(before, page.js(text))
    undo()
    page.until(f"{text} === {json.dumps(before)}")
    put_cursor(page, 2, "extent = [2.0]")
    profile = page.js(text)
    page.until(f"{VIEWER} && {VIEWER}.max[1] - {VIEWER}.min[1] < 0.1")
    page.js(f"{form}.querySelector('select').selectedIndex = 0")
    press_draw()
    draw((0.4, 0.3), (0.45, 0.4), (0.5, 0.3))
    page.until(f"{VIEWER}.section.materials.some((m) => m.name === 'Resist')")
    found["interval"] = inserted(profile, page.js(text))
    if len(sys.argv) > 4:
        page.picture(sys.argv[4] + "_interval.png")
    page.key("Escape", "Escape", 27)
    page.js(f"{form}.open = false")


def sweep(page, found):
    page.until("Sidewall.workbench.open('small.toml').then(() => true)")
    line = next(k for k, text in enumerate(SMALL.splitlines()) if text.startswith("sticking"))
    page.js(f"{EDITOR}.mirror.setCursor({{line: {line}, ch: 0}}); document.querySelector('.study').open = true;"
            "[...document.querySelectorAll('.study button')].find((b) => b.textContent.startsWith('Number')).click();"
            "document.querySelector('.study [aria-label=runs]').value = 2;"
            "[...document.querySelectorAll('.study button')].find((b) => b.textContent === 'Sweep').click()")
    page.until("Sidewall.workbench.state.runs.some((r) => r.path === 'results/small-sweep' && r.state === 'finished')", 300)
    found["swept"] = page.until("[...document.querySelectorAll('.results h2')].map((x) => x.textContent).join()")


def layout(page, found):
    """Widths at which nothing lies beyond the page's edge, and its ground in light and dark."""
    found["widths"], found["grounds"] = [], []
    for width, height in ((1366, 768), (1180, 820), (820, 1180), (768, 1024)):
        page.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        end = time.time() + 15  # until the page is drawn anew at this width
        time.sleep(1)
        while page.js("document.documentElement.scrollWidth > innerWidth") and time.time() < end:
            time.sleep(0.2)
        found["widths"].append(page.js("[document.documentElement.scrollWidth, innerWidth]"))
    page.send("Emulation.clearDeviceMetricsOverride")
    for scheme in ("light", "dark"):
        page.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        found["grounds"].append(page.js("getComputedStyle(document.body).backgroundColor"))
    page.send("Emulation.setEmulatedMedia", features=[])
    page.js("document.querySelector('.bar select').focus()")
    stops = set()
    for _ in range(14):
        page.key("Tab", "Tab", 9)
        stops.add(page.js("document.activeElement.closest('.CodeMirror') ? 'editor' : document.activeElement.textContent.slice(0, 20)"))
        if page.js("Boolean(document.activeElement.closest('.CodeMirror'))"):
            page.key("Escape", "Escape", 27)
    found["stops"] = sorted(stops)


def stranger(page, found, address):
    """What a second browser gets, which has no cookie."""
    own, page.session = page.session, None
    context = page.send("Target.createBrowserContext")["browserContextId"]
    target = page.send("Target.createTarget", url="about:blank", browserContextId=context)["targetId"]
    page.session = page.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    page.send("Page.navigate", url=address.split("?")[0])
    found["stranger"] = page.until("(document.body || {}).textContent")
    found["strangers_status"] = page.js("performance.getEntriesByType('navigation')[0].responseStatus")
    page.session = own


def drop(page, name, text):
    page.js(f"(() => {{ const data = new DataTransfer(); data.items.add(new File([{json.dumps(text)}], '{name}')); "
            "document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true })); })()")


def fit(page, found, folder):
    """Fits the sticking to the profile that a run with sticking 0.5 left."""
    page.until("Sidewall.workbench.open('small.toml').then(() => true)")
    press(page, "Run")
    page.until("Sidewall.workbench.state.runs.some((r) => r.path === 'results/small' && r.state === 'finished')", 300)
    with open(f"{folder}/results/small/profile_0001.csv") as file:
        drop(page, "wanted.csv", file.read())
    page.until("[...document.querySelectorAll('.study option')].some((o) => o.value === 'wanted.csv')")
    line = next(k for k, text in enumerate(SMALL.splitlines()) if text.startswith("sticking"))
    put_cursor(page, line, "sticking = 0.35")
    page.js("document.querySelector('.study').open = true; "
            "document.querySelector('.study select').value = 'wanted.csv'")
    page.js("[...document.querySelectorAll('.study button')].find((b) => b.textContent === 'Fit').click()")
    page.until("Sidewall.workbench.state.runs.some((r) => r.path === 'results/small-fit' && r.state === 'finished')", 300)
    page.until("document.querySelectorAll('.results .interval').length === 1")
    found["fitted"] = page.js("[document.querySelector('.interval code').textContent, "
                              "Number(document.querySelector('.interval b').textContent)]")


def compare(page, found, folder):
    put_cursor(page, duration_line(RECIPE), "duration = 0.3")
    page.until("Sidewall.workbench.state.dirty")
    press(page, "Run")
    page.until(f"{ROWS}.length === 2 && {ROWS}.every((r) => r.textContent.includes('finished'))", 300)
    page.js("document.querySelectorAll('.runs input[type=checkbox]').forEach((box) => box.click())")
    press(page, "Compare")
    page.until("[...document.querySelectorAll('.results h2')].some((x) => x.textContent === 'Last profiles')")
    lines = "[...document.querySelectorAll('.results figure.shape .keys span')].map((x) => x.textContent)"
    found["compared"] = page.js(lines)
    found["differs"] = page.js("[...document.querySelectorAll('.runs th')].map((x) => x.textContent)")
    # A measured profile is dropped on the page.
    drop(page, "measured.csv", "x [nm],z [nm]\n" + "".join(f"{x},100\n" for x in range(-1000, -500, 100)))
    page.until(f"{lines}.includes('measured.csv')")
    found["dots"] = page.until("document.querySelectorAll('.results figure.shape .series circle').length")
    # A profile of the folder is chosen from a list.
    with open(f"{folder}/older.csv", "w") as file:
        file.write("x [nm],z [nm]\n0,100\n10,100\n")
    page.until("(() => { const list = document.querySelector('[aria-label=\"measured profile\"]');"
               "if (![...list.options].some((o) => o.value === 'older.csv')) return false;"
               "list.value = 'older.csv'; list.dispatchEvent(new Event('change')); return true; })()")
    page.until(f"{lines}.includes('older.csv')")


def main():
    program, folder = sys.argv[1], sys.argv[2]
    if not shutil.which("chromium"):
        print("chromium is not installed")
        return 77
    with open(f"{folder}/trench.toml", "w") as file:
        file.write(RECIPE)
    with open(f"{folder}/small.toml", "w") as file:
        file.write(SMALL)
    server = subprocess.Popen([program, "open", f"{folder}/trench.toml", "--no-browser"], stdout=subprocess.PIPE, text=True)
    page = None
    try:
        address = server.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?key=[0-9a-f]{32}", address), address
        try:
            page = Browser(folder)
        except (ConnectionError, OSError):
            print("chromium does not start here")
            return 77
        found = {}
        page.send("Page.navigate", url=address)
        page.until("typeof Sidewall === 'object' && Sidewall.workbench && Sidewall.workbench.state.digest")
        edit(page, found)
        leave(page, found, address, folder)
        run_stop_resume(page, found)
        compare(page, found, folder)
        fit(page, found, folder)
        sweep(page, found)
        masks(page, found)
        conflict(page, found, folder)
        other_files(page, found, folder)
        layout(page, found)
        found["errors"] = page.errors() + page.js("Sidewall.errors")
        stranger(page, found, address)
        found["address_bar"] = page.js("location.href")
        found["width"] = page.js("[document.documentElement.scrollWidth, innerWidth]")
        found["elsewhere"] = page.js("performance.getEntriesByType('resource').map((x) => x.name)"
                                     ".filter((x) => !x.startsWith(location.origin + '/api/'))")
        found["memory_kb"] = int(re.search(r"VmHWM:\s+(\d+)", open(f"/proc/{server.pid}/status").read())[1])
        if len(sys.argv) > 3:
            page.picture(sys.argv[3])
        server.send_signal(2)
        found["exit_code"] = server.wait(10)
        print(json.dumps(found, indent=1))
        return 0
    finally:
        if page:
            page.process.kill()
            page.process.wait()
        if server.poll() is None:
            server.kill()
        server.wait()
        if page and page.run:
            with contextlib.suppress(ProcessLookupError):  # it has ended by itself
                os.kill(page.run, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main())
