#!/usr/bin/env python3
"""Runs of the workbench without a browser: workbench_runs.py PROGRAM FOLDER. Prints what it found as JSON.

A run outlives a server that is killed, another server shows and stops it, and the command line goes on with it.
"""
import json
import os
import random
import socket
import subprocess
import sys
import time
import urllib.parse
import urllib.request


class Server:
    def __init__(self, program, folder):
        self.process = subprocess.Popen([program, "open", folder, "--no-browser"], stdout=subprocess.PIPE, text=True)
        address = self.process.stdout.readline().strip()
        self.base, key = address.split("/?key=")
        self.cookie = f"sidewall_{self.base.rsplit(':', 1)[1]}={key}"

    def ask(self, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Cookie": self.cookie})
        with urllib.request.urlopen(request, timeout=60) as reply:
            return json.load(reply)

    def run(self, name="results/one"):
        runs = [run for run in self.ask("/api/contents")["runs"] if run["path"] == name]
        return runs[0] if runs else {"state": "none"}

    def until(self, *states, name="results/one"):
        end = time.time() + 240
        while self.run(name)["state"] not in states:
            if time.time() > end:
                raise TimeoutError(f"{self.run(name)}, wanted {states}")
            time.sleep(0.05)


def damaged(server, count):
    """Requests with some bytes changed, each on a connection of its own; how many got an answer."""
    port, answered = int(server.base.rsplit(":", 1)[1]), 0
    good = (f"POST /api/stop HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {server.cookie}\r\nContent-Length: 17\r\n\r\n"
            '{"run":"nowhere"}').encode()
    chance = random.Random(1)
    for _ in range(count):
        request = bytearray(good)
        for _ in range(chance.randint(1, 8)):
            request[chance.randrange(len(request))] = chance.randrange(256)
        with socket.create_connection(("127.0.0.1", port), 20) as client:
            client.sendall(request)
            client.shutdown(socket.SHUT_WR)
            answered += bool(client.recv(12))
    return answered


def rows(folder):
    try:
        with open(f"{folder}/results/one/timeline.csv") as file:
            return sum(1 for _ in file)
    except FileNotFoundError:  # it has just begun
        return 0


def main():
    program, folder = sys.argv[1], sys.argv[2]
    found, started = {}, time.time()
    server = Server(program, folder)
    try:
        server.ask("/api/start", {"command": "run", "recipe": "recipe.toml", "output": "results/one"})
        server.until("running")
        server.process.kill()
        server.process.wait()
        server = Server(program, folder)
        found["after_kill"] = server.run()["state"]
        found["damaged_answered"] = damaged(server, 1000)
        before = rows(folder)
        while rows(folder) < before + 2 and time.time() < started + 60:
            time.sleep(0.05)
        found["went_on"] = rows(folder) >= before + 2
        found["asked"] = server.ask("/api/stop", {"run": "results/one"})["asked"]
        server.until("stopped")
        found["checkpoint"] = os.path.exists(f"{folder}/results/one/checkpoint.vdb")
        found["asked_again"] = server.ask("/api/stop", {"run": "results/one"})["asked"]
        resumed = subprocess.run([program, "run", "recipe.toml", "-o", "results/one", "--resume", "--quiet"], cwd=folder)
        found["resumed"] = resumed.returncode
        found["at_last"] = server.run()["state"]
        # A run into another run's folder says in its log why it does not begin.
        server.ask("/api/start", {"command": "run", "recipe": "other.toml", "output": "results/one"})
        end = time.time() + 30
        while time.time() < end:
            log = server.ask("/api/log?run=" + urllib.parse.quote("results/one"))["text"]
            if log.count("sidewall: ") > 1:  # the first is of the run that was stopped
                break
            time.sleep(0.05)
        found["log"] = log
        wrong = server.ask("/api/preview", {"path": "recipe.toml", "text": "[domain\n"})
        found["wrong_line"] = wrong["line"]
        # A sweep that is stopped resumes with the settings of its folder.
        server.ask("/api/start", {"command": "sweep", "recipe": "recipe.toml", "output": "results/sweep",
                                  "vary": ["step[0].rate=0.1,0.2,0.3"], "set": ["advection.cfl=0.02"]})
        server.until("running", name="results/sweep")
        while not server.ask("/api/stop", {"run": "results/sweep"})["asked"]:
            time.sleep(0.05)
        server.until("stopped", name="results/sweep")
        found["sweep_stopped"] = server.run("results/sweep")["state"]
        server.ask("/api/start", {"command": "sweep", "output": "results/sweep", "resume": True})
        server.until("finished", name="results/sweep")
        found["sweep_at_last"] = server.run("results/sweep")["state"]
        # Folders of study and validate, too, are results.
        for kind in ("study", "validation"):
            os.makedirs(f"{folder}/results/{kind}")
            with open(f"{folder}/results/{kind}/{kind}.json", "w") as file:
                file.write("{}")
        found["kinds"] = [server.run(f"results/{kind}").get("kind") for kind in ("study", "validation")]
        server.process.terminate()
        found["exit_code"] = server.process.wait(10)
    finally:
        if server.process.poll() is None:
            server.process.kill()
    print(json.dumps(found, indent=1))


main()
