"use strict";
// Tables, charts that are drawn from their rows, and texts (recipes, Markdown).
(() => {
  const { el, number } = Sidewall;

  const shown = (value) => typeof value === "number" ? number(value, 6) : value === null ? "" : String(value);

  // Sorts numbers before texts, and empty fields last in either direction.
  function compare(a, b, sign) {
    if (a === null || b === null) return (a === null) - (b === null);
    if (typeof a === "number" && typeof b === "number") return sign * (a - b);
    if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
    return sign * String(a).localeCompare(String(b), "en", { numeric: true });
  }

  // A table whose headings are buttons that sort it.
  Sidewall.table = (section) => {
    const body = el("tbody"), rows = section.rows.slice();
    const numeric = section.columns.map((_, k) => rows.every((row) => row[k] === null || typeof row[k] === "number"));
    const fill = () => body.replaceChildren(...rows.map((row) =>
      el("tr", {}, ...row.map((value, k) => el("td", { class: numeric[k] ? "number" : "" }, shown(value))))));
    const heads = section.columns.map((column, k) => {
      const head = el("th", { scope: "col", class: numeric[k] ? "number" : "", "aria-sort": "none" });
      head.append(el("button", { type: "button", title: "sort", onclick: () => {
        const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
        for (const other of heads) other.setAttribute("aria-sort", "none");
        head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
        rows.sort((a, b) => compare(a[k], b[k], sign));
        fill();
      } }, column.name, column.unit ? el("small", {}, ` [${column.unit}]`) : ""));
      return head;
    });
    fill();
    return el("div", { class: "scroll", tabindex: "0" }, el("table", {}, el("thead", {}, el("tr", {}, ...heads)), body));
  };

  const varies = Sidewall.varies = (rows, column) => {
    const values = rows.map((row) => row[column]).filter((v) => typeof v === "number");
    return values.length > 1 && Math.max(...values) > Math.min(...values);
  };

  const choice = Sidewall.choice = (label, names, change, first = 0) => {
    const select = el("select", { onchange: () => change(select.selectedIndex) },
                      ...names.map((name) => el("option", {}, name)));
    select.selectedIndex = first;
    return el("label", { class: "choice" }, label, " ", select);
  };

  // Charts of every measure over one key. Runs with equal other keys form a line; over kMostLines lines, or single runs, are dots.
  Sidewall.response = (section, rows) => {
    const kMostLines = 8;
    const good = rows.filter((row) => row[row.length - 1] === "ok");
    const measures = section.measures.filter((m) => varies(good, m.column));
    const charts = el("div", { class: "charts" });
    const draw = (chosen) => {
      const key = section.keys[chosen], others = section.keys.filter((k) => k !== key);
      const groups = new Map();
      for (const row of good) {
        if (typeof row[key.column] !== "number") continue;
        const name = others.map((k) => `${k.name} = ${shown(row[k.column])}`).join(", ") || "all runs";
        groups.set(name, [...(groups.get(name) || []), row]);
      }
      const lines = groups.size <= kMostLines && [...groups.values()].every((group) => group.length > 1);
      charts.replaceChildren(...measures.map((measure) => {
        const points = (group) => group.slice().sort((a, b) => a[key.column] - b[key.column])
          .map((row) => [row[key.column], row[measure.column], `run ${row[0]}`]);
        const series = lines ? [...groups].map(([name, group]) => ({ name, points: points(group), marked: true }))
                             : [{ name: "runs", points: points(good), dots: true }];
        return Sidewall.lineChart({ title: measure.name, x: key.label, y: measure.label, log_x: key.log, series,
                                    ramp: lines && series.length > 2 });
      }));
    };
    draw(0);
    return el("div", {}, section.keys.length > 1 ? choice("Over", section.keys.map((k) => k.name), draw) : "",
              charts, measures.length ? "" : el("p", { class: "none" }, "No measure varies."));
  };

  // Scatter plots of all pairs of keys and measures; a run under the pointer is marked in all of them.
  Sidewall.scatterMatrix = (section, rows) => {
    const kMost = 6, kCell = 170;
    const good = rows.filter((row) => row[row.length - 1] === "ok");
    const all = [...section.keys, ...section.measures].filter((d) => varies(good, d.column));
    if (all.length < 2) return el("p", { class: "none" }, "Fewer than two columns vary.");
    const chosen = new Set(all.slice(0, Math.max(4, Math.min(section.keys.length + 3, kMost))));
    let colourBy = all.find((d) => section.measures.includes(d)) || all[0];
    const holder = el("div", { class: "scroll matrix" }), tip = el("p", { class: "note" });
    const scale = (d) => {
      const values = good.map((row) => row[d.column]).filter((v) => typeof v === "number" && (!d.log || v > 0));
      const f = d.log ? Math.log : (v) => v, low = f(Math.min(...values)), high = f(Math.max(...values));
      return (v) => typeof v === "number" && (!d.log || v > 0) ? (high > low ? (f(v) - low) / (high - low) : 0.5) : NaN;
    };
    const draw = () => {
      const dims = all.filter((d) => chosen.has(d)), n = dims.length, scales = dims.map(scale), hue = scale(colourBy);
      const width = Math.max(holder.clientWidth || 640, 92 * n), cell = Math.min(kCell, Math.floor((width - 2) / n));
      const root = Sidewall.svg("svg", { width: n * cell, height: n * cell, role: "img", "aria-label": "scatter matrix" });
      for (let i = 0; i < n; ++i)
        for (let j = 0; j < n; ++j) {
          const group = Sidewall.svg("g", { transform: `translate(${j * cell} ${i * cell})` },
                                     Sidewall.svg("rect", { class: "cell", width: cell - 4, height: cell - 4 }));
          if (i === j) {
            const words = dims[i].label.split(/(?<=[_\].]| )/).reduce((lines, part) => {
              if (lines.length && (lines[lines.length - 1] + part).length * 6.3 < cell - 12) lines[lines.length - 1] += part;
              else lines.push(part);
              return lines;
            }, []);
            words.forEach((word, k) => group.append(Sidewall.svg("text", { class: "axis", x: (cell - 4) / 2,
              y: cell / 2 + 14 * (k - (words.length - 1) / 2), "text-anchor": "middle" }, word)));
          } else {
            good.forEach((row, r) => {
              const x = scales[j](row[dims[j].column]), y = scales[i](row[dims[i].column]);
              if (!Number.isFinite(x) || !Number.isFinite(y)) return;
              const h = hue(row[colourBy.column]);
              group.append(Sidewall.svg("circle", { "data-run": r, cx: 8 + x * (cell - 20), cy: cell - 12 - y * (cell - 20),
                r: 3, fill: Number.isFinite(h) ? Sidewall.shade(h) : "gray" }));
            });
          }
          root.append(group);
        }
      root.addEventListener("pointerover", (event) => {
        const run = event.target.dataset && event.target.dataset.run;
        for (const dot of root.querySelectorAll("circle.here")) dot.classList.remove("here");
        if (run === undefined) return;
        for (const dot of root.querySelectorAll(`circle[data-run="${run}"]`)) dot.classList.add("here");
        tip.textContent = `run ${good[run][0]}: ` + dims.map((d) => `${d.name} = ${shown(good[run][d.column])}`).join(", ");
      });
      holder.replaceChildren(root);
    };
    Sidewall.fitted(holder, draw);
    tip.textContent = "Point at a run to mark it in all plots.";
    const boxes = all.map((d) => {
      const box = el("input", { type: "checkbox", onchange: () => {
        chosen[box.checked ? "add" : "delete"](d);
        draw();
      } });
      box.checked = chosen.has(d);
      return el("label", {}, box, d.name);
    });
    return el("div", {}, choice("Colour by", all.map((d) => d.name), (k) => { colourBy = all[k]; draw(); },
                         all.indexOf(colourBy)),
              el("details", { class: "columns" }, el("summary", {}, "Columns"), ...boxes), holder, tip);
  };

  Sidewall.correlation = (section) => {
    const names = Object.keys(section.matrix);
    const cell = (value) => {
      const strength = Math.min(Math.abs(value || 0), 1);
      return el("td", { class: "number", style: `background:color-mix(in srgb, var(${value < 0 ? "--c1" : "--c0"}) ` +
                        `${(60 * strength).toFixed(0)}%, transparent)` }, number(value, 3));
    };
    return el("div", { class: "scroll" }, el("table", { class: "plain" },
      el("thead", {}, el("tr", {}, el("th"), ...names.map((name) => el("th", { scope: "col" }, name)))),
      el("tbody", {}, ...names.map((a) => el("tr", {}, el("th", { scope: "row" }, a),
                                             ...names.map((b) => cell(section.matrix[a][b])))))));
  };

  // TOML with comments, headers and keys in colour.
  Sidewall.toml = (text) => {
    const code = el("code");
    for (const line of text.replace(/\n$/, "").split("\n")) {
      const match = /^((?:"(?:[^"\\]|\\.)*"|'[^']*'|[^#"'])*)(#.*)?$/.exec(line);
      const [body, comment] = match ? [match[1], match[2] || ""] : [line, ""];
      if (/^\s*\[/.test(body) && !body.includes("=")) code.append(el("span", { class: "header" }, body));
      else {
        const equals = body.indexOf("=");
        if (equals > 0) code.append(el("span", { class: "key" }, body.slice(0, equals)), body.slice(equals));
        else code.append(body);
      }
      if (comment) code.append(el("span", { class: "comment" }, comment));
      code.append("\n");
    }
    return el("pre", { class: "toml", tabindex: "0" }, code);
  };

  Sidewall.recipe = (section) => {
    const parts = [];
    if (section.note) parts.push(el("p", { class: "note" }, section.note));
    if (section.source) {
      parts.push(el("h3", {}, `As written: ${section.source_name}`), Sidewall.toml(section.source));
      if (section.changed)
        parts.push(el("h3", {}, "Differences between this file and what was run"), Sidewall.toml(section.changed));
    }
    if (section.effective)
      parts.push(el("details", section.source ? {} : { open: "" },
                    el("summary", {}, "Effective recipe: every key with the value that was used"),
                    Sidewall.toml(section.effective)));
    if (section.by_material)
      parts.push(el("details", {}, el("summary", {}, "Values used, by material"), Sidewall.toml(section.by_material)));
    return el("div", {}, ...parts);
  };

  // The Markdown of the study's report: headings, tables and paragraphs only.
  Sidewall.markdown = (section) => {
    const out = el("div", { class: "markdown" });
    const cells = (line) => line.replace(/^\||\|\s*$/g, "").split("|").map((c) => c.trim());
    const field = (text) => text === "" || text === "-" ? null : Number.isFinite(Number(text)) ? Number(text) : text;
    for (const block of section.text.split(/\n\s*\n/)) {
      const lines = block.split("\n").filter((line) => line.trim());
      if (!lines.length) continue;
      const heading = /^(#+)\s+(.*)$/.exec(lines[0]);
      if (heading) {
        if (heading[1].length > 1) out.append(el(`h${Math.min(heading[1].length + 1, 5)}`, {}, heading[2]));  // the section has the title
        lines.shift();
      }
      if (lines.length > 1 && lines[0].startsWith("|"))
        out.append(Sidewall.table({ columns: cells(lines[0]).map((name) => ({ name })),
                                    rows: lines.slice(2).map((line) => cells(line).map(field)) }));
      else if (lines.length) out.append(el("p", {}, lines.join(" ")));
    }
    return out;
  };
})();
