"use strict";
// Adds masks to the recipe: a rectangle, or an interval of a profile, is drawn with the pointer or typed into fields.
(() => {
  const { el } = Sidewall, kHeader = /^[ \t]*\[\[?[ \t]*([A-Za-z_][\w.]*)[ \t]*\]\]?/gm;

  const round = (v) => Number(v.toPrecision(9));
  const polygon = ([x0, x1], [y0, y1]) => `{ points = [${[x0, y0, x1, y0, x1, y1, x0, y1].map(round).join(", ")}] }`;

  // Index of the bracket "]" that closes the one open at index `at`; -1: none.
  const closing = (text, at) => {
    for (let depth = 1; at < text.length; ++at)
      if ("[]".includes(text[at]) && !(depth += text[at] === "[" ? 1 : -1)) return at;
    return -1;
  };

  // Recipe lines of a mask layer. For a profile (no y): a ridge, a film with a slot, or one more slot if `own` is such a film.
  const lines = ([x0, x1], y, { material, thickness, stays }, own) => {
    const place = [`width = ${round(x1 - x0)}`, `position = [${round((x0 + x1) / 2)}, 0.0]`], film = `material = "${material}"`;
    if (y) return [film, 'shape = "mask"', `thickness = ${thickness}`, ...(stays ? ["openings = false"] : []), `polygons = [${polygon([x0, x1], y)}]`];
    if (stays) return [film, 'shape = "fin"', `height = ${thickness}`, ...place];
    return /^\s*shape\s*=\s*"trench"/m.test(own) && /^\s*(thickness|subtract)\s*=/m.test(own)
      ? ["subtract = true", 'shape = "trench"', `depth = ${thickness}`, ...place] : [film, 'shape = "trench"', `thickness = ${thickness}`, ...place];
  };

  // Text to insert and its index: a polygon if the last layer is a mask, else a layer after it. Without y: a profile.
  Sidewall.maskEdit = (text, x, y, mask) => {
    const headers = [...text.matchAll(kHeader)], last = headers.map((header) => header[1]).lastIndexOf("layer");
    const next = headers.slice(last + 1).find(([, name]) => last < 0 ? name.startsWith("step") : !name.startsWith("layer."));
    const begin = last < 0 ? 0 : headers[last].index, end = next ? next.index : text.length, own = last < 0 ? "" : text.slice(begin, end);
    const list = y && /^\s*shape\s*=\s*"mask"/m.test(own) && /^\s*polygons\s*=\s*\[/m.exec(own);
    const close = list ? closing(text, begin + list.index + list[0].length) : -1;
    const before = text.slice(0, Math.max(close, 0)).trimEnd();
    if (close >= 0 && close < end && !before.slice(before.lastIndexOf("\n") + 1).includes("#"))
      return { at: before.length, added: (/[[,]$/.test(before) ? " " : ", ") + polygon(x, y) };
    // Comments directly above the next section belong to that section.
    const above = next ? text.slice(0, end).replace(/(\n[ \t]*#[^\n]*)+\n$/, "\n") : text;
    return { at: above.trimEnd().length, added: `\n\n[[layer]]\n${lines(x, y, mask, own).join("\n")}` };
  };

  // The form: reads a drawing in the pane's 3-D view or its fields, and inserts the mask into the editor's recipe.
  Sidewall.maskForm = ({ pane, editor }) => {
    const { field } = Sidewall, x = [field("x from", 6), field("x to", 6)], y = [field("y from", 6), field("y to", 6)];
    const thickness = field("thickness", 5), material = field("material", 9, "Resist");
    const kind = el("select", { "aria-label": "polygons" }, el("option", {}, "opening here"), el("option", {}, "mask only here"));
    const note = el("output", {}), line = new THREE.LineLoop(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xd0342c, depthTest: false }));
    const flat = () => /^\s*extent\s*=\s*\[[^,\]]*,?\s*\]|^\s*\[cut\]/m.test(editor().text);
    const viewer = () => pane.viewer && pane.viewer.controls ? pane.viewer : null;
    const values = (fields) => fields.map((f) => Number(f.input.value)).sort((a, b) => a - b);
    let drawing = false, from = null;

    const insert = () => {
      const at = [values(x), ...(flat() ? [] : [values(y)])];
      if (!(at.every(([low, high]) => high > low) && Number(thickness.input.value) > 0)) {
        note.textContent = "A mask needs both ends in each direction, and a thickness.";
        return;
      }
      note.textContent = "";
      const { mirror } = editor(), edit = Sidewall.maskEdit(mirror.getValue(), at[0], at[1], {
        material: material.input.value.replace(/["\\]/g, ""), thickness: Number(thickness.input.value), stays: kind.selectedIndex === 1 });
      mirror.replaceRange(edit.added, mirror.posFromIndex(edit.at), undefined, "mask");
      mirror.setCursor(mirror.posFromIndex(edit.at + edit.added.length).line, 0);
      mirror.focus();
    };

    // The pointer's place on the wafer's top plane, or in a profile's plane: x, y, clamped to the domain and rounded.
    const place = (event) => {
      const { canvas, eye, min, max, middle, size } = viewer(), box = canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
      ray.setFromCamera({ x: 2 * (event.clientX - box.left) / box.width - 1, y: 1 - 2 * (event.clientY - box.top) / box.height }, eye);
      const plane = flat() ? new THREE.Plane(new THREE.Vector3(0, 1, 0), 0)
        : new THREE.Plane(new THREE.Vector3(0, 0, 1), -viewer().local(max[2], 2));
      const hit = ray.ray.intersectPlane(plane, new THREE.Vector3()), step = 10 ** Math.floor(Math.log10((max[0] - min[0]) / 100));
      return hit && ["x", "y"].map((axis, k) => {
        const at = Math.min(Math.max(hit[axis] * size + middle[k], min[k]), max[k]);
        return round(step * Math.round(at / step));
      });
    };
    const show = (to) => {
      [x, y].forEach((fields, k) => [from[k], to[k]].sort((a, b) => a - b).forEach((v, i) => { fields[i].input.value = v; }));
      const v = viewer(), z = v.local(v.max[2], 2) + 0.03, [[x0, x1], [y0, y1]] = flat() ? [values(x), [v.min[1], v.max[1]]] : [values(x), values(y)];
      line.geometry.setFromPoints([[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(([a, b]) => new THREE.Vector3(v.local(a, 0), v.local(b, 1), z)));
      v.scene.add(line);
      v.refresh();
    };
    const done = () => {
      from = null;
      if (line.parent) line.parent.remove(line);
      if (viewer()) { viewer().controls.enabled = true; viewer().refresh(); }
    };
    const button = (text, click) => el("button", { type: "button", onclick: click }, text);
    const toggle = button("Draw on the wafer", () => draw(!drawing));
    const draw = (on) => {
      drawing = on && Boolean(viewer());
      toggle.setAttribute("aria-pressed", drawing);
      pane.classList.toggle("drawing", drawing);
      done();
      form.aim();
      if (drawing) viewer().canvas.scrollIntoView({ block: "nearest" });
      note.textContent = drawing ? `Drag ${flat() ? "an interval" : "a rectangle"} over the wafer; Esc ends it.` : "";
    };

    // The pane captures the pointer, because a new view replaces the canvas while the user draws.
    pane.addEventListener("pointerdown", (event) => {
      if (!drawing || !viewer() || event.target !== viewer().canvas || event.button !== 0 || !(from = place(event))) return;
      viewer().controls.enabled = false;
      pane.setPointerCapture(event.pointerId);
      show(from);
    }, true);
    pane.addEventListener("pointermove", (event) => { const to = from && viewer() && place(event); if (to) show(to); });
    pane.addEventListener("pointerup", () => { if (!from) return; done(); insert(); });
    pane.addEventListener("pointercancel", done);
    addEventListener("keydown", (event) => event.key === "Escape" && drawing && draw(false));

    const form = el("details", { class: "study masks" }, el("summary", {}, "Draw a mask"),
      el("div", { class: "row" }, toggle, ...[...x, ...y].map((f) => f.row)),
      el("div", { class: "row" }, material.row, thickness.row, kind, button("Insert", insert)), note);
    form.addEventListener("keydown", (event) => event.key === "Enter" && event.target.type === "text" && insert());
    form.addEventListener("toggle", () => { if (form.open) form.aim(); else draw(false); });
    // Fills in a thickness; while drawing, removes the cut and shows the whole wafer from the top (profile: front).
    form.aim = () => {
      const v = viewer();
      for (const { row } of y) row.hidden = flat();
      if (v && !thickness.input.value) thickness.input.value = Number(((v.max[0] - v.min[0]) / 10).toPrecision(1));
      if (!v || !drawing) return;
      const cut = pane.querySelector("select[aria-label=cut]");
      cut.selectedIndex = 0;
      cut.dispatchEvent(new Event("change"));
      v.fit(flat() ? "Front" : "Top");
      v.refresh();
    };
    return form;
  };
})();
