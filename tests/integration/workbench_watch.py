#!/usr/bin/env python3
"""The workbench's memory as a run is watched: workbench_watch.py PROGRAM FOLDER [MINUTES]

By hand. Headless Chromium watches a run that works for .3 of every 10 seconds, so that an hour costs minutes of a processor. Each
minute a line is printed: minutes, resident memory of the server in kB, its peak, the surface that the page shows. Exit code 1: the
peak was over 100 MB, the page reported an error, or the surface did not move.
"""
import os
import re
import signal
import subprocess
import sys
import time

from workbench_browser import RECIPE, ROWS, Browser, press, process_of


def memory(pid):
    with open(f"/proc/{pid}/status") as file:
        text = file.read()
    return [int(re.search(rf"{name}:\s+(\d+)", text)[1]) for name in ("VmRSS", "VmHWM")]


def main():
    program, folder, minutes = sys.argv[1], sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 60
    with open(f"{folder}/trench.toml", "w") as file:
        file.write(RECIPE.replace("duration = 1.0", "duration = 4.0").replace("cfl = 0.02", "cfl = 0.001"))
    server = subprocess.Popen([program, "open", f"{folder}/trench.toml", "--no-browser"], stdout=subprocess.PIPE, text=True)
    page, run, shown, peak = None, None, set(), 0
    try:
        page = Browser(folder)
        page.send("Page.navigate", url=server.stdout.readline().strip())
        page.until("typeof Sidewall === 'object' && Sidewall.workbench && Sidewall.workbench.state.digest")
        press(page, "Run")
        page.until(f"{ROWS}.some((r) => r.textContent.includes('running'))")
        run = process_of(f"{folder}/results/trench")
        begun, minute = time.time(), 0
        while minute <= minutes:
            os.kill(run, signal.SIGCONT)
            time.sleep(0.3)
            os.kill(run, signal.SIGSTOP)
            time.sleep(9.7)
            if time.time() >= begun + 60 * minute:
                label = page.js("(document.querySelector('.pane .frame-label') || {}).textContent || ''")
                now, peak = memory(server.pid)
                shown.add(label)
                page.events = [event for event in page.events if "id" not in event]
                print(minute, now, peak, label, flush=True)
                minute += 1
        os.kill(run, signal.SIGCONT)
        press(page, "Stop")
        page.until(f"{ROWS}.some((r) => r.textContent.includes('stopped'))")
        errors = page.errors() + page.js("Sidewall.errors")
        print(f"peak {peak} kB, {len(shown)} surfaces seen, errors: {errors}")
        return int(peak >= 100_000 or len(shown) < minutes / 2 or bool(errors))
    finally:
        if run:
            os.kill(run, signal.SIGCONT) if os.path.exists(f"/proc/{run}") else None
        if page:
            page.process.kill()
        server.terminate()


if __name__ == "__main__":
    sys.exit(main())
