"use strict";
// Builds the page from its data, and checks it where the address ends in #selftest.
(() => {
  const { el } = Sidewall;
  const data = JSON.parse(document.getElementById("data").textContent);
  const table = data.sections.find((section) => section.source);
  const rows = table ? table.rows : [];

  const charts = (section) => el("div", { class: section.wide ? "charts wide" : "charts" },
                                 ...section.charts.map(Sidewall.lineChart));
  const draw = {
    view: Sidewall.view, charts, bars: Sidewall.bars, table: Sidewall.table, recipe: Sidewall.recipe,
    markdown: Sidewall.markdown, intervals: Sidewall.intervals,
    correlation: Sidewall.correlation, response: (s) => Sidewall.response(s, rows),
    matrix: (s) => Sidewall.scatterMatrix(s, rows),
  };

  // Light, dark, or as the system has it.
  function themeButton() {
    const names = ["auto", "light", "dark"], root = document.documentElement;
    const button = el("button", { type: "button", class: "theme", title: "light or dark", onclick: () => {
      const next = names[(names.indexOf(root.dataset.theme || "auto") + 1) % names.length];
      root.dataset.theme = next;
      button.textContent = `theme: ${next}`;
    } }, "theme: auto");
    return button;
  }

  function build(root) {
    const links = el("nav", { "aria-label": "sections" }), parts = [];
    data.sections.forEach((section, k) => {
      const title = section.title || "Results", id = `part-${k}`;
      links.append(el("a", { href: `#${id}` }, title));
      parts.push(el("section", { id, class: `part-${section.type}` }, el("h2", {}, title), draw[section.type](section),
                    section.note && !["view", "recipe"].includes(section.type) ? el("p", { class: "note" }, section.note) : ""));
    });
    root.append(
      el("header", {}, el("div", { class: "kind" }, data.kind), el("h1", {}, data.title), themeButton(),
         ...data.notes.map((note) => el("p", { class: "warning" }, note)),
         el("dl", { class: "facts" }, ...data.facts.map(([name, value]) =>
           el("div", {}, el("dt", {}, name), el("dd", {}, value))))),
      links, ...parts, el("footer", {}, `Made by sidewall ${data.version} report. This file loads nothing from anywhere.`));
    if (Sidewall.viewer) Sidewall.viewer.begin();
  }

  // What a picture holds, as text that differs where pictures do, and how many colours.
  function pixels(viewer) {
    viewer.draw();
    const gl = viewer.renderer.getContext(), width = gl.drawingBufferWidth, height = gl.drawingBufferHeight;
    const all = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, all);
    let hash = 0;
    const colours = new Set();
    for (let i = 0; i < all.length; i += 4) {
      hash = (Math.imul(hash, 31) + all[i] + 256 * all[i + 1] + 65536 * all[i + 2]) | 0;
      if (all[i + 3] === 255) colours.add(all[i] << 16 | all[i + 1] << 8 | all[i + 2]);
    }
    const at = (x, y) => {
      const i = 4 * (Math.min(Math.floor(x * width), width - 1) + width * Math.min(Math.floor((1 - y) * height), height - 1));
      return all.slice(i, i + 4);
    };
    return { hash, colours: colours.size, at };
  }

  const far = (a, b) => Math.max(...[0, 1, 2].map((k) => Math.abs(a[k] - b[k])));

  // Places of the picture, each with those around it, and what lies there.
  function places(viewer) {
    const list = [], near = 0.004;
    for (let i = 1; i < 24; ++i)
      for (let j = 1; j < 16; ++j) {
        const x = i / 24, y = j / 16, place = viewer.picked(x, y);
        if (!place) continue;
        const around = [[near, 0], [-near, 0], [0, near], [0, -near]].map(([dx, dy]) => viewer.picked(x + dx, y + dy));
        if (around.every((other) => other && other.face === place.face)) list.push({ x, y, place, around });
      }
    return list;
  }

  // Where one thing lies under a place and those around it, the legend's colour for it must be there.
  function compareWithLegend(viewer, list) {
    const picture = pixels(viewer), bar = document.querySelector(".bar-map");
    const swatches = [...document.querySelectorAll("[data-material]")].map((swatch) =>
      ({ id: Number(swatch.dataset.material), colour: getComputedStyle(swatch).backgroundColor.match(/\d+/g).map(Number) }));
    const expected = (place) => {
      if (place.face && viewer.colour >= 0) return null;  // sections are muted beside the colours of values
      if (place.face) return swatches.map((s) => s.colour).sort((a, b) => far(a, place.colour) - far(b, place.colour))[0];
      if (viewer.colour < 0) return (swatches.find((s) => s.id === place.material) || { colour: [-99, -99, -99] }).colour;
      if (!Number.isFinite(place.share)) return null;
      const i = Math.round(255 * Math.min(Math.max(place.share, 0), 1));
      return bar.getContext("2d").getImageData(i, 0, 1, 1).data;
    };
    const result = { tried: 0, alike: 0, faces: 0, worst: null };
    for (const { x, y, place, around } of list) {
      const wanted = expected(viewer.told(place));
      // At borders, and where colours run steeply, a pixel beside the ray's own differs.
      const others = around.map((other) => expected(viewer.told(other)));
      if (!wanted || others.some((other) => !other || far(other, wanted) > 8)) continue;
      // Outlines between materials are dark.
      if (place.face && [place, ...around].some((p) => far(p.colour, wanted) > 30)) continue;
      ++result.tried;
      result.faces += place.face ? 1 : 0;
      const drawn = picture.at(x, y), off = far(drawn, wanted);
      if (off <= 10) ++result.alike;
      else if (!result.worst || off > result.worst.off) result.worst = { off, x, y, wanted: [...wanted], drawn: [...drawn] };
    }
    return result;
  }

  function selftest() {
    const viewer = Sidewall.viewer, result = { kind: data.kind, sections: data.sections.map((s) => s.type) };
    if (viewer) {
      viewer.draw();
      const last = pixels(viewer);
      result.colours = last.colours;
      result.frames = viewer.section.frames.length;
      viewer.slider.value = 0;
      viewer.slider.dispatchEvent(new Event("input"));
      result.slider_changes_picture = pixels(viewer).hash !== last.hash;
      viewer.slider.value = result.frames - 1;
      viewer.slider.dispatchEvent(new Event("input"));
      result.slider_returns_picture = pixels(viewer).hash === last.hash;
      const key = (name) => viewer.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: name }));
      key("ArrowLeft");
      result.key_turns_picture = pixels(viewer).hash !== last.hash;
      key("0");
      const cut = viewer.cutAxis;
      viewer.cutAxis = cut === 0 ? 1 : 0;
      viewer.refresh("cut");
      result.cut_changes_picture = pixels(viewer).hash !== last.hash;
      viewer.cutAxis = cut;
      viewer.shading = false;
      viewer.refresh("colour");
      viewer.draw();
      const list = places(viewer);
      result.legend = { material: compareWithLegend(viewer, list) };
      viewer.section.attributes.forEach((attribute, k) => {
        viewer.chooseColour(k);
        result.legend[attribute.label] = compareWithLegend(viewer, list);
      });
      viewer.shading = true;
      viewer.chooseColour(-1);
    }
    const table = document.querySelector("th button");
    if (table) {
      const first = () => document.querySelector("tbody td").textContent;
      table.click();
      const up = first();
      table.click();
      result.sorts = [up, first()];
    }
    result.charts = document.querySelectorAll(".plot svg, .matrix svg").length;
    // Lines of one chart that neither colour nor dashes tell apart, and the most lines of a chart.
    const looks = [...document.querySelectorAll(".plot svg")].map((chart) => [...chart.querySelectorAll(".series path[d^=M]")].map((path) =>
      getComputedStyle(path).stroke + getComputedStyle(path).strokeDasharray));
    result.alike_lines = looks.reduce((sum, all) => sum + all.length - new Set(all).size, 0);
    result.most_lines = Math.max(0, ...looks.map((all) => all.length));
    result.not_numbers = [...document.querySelectorAll("svg *")].filter((e) =>
      [...e.attributes].some((a) => /NaN|undefined|Infinity/.test(a.value))).length;
    result.requests = performance.getEntriesByType("resource").filter((e) => !/^(data|blob):/.test(e.name)).length;
    result.width = [document.documentElement.scrollWidth, innerWidth];
    result.webgl = Boolean(viewer);
    result.errors = Sidewall.errors;
    document.body.append(el("pre", { id: "selftest", hidden: "" }, JSON.stringify(result)));
  }

  if (location.hash === "#selftest")
    for (const kind of ["error", "warn"]) {
      const before = console[kind];
      console[kind] = (...words) => { Sidewall.errors.push(words.join(" ")); before(...words); };
    }
  document.title = `${data.title} (${data.kind})`;
  build(document.getElementById("page"));
  // After the charts have got their widths, which a busy browser gives late.
  const drawn = () => [...document.querySelectorAll(".plot, .matrix")].every((chart) => chart.childElementCount > 0);
  const test = (waits) => {
    if (waits > 0 && !drawn()) return setTimeout(test, 100, waits - 1);
    try { selftest(); } catch (error) {
      document.body.append(el("pre", { id: "selftest", hidden: "" }, JSON.stringify({ errors: [String(error.stack)] })));
    }
  };
  if (location.hash === "#selftest") setTimeout(test, 300, 150);
})();
