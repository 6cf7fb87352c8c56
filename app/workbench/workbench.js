"use strict";
// The workbench: a recipe and its initial wafer, the runs of the folder, and their results.
(() => {
  const { el, number, latest } = Sidewall, kTyping = 250, kResting = 700, kPoll = 1000, kLongestPoll = 5000;
  const kSilent = "The workbench does not answer: it has been closed, or the connection is lost.";
  history.replaceState(null, "", "/");  // the token is in a cookie from now on

  const ask = async (path, options) => answered(await fetch(path, options).catch(() => { throw new Error(kSilent); }));
  const get = (path) => ask(path), post = (path, body) => ask(path, { method: "POST", body: JSON.stringify(body) });
  async function answered(response) {
    if (!response.ok) throw new Error((await response.text()).trim() || `status ${response.status}`);
    return response.json();
  }
  const textOf = (path) => get(`/api/text?path=${encodeURIComponent(path)}`);
  const query = (names) => names.map((name) => `run=${encodeURIComponent(name)}`).join("&");

  const state = { path: "", digest: "", dirty: false, round: 0, opens: 0, took: 0, runs: [], table: null, stamps: "", shown: [], shownStamp: "", tables: [],
                  pinned: false, chosen: new Set(), profiles: [] };
  let editor = null, keys = null, fresh = false;  // fresh: the next view is of another wafer

  // The parts of the page.
  const button = (text, title, click) => el("button", { type: "button", title, onclick: click }, text);
  const choose = el("select", { "aria-label": "recipe", onchange: () => pick(choose.value) });
  const status = el("output", { class: "status", "aria-live": "polite" });
  const buttons = {
    save: button("Save", "Ctrl-S", () => tried(save())),
    run: button("Run", "Ctrl-Enter", () => tried(run())),
    stop: button("Stop", "stop the run that is shown; it can be resumed", () => tried(stop(state.shown[0]))),
    resume: button("Resume", "continue the run that is shown", () => tried(resume(state.shown[0]))),
    compare: button("Compare", "show the marked runs side by side", () => show([...state.chosen], true)),
  };
  const view = el("div", { class: "pane" }), findings = el("pre", { class: "findings", tabindex: "0" });
  const runs = el("div", { class: "runs" }), results = el("div", { class: "results" }), left = el("div", { class: "left" });
  const form = Sidewall.studyForm({
    numberAtCursor: () => editor.numberAtCursor(),
    profileNames: () => state.tables,
    start: (asked) => tried(begin(asked)),
  });
  const masks = Sidewall.maskForm({ pane: view, editor: () => editor });
  const measured = el("select", { "aria-label": "measured profile", onchange: () => tried(textOf(measured.value).then(({ text }) => measure(measured.value, text))) });
  document.getElementById("page").replaceWith(el("main", { id: "page", class: "workbench" },
    el("header", { class: "bar" }, el("b", {}, "Sidewall"), choose, buttons.save, buttons.run, buttons.stop, buttons.resume,
       buttons.compare, measured, status),
    left, view, runs, results));

  const say = (text, wrong = false) => {
    status.textContent = text;
    status.classList.toggle("wrong", wrong);
  };
  const failed = (error) => say(error.message, true), tried = (work) => work.catch(failed);
  const told = (reply) => {
    if (reply.problem) throw new Error(reply.problem);
    return reply;
  };

  // Shows a 3-D view, one at a time. The camera stays where it was for the same wafer, else keeps its direction.
  function place(section, element) {
    const last = view.viewer && view.viewer.controls ? view.viewer : null, degrees = 180 / Math.PI;
    const same = last && !fresh && last.section.title === section.title, seen = same && last.moved() && last.seenFrom();
    fresh = false;
    if (same && last.takes(section)) {
      Sidewall.viewer = last;
      return last.show(section);
    }
    const side = last && [degrees * last.controls.getAzimuthalAngle(), 90 - degrees * last.controls.getPolarAngle()];
    view.replaceChildren(el("h2", {}, section.title || ""), element);
    if (last) {
      last.renderer.forceContextLoss();
      last.renderer.dispose();
    }
    view.viewer = Sidewall.viewer;
    if (!view.viewer) return;
    view.viewer.begin();
    if (seen && view.viewer.controls) view.viewer.seeFrom(seen);
    else if (side && view.viewer.controls) view.viewer.place(...side, view.viewer.distance());
    masks.aim();
  }

  // Draws the view of a page in its pane and, if `below`, notes and other sections below.
  function draw(page, below) {
    Sidewall.viewer = null;
    const parts = Sidewall.sectionsOf(page), rest = [];
    page.sections.forEach((section, k) => {
      if (section.type === "view") place(section, parts[k].children[1]);
      else rest.push(parts[k]);
    });
    if (below) kept(results, ...page.notes.map((note) => el("p", { class: "warning" }, note)), ...rest);
  }

  // Replaces the children of an element; keeps scroll positions and the keyboard focus.
  function kept(place, ...children) {
    const boxes = () => [...place.querySelectorAll(".scroll, pre")], at = boxes().map((box) => [box.scrollLeft, box.scrollTop]);
    const stops = () => [...place.querySelectorAll("button, input, select, [tabindex]")];
    const focus = stops().indexOf(document.activeElement), { scrollY } = window;
    place.style.minHeight = `${place.offsetHeight}px`;
    place.replaceChildren(...children);
    boxes().forEach((box, k) => at[k] && box.scrollTo(...at[k]));
    if (stops()[focus]) stops()[focus].focus({ preventScroll: true });
    place.style.minHeight = "";
    if (window.scrollY !== scrollY) window.scrollTo({ top: scrollY, behavior: "instant" });  // not animated, unlike the style of the page
  }

  // Checks and draws the recipe after each change; answers for an earlier text are dropped (state.round).
  let typing = 0;
  const changed = () => {
    state.dirty = true;
    state.pinned = false;
    ++state.round;
    refreshBar();
    clearTimeout(typing);
    typing = setTimeout(() => tried(check()), kTyping);
  };
  const check = latest(async () => {
    const { round } = state, page = await post("/api/preview", { path: state.path, text: editor.text });
    if (round !== state.round) return;
    editor.mark(page.problem ? page : null);
    findings.textContent = "";
    if (page.problem) return;
    if (!state.pinned) draw(page, false);
    setTimeout(() => round === state.round && tried(estimate()), kResting);
  }, failed);
  const estimate = latest(async () => {
    findings.textContent = "Estimating time and memory of a run ...";
    const { round } = state, found = await post("/api/check", { path: state.path, text: editor.text });
    if (round === state.round) findings.textContent = found.problem || found.text;
  }, failed);

  // Recipes.
  async function open(path, shipped) {
    const opening = ++state.opens, { round } = state;
    const found = told(await (shipped ? get(`/api/text?shipped=${encodeURIComponent(shipped)}`) : textOf(path)));
    if (opening !== state.opens) return;  // another recipe was chosen while this one was read
    if (round !== state.round) { refreshBar(); throw new Error(`${path} is not opened, as something was typed meanwhile`); }
    try { Sidewall.Editor.lineEnd(found.text); } catch (error) { refreshBar(); throw new Error(`${path}: ${error.message}`); }
    for (const old of left.querySelectorAll(".choice")) old.remove();
    Object.assign(state, { path, digest: found.digest, dirty: Boolean(shipped), pinned: false });
    fresh = true;
    ++state.round;
    editor.text = found.text;
    document.title = `${path} (Sidewall)`;
    say("");
    refreshBar();
    await check();
  }
  function pick(value) {
    const [kind, name] = [value.slice(0, 2), value.slice(2)];
    if (kind === "c:") {
      editor.append(`\n[[step]]\nmodel = "${keys.decks[name]}"\nchemistry = "${name}"\nduration = 1.0\n`);
      return refreshBar();
    }
    if (state.dirty && !confirm(`${state.path} is not saved: leave it?`)) return refreshBar();
    if (kind === "f:") return tried(open(name));
    const path = prompt("Name of the new recipe", name);
    return path ? tried(open(toml(path), name)) : refreshBar();
  }
  const toml = (name) => name.endsWith(".toml") ? name : `${name}.toml`;
  async function save() {
    if (!state.path) {
      const name = prompt("Name of the new recipe", "recipe.toml");
      if (!name) throw new Error("A recipe is saved under a name.");
      state.path = toml(name);
    }
    const { path } = state, text = editor.text, reply = await post("/api/save", { path, text, digest: state.digest });
    if (path !== state.path) return;  // another recipe is open by now
    if (reply.changed) await conflict(path, reply.digest);
    state.digest = told(reply).digest;
    state.dirty = editor.text !== text;
    say(`${path} is saved`);
    await poll();
    refreshBar();
  }

  // Asks which text to keep when the file has changed on the disk or was removed; shows the lines that differ.
  async function conflict(path, digest) {
    const theirs = digest ? (await textOf(path)).text : "", known = theirs !== undefined;
    if (path !== state.path) return;
    const a = (theirs || "").split("\n"), b = editor.text.split("\n");
    let low = 0, high = 0;
    while (low < Math.min(a.length, b.length) && a[low] === b[low]) ++low;
    while (high < Math.min(a.length, b.length) - low && a[a.length - 1 - high] === b[b.length - 1 - high]) ++high;
    const lines = (text, sign) => text.slice(low, text.length - high).map((line) => `${sign} ${line}\n`).join("");
    const choice = el("section", { class: "choice", role: "alertdialog", tabindex: "-1" });
    const ends = (work) => () => { choice.remove(); tried(work()); };
    const what = !digest ? "was removed from the disk." : !known ? "has changed on the disk, and is no longer in UTF-8."
      : `has changed on the disk since it was opened. From line ${low + 1} they differ, - there, + here:`;
    choice.append(el("p", {}, `${path} ${what}`), digest && known ? el("pre", {}, lines(a, "-") + lines(b, "+")) : "",
      button("Keep mine", "write my text to the file", ends(() => { state.digest = digest; return save(); })),
      digest && known ? button("Take theirs", "load the file and drop my text", ends(() => open(path))) : "",
      button("Later", "decide later and keep editing", ends(async () => {})));
    for (const old of left.querySelectorAll(".choice")) old.remove();
    left.prepend(choice);
    choice.focus();
  }

  // Runs.
  const shownRun = () => state.runs.find((run) => state.shown.length === 1 && run.path === state.shown[0]);
  const resumable = (one) => one && one.state === "stopped" && ["run", "sweep", "fit"].includes(one.kind);
  const free = (stem) => {
    const taken = new Set(state.runs.map((run) => run.path));
    for (let n = 1;; ++n) if (!taken.has(n > 1 ? `${stem}-${n}` : stem)) return n > 1 ? `${stem}-${n}` : stem;
  };
  async function begin(asked) {
    const before = state.path;
    if (state.dirty || !state.digest) await save();
    const { path, digest } = state;
    if (state.dirty || (before && path !== before)) return;
    const stem = path.replace(/^.*\//, "").replace(/\.toml$/, "");
    const output = free(`results/${stem}${asked.command === "run" ? "" : `-${asked.command}`}`);
    const reply = await post("/api/start", { ...asked, recipe: path, output, digest });
    if (reply.changed) await conflict(path, reply.digest);
    told(reply);
    await watch(output);
  }
  const run = () => begin({ command: "run" });
  async function resume(path) {
    const { kind } = state.runs.find((run) => run.path === path);  // sweep, fit: the server takes the recipe from the folder's plan
    told(await post("/api/start", { command: kind, recipe: `${path}/recipe.toml`, output: path, resume: true }));
    await watch(path);
  }
  async function stop(path) {
    const { asked } = await post("/api/stop", { run: path });
    say(asked ? `${path} stops at the next time step` : `${path} is not running on this machine`, !asked);
  }
  // Waits until a started run appears in the list; after 6 s, fails with the last line of its log.
  async function watch(path) {
    say(`${path} begins`);
    for (let tries = 0; tries < 40; ++tries) {
      await new Promise((done) => setTimeout(done, 150));
      await poll();
      const found = state.runs.find((one) => one.path === path);
      if (found && found.state !== "stopped") { say(""); return show([path], true); }
    }
    const { text } = await get(`/api/log?${query([path])}`);
    const lines = text.trim().split("\n");
    throw new Error(lines[lines.length - 1] || `${path} did not begin`);
  }

  // Shows one run with all its results, or several side by side.
  async function show(paths, anew = false) {
    if (!paths.length) { say("Mark runs in the table first.", true); return; }
    const one = state.runs.find((run) => run.path === paths[0]), live = paths.length === 1 && one && one.state === "running";
    if (anew) state.pinned = fresh = true;
    state.shown = paths;
    state.shownStamp = one ? one.stamp + one.state : "";
    refreshBar();
    const page = await get(`/api/results?${query(paths)}${live ? "&last=1" : ""}`);
    if (page.problem) { if (anew && !live) say(page.problem, true); return; }
    if (state.shown !== paths) return;
    state.page = page;
    drawRuns();
    redraw();
  }
  function redraw() {
    const copy = JSON.parse(JSON.stringify(state.page));
    try { Sidewall.overlay(copy, state.profiles); } catch (error) { say(error.message, true); }
    if (copy.kind === "runs") copy.sections = copy.sections.filter((section) => section.type !== "table");  // the table is above already
    if (!state.pinned) copy.sections = copy.sections.filter((section) => section.type !== "view");
    draw(copy, true);
  }
  async function showLog(path) {
    const { text } = await get(`/api/log?${query([path])}`);
    results.replaceChildren(el("section", {}, el("h2", {}, `Log of ${path}`), el("pre", { class: "toml" }, text)));
    state.shown = [];
    refreshBar();
  }

  function progress(one) {
    if (one.state === "finished" || !(one.total > 0)) return one.state;
    const share = Math.min(1, (one.time || 0) / one.total);
    return el("span", { class: "progress", title: `${number(one.time || 0)} of ${number(one.total)} ${one.unit}` },
              el("i", { style: `width:${60 * share}px` }), ` ${one.state}, ${number(one.time || 0, 3)} of ${number(one.total, 3)} ${one.unit}`);
  }
  function drawRuns() {
    const columns = state.table ? state.table.columns.slice(1) : [];
    const rows = new Map(state.table ? state.table.rows.map((row) => [row[0], row.slice(1)]) : []);
    const cell = (value) => el("td", { class: typeof value === "number" ? "number" : "" },
                               typeof value === "number" ? number(value, 5) : value === null || value === undefined ? "" : String(value));
    const body = state.runs.map((one) => {
      const box = el("input", { type: "checkbox", "aria-label": `mark ${one.path}`, onchange: () => {
        if (box.checked) state.chosen.add(one.path); else state.chosen.delete(one.path);
        refreshBar();
      } });
      box.checked = state.chosen.has(one.path);
      return el("tr", { class: state.shown.includes(one.path) ? "shown" : "" }, el("td", {}, box),
        el("td", {}, button(one.path, "show this run", () => tried(show([one.path], true)))), el("td", {}, one.kind), el("td", {}, progress(one)),
        el("td", {}, one.state === "running" ? button("Stop", "stop this run", () => tried(stop(one.path)))
          : resumable(one) ? button("Resume", "continue this run", () => tried(resume(one.path))) : "",
          button("Log", "messages of this run", () => tried(showLog(one.path)))),
        ...columns.map((_, k) => cell((rows.get(one.path) || [])[k])));
    });
    const heads = ["", "run", "kind", "state", "", ...columns.map((c) => c.name + (c.unit ? ` [${c.unit}]` : ""))];
    kept(runs, el("section", {}, el("h2", {}, "Runs"), state.runs.length
      ? el("div", { class: "scroll", tabindex: "0" }, el("table", { class: "plain" },
           el("thead", {}, el("tr", {}, ...heads.map((name) => el("th", { scope: "col" }, name)))), el("tbody", {}, ...body)))
      : el("p", { class: "none" }, "No runs yet: the button Run starts one in the folder results.")));
  }

  function refreshBar() {
    const one = shownRun();
    buttons.save.disabled = !state.dirty;
    buttons.run.disabled = !state.path && !state.dirty;
    buttons.stop.hidden = !one || one.state !== "running";
    buttons.resume.hidden = !resumable(one);
    buttons.compare.disabled = state.chosen.size < 2;
    const option = (kind, name, text = name) => el("option", { value: kind + name }, text);
    const here = (state.recipes || []).slice();
    if (state.path && !here.includes(state.path)) here.unshift(state.path);
    choose.replaceChildren(
      el("optgroup", { label: "Recipes of the folder" },
         ...here.map((name) => option("f:", name, name + (name === state.path && state.dirty ? " *" : "")))),
      el("optgroup", { label: "New, from a recipe that comes with the program" }, ...(keys ? keys.shipped : []).map((name) => option("s:", name))),
      el("optgroup", { label: "Append a step with a chemistry" },
         ...Object.keys(keys ? keys.decks : {}).map((name) => option("c:", name, `${name} (${keys.decks[name]})`))));
    choose.value = `f:${state.path}`;
    measured.hidden = !state.tables.length;
    measured.replaceChildren(option("", "", "Measured profile ..."), ...state.tables.map((name) => option("", name)));
    form.showProfiles();
  }

  let polling = null;
  const poll = () => polling || (polling = look().finally(() => { polling = null; }));
  async function look() {
    const asked = performance.now(), found = await get("/api/contents");
    state.took = performance.now() - asked;
    const stamps = JSON.stringify(found.runs);
    const news = stamps !== state.stamps || JSON.stringify([found.recipes, found.tables]) !== JSON.stringify([state.recipes, state.tables]);
    Object.assign(state, { recipes: found.recipes, tables: found.tables });
    state.runs = found.runs;
    state.first = found.recipe;
    if (found.cut && !state.cut) say("The folder is large: not all of it is listed.", true);
    state.cut = found.cut;
    if (!news) return;
    if (stamps !== state.stamps) state.table = told(await get("/api/table"));
    for (const path of state.chosen) if (!found.runs.some((run) => run.path === path)) state.chosen.delete(path);
    state.stamps = stamps;
    drawRuns();
    if (document.activeElement !== choose) refreshBar();
    const one = shownRun();
    if (one && one.stamp + one.state !== state.shownStamp) await show(state.shown);
  }

  // Draws a measured profile over those of the shown runs. A file dropped on the page is saved in the folder, for fits.
  async function measure(path, text) {
    const { columns } = told(await post("/api/profile", { text }));
    state.profiles = [...state.profiles.filter((profile) => profile.name !== path), { name: path, columns }];
    say(`${path}: over the profiles of the runs that are shown`);
    if (state.page) redraw();
  }
  async function dropped(file) {
    const text = await file.text(), kept = (digest) => post("/api/save", { path: file.name, text, digest });
    Sidewall.profilePoints(told(await post("/api/profile", { text })).columns);
    let saved = await kept("");
    if (saved.changed && confirm(`${file.name} is there already: replace it?`)) saved = await kept(saved.digest);
    if (saved.changed) return;
    told(saved);
    await measure(file.name, text);
    await poll();
  }
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    for (const file of event.dataTransfer.files) tried(dropped(file));
  });
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || !["s", "Enter"].includes(event.key)) return;
    event.preventDefault();
    if (event.repeat) return;
    if (event.key === "s") tried(save());
    else tried(run());
  });
  addEventListener("beforeunload", (event) => { if (state.dirty) event.preventDefault(); });

  async function start() {
    keys = await get("/api/keys");
    editor = new Sidewall.Editor(left, keys.sections, changed);
    left.append(findings, form, masks);
    await tried(poll());
    const first = state.first || state.recipes[0];
    if (first) await tried(open(first));
    else say("This folder has no recipe yet: choose one that comes with the program.");
    refreshBar();
    for (let wrong = "";;) {  // polls; less often where the folder takes long to list
      await new Promise((done) => setTimeout(done, Math.min(kLongestPoll, Math.max(kPoll, 10 * state.took))));
      if (document.hidden) continue;
      const before = wrong;
      wrong = await poll().then(() => "", (error) => error.message);
      if (wrong) say(wrong, true);
      else if (before && status.textContent === before) say("");
    }
  }
  Sidewall.workbench = { state, open, save, run, stop, resume, show, dropped, get editor() { return editor; } };
  tried(start());
})();
