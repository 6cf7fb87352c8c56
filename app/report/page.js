"use strict";
// Builds the page from the JSON in it.
(() => {
  const { el } = Sidewall;
  const data = JSON.parse(document.getElementById("data").textContent);

  const charts = (section) => el("div", { class: section.wide ? "charts wide" : "charts" },
                                 ...section.charts.map(Sidewall.lineChart));
  const draw = (rows) => ({
    view: Sidewall.view, charts, bars: Sidewall.bars, table: Sidewall.table, recipe: Sidewall.recipe,
    markdown: Sidewall.markdown, intervals: Sidewall.intervals, correlation: Sidewall.correlation,
    response: (s) => Sidewall.response(s, rows),
    contour: (s) => Sidewall.contours(s, rows),
    matrix: (s) => Sidewall.scatterMatrix(s, rows),
  });

  // The element of each section, by its type. Response, contour and matrix draw the rows of the table with `source`.
  Sidewall.sectionsOf = (page) => {
    const table = page.sections.find((section) => section.source);
    const drawing = draw(table ? table.rows : []);
    return page.sections.map((section, k) =>
      el("section", { id: `part-${k}`, class: `part-${section.type}` }, el("h2", {}, section.title || "Results"),
         drawing[section.type](section),
         section.note && !["view", "recipe"].includes(section.type) ? el("p", { class: "note" }, section.note) : ""));
  };

  function build(root) {
    const links = el("nav", { "aria-label": "sections" }), parts = Sidewall.sectionsOf(data);
    data.sections.forEach((section, k) => links.append(el("a", { href: `#part-${k}` }, section.title || "Results")));
    root.append(
      el("header", {}, el("div", { class: "kind" }, data.kind), el("h1", {}, data.title),
         ...data.notes.map((note) => el("p", { class: "warning" }, note)),
         el("dl", { class: "facts" }, ...data.facts.map(([name, value]) =>
           el("div", {}, el("dt", {}, name), el("dd", {}, value))))),
      links, ...parts, el("footer", {}, `Made by sidewall ${data.version} report. This file loads nothing from anywhere.`));
    if (Sidewall.viewer) Sidewall.viewer.begin();
  }

  if (!data.sections) return;
  document.title = `${data.title} (${data.kind})`;
  build(document.getElementById("page"));
})();
