"use strict";
// Builds the page from its data.
(() => {
  const { el } = Sidewall;
  const data = JSON.parse(document.getElementById("data").textContent);
  const table = data.sections.find((section) => section.source);
  const rows = table ? table.rows : [];

  const charts = (section) => el("div", { class: section.wide ? "charts wide" : "charts" },
                                 ...section.charts.map(Sidewall.lineChart));
  const draw = {
    view: Sidewall.view, charts, bars: Sidewall.bars, table: Sidewall.table, recipe: Sidewall.recipe,
    markdown: Sidewall.markdown, intervals: Sidewall.intervals, correlation: Sidewall.correlation,
    response: (s) => Sidewall.response(s, rows),
    contour: (s) => Sidewall.contours(s, rows),
    matrix: (s) => Sidewall.scatterMatrix(s, rows),
  };

  function build(root) {
    const links = el("nav", { "aria-label": "sections" }), parts = [];
    data.sections.forEach((section, k) => {
      const title = section.title || "Results", id = `part-${k}`;
      links.append(el("a", { href: `#${id}` }, title));
      parts.push(el("section", { id, class: `part-${section.type}` }, el("h2", {}, title), draw[section.type](section),
                    section.note && !["view", "recipe"].includes(section.type) ? el("p", { class: "note" }, section.note) : ""));
    });
    root.append(
      el("header", {}, el("div", { class: "kind" }, data.kind), el("h1", {}, data.title),
         ...data.notes.map((note) => el("p", { class: "warning" }, note)),
         el("dl", { class: "facts" }, ...data.facts.map(([name, value]) =>
           el("div", {}, el("dt", {}, name), el("dd", {}, value))))),
      links, ...parts, el("footer", {}, `Made by sidewall ${data.version} report. This file loads nothing from anywhere.`));
    if (Sidewall.viewer) Sidewall.viewer.begin();
  }

  document.title = `${data.title} (${data.kind})`;
  build(document.getElementById("page"));
})();
