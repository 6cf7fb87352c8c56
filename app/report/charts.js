"use strict";
// Charts as SVG, drawn at the width of the page. All text becomes text nodes: nothing in a recipe or a file's name
// is read as markup.
const Sidewall = { errors: [] };
addEventListener("error", (event) => Sidewall.errors.push(String(event.message)));

(() => {
  const kHeight = 260, kColours = 8;

  // An element with attributes, listeners ("on...") and children; strings become text nodes.
  Sidewall.el = (name, attributes = {}, ...children) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes))
      if (key === "class") element.className = value;
      else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
      else element.setAttribute(key, value);
    element.append(...children);
    return element;
  };
  const { el } = Sidewall;

  // The SVG namespace, taken from an element that the HTML parser made.
  const template = document.createElement("template");
  template.innerHTML = "<svg></svg>";
  const kSvg = template.content.firstChild.namespaceURI;
  const svg = (name, attributes = {}, ...children) => {
    const element = document.createElementNS(kSvg, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  };

  Sidewall.number = (value, digits = 4) => {
    if (typeof value !== "number" || !Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (Number.isInteger(value) && size < 1e7) return String(value);
    const text = size >= 1e6 || size < 1e-4 ? value.toExponential(Math.max(0, digits - 2)) : value.toPrecision(digits);
    return text.includes("e") ? text.replace(/\.?0+e/, "e").replace("e+", "e")
                              : text.includes(".") ? text.replace(/\.?0+$/, "") : text;
  };
  const number = Sidewall.number;

  // The viridis map of van der Walt and Smith, 2015, as red, green, blue from 0 to 255.
  const kViridis = [[68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140],
                    [34, 168, 132], [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37]];
  const between = (colours, share) => {
    const at = Math.min(Math.max(share, 0), 1) * (colours.length - 1);
    const i = Math.min(Math.floor(at), colours.length - 2), w = at - i;
    return colours[i].map((c, k) => Math.round(c + w * (colours[i + 1][k] - c)));
  };
  Sidewall.viridis = (share) => between(kViridis, share);
  Sidewall.css = (rgb) => `rgb(${rgb.join(",")})`;

  // Colours of ordered lines and dots: visible on white and on black, unlike the ends of viridis.
  const kShades = [[70, 105, 220], [30, 145, 180], [50, 160, 105], [175, 150, 40], [225, 105, 45]];
  Sidewall.shade = (share) => Sidewall.css(between(kShades, share));

  // Round numbers within [low, high], about `wanted` of them.
  Sidewall.ticks = (low, high, wanted) => {
    const rough = (high - low) / Math.max(1, wanted);
    if (!(rough > 0)) return [low];
    const decade = 10 ** Math.floor(Math.log10(rough));
    const step = decade * [1, 2, 5, 10].find((f) => f * decade >= rough * (1 - 1e-9));
    const list = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
      list.push(Number((k * step).toPrecision(12)));
    return list;
  };
  const logTicks = (low, high) => {
    const list = [], few = Math.log10(high / low) < 2.5;
    for (let d = Math.floor(Math.log10(low)); d <= Math.log10(high) + 1e-9; ++d)
      for (const f of few ? [1, 2, 5] : [1])
        if (f * 10 ** d >= low * 0.999 && f * 10 ** d <= high * 1.001) list.push(Number((f * 10 ** d).toPrecision(6)));
    return list.length > 1 ? list : Sidewall.ticks(low, high, 4);
  };

  // An axis: its range, its ticks and the map from values to pixels.
  function axis(values, from, to, log, wanted) {
    let low = Math.min(...values), high = Math.max(...values);
    if (log) {
      if (low === high) { low /= 2; high *= 2; }
      const f = (to - from) / Math.log(high / low);
      return { low, high, ticks: logTicks(low, high), at: (v) => from + Math.log(v / low) * f };
    }
    if (low === high) {
      const margin = Math.abs(low) * 0.05 || 1;
      low -= margin;
      high += margin;
    }
    const margin = 0.04 * (high - low);
    if (low !== 0) low -= margin;
    high += margin;
    return { low, high, ticks: Sidewall.ticks(low, high, wanted), at: (v) => from + (v - low) / (high - low) * (to - from) };
  }

  // Gives both axes the same scale, centred, so that shapes are not distorted.
  function equalAxes(x, y, box) {
    const scale = Math.min((box.right - box.left) / (x.high - x.low), (box.bottom - box.top) / (y.high - y.low));
    const grow = (a, pixels) => {
      const middle = (a.low + a.high) / 2, half = pixels / scale / 2;
      a.low = middle - half;
      a.high = middle + half;
    };
    grow(x, box.right - box.left);
    grow(y, box.bottom - box.top);
    x.at = (v) => box.left + (v - x.low) * scale;
    y.at = (v) => box.bottom - (v - y.low) * scale;
    x.ticks = Sidewall.ticks(x.low, x.high, (box.right - box.left) / 80);
    y.ticks = Sidewall.ticks(y.low, y.high, (box.bottom - box.top) / 45);
  }

  const drawable = (p, chart) => p && Number.isFinite(p[0]) && Number.isFinite(p[1]) && p[0] !== null && p[1] !== null &&
                                 (!chart.log_x || p[0] > 0) && (!chart.log_y || p[1] > 0);

  const seriesColour = (chart, k) =>
    chart.ramp ? Sidewall.shade(chart.series.length > 1 ? k / (chart.series.length - 1) : 0.4)
               : `var(--c${k % kColours})`;

  // The colours repeat after kColours lines; lines after that are dashed, with another length each time.
  const seriesDash = (chart, k) => (chart.ramp ? 0 : Math.floor(k / kColours));
  const dashes = (n) => (n ? [2 + 6 / n, 4] : []);

  function drawAxes(root, chart, x, y, box) {
    const grid = svg("g", { class: "grid" }), labels = svg("g", { class: "ticks" });
    for (const v of x.ticks) {
      grid.append(svg("line", { x1: x.at(v), x2: x.at(v), y1: box.top, y2: box.bottom }));
      labels.append(svg("text", { x: x.at(v), y: box.bottom + 16, "text-anchor": "middle" }, number(v)));
    }
    for (const v of y.ticks) {
      grid.append(svg("line", { x1: box.left, x2: box.right, y1: y.at(v), y2: y.at(v) }));
      labels.append(svg("text", { x: box.left - 7, y: y.at(v) + 4, "text-anchor": "end" }, number(v)));
    }
    for (const [at, name] of chart.marks || [])
      if (at >= x.low && at <= x.high)
        grid.append(svg("line", { class: "mark", x1: x.at(at), x2: x.at(at), y1: box.top, y2: box.bottom },
                        svg("title", {}, name)),
                    svg("text", { class: "mark", transform: `translate(${x.at(at) + 11} ${box.top + 3}) rotate(-90)`,
                                  "text-anchor": "end" }, name.length > 30 ? `${name.slice(0, 29)}…` : name));
    root.append(grid, labels,
                svg("path", { class: "frame", d: `M${box.left} ${box.top}V${box.bottom}H${box.right}` }),
                svg("text", { class: "axis", x: (box.left + box.right) / 2, y: box.bottom + 34, "text-anchor": "middle" },
                    chart.x),
                svg("text", { class: "axis", x: 0, y: 0, "text-anchor": "middle",
                              transform: `translate(13 ${(box.top + box.bottom) / 2}) rotate(-90)` }, chart.y));
  }

  function drawSeries(root, chart, x, y) {
    return chart.series.map((series, k) => {
      const group = svg("g", { class: "series", style: `--colour:${series.colour || seriesColour(chart, k)}` });
      let path = "", pen = false, count = 0;
      for (const p of series.points) {
        if (!drawable(p, chart)) { pen = false; continue; }
        path += `${pen ? "L" : "M"}${x.at(p[0]).toFixed(1)} ${y.at(p[1]).toFixed(1)}`;
        pen = true;
        ++count;
      }
      if (!series.dots) group.append(svg("path", { d: path, "stroke-dasharray": dashes(seriesDash(chart, k)).join(" ") || "none" }));
      if (series.dots || series.marked || count === 1)
        for (const p of series.points)
          if (drawable(p, chart)) group.append(svg("circle", { cx: x.at(p[0]).toFixed(1), cy: y.at(p[1]).toFixed(1), r: 3.2 }));
      root.append(group);
      return group;
    });
  }

  // Shows the point nearest to the pointer with its values, and dims the other lines.
  function addReadout(root, chart, x, y, groups, tip) {
    const dot = svg("circle", { class: "here", r: 4.5, visibility: "hidden" });
    root.append(dot);
    const leave = () => {
      dot.setAttribute("visibility", "hidden");
      tip.hidden = true;
      for (const g of groups) g.classList.remove("dim");
    };
    root.addEventListener("pointerleave", leave);
    root.addEventListener("pointermove", (event) => {
      const place = root.getBoundingClientRect(), px = event.clientX - place.left, py = event.clientY - place.top;
      let best = null, least = 60 ** 2;
      chart.series.forEach((series, k) => series.points.forEach((p) => {
        if (!drawable(p, chart)) return;
        const far = (x.at(p[0]) - px) ** 2 + (y.at(p[1]) - py) ** 2;
        if (far < least) { least = far; best = { p, k, name: p[2] || series.name }; }
      }));
      if (!best) return leave();
      const cx = x.at(best.p[0]), cy = y.at(best.p[1]);
      dot.setAttribute("cx", cx);
      dot.setAttribute("cy", cy);
      dot.setAttribute("visibility", "visible");
      if (groups.length > 1) groups.forEach((g, k) => g.classList.toggle("dim", k !== best.k));
      tip.replaceChildren(el("b", {}, best.name || ""), el("br"), `${chart.x}: ${number(best.p[0], 5)}`, el("br"),
                          `${chart.y}: ${number(best.p[1], 5)}`);
      tip.hidden = false;
      const right = cx > place.width / 2;
      tip.style.left = right ? "" : `${cx + 10}px`;
      tip.style.right = right ? `${place.width - cx + 10}px` : "";
      tip.style.top = `${Math.max(0, cy - 30)}px`;
    });
  }

  function keyOf(chart, series, k) {
    const colour = series.colour || seriesColour(chart, k), [drawn, gap] = dashes(seriesDash(chart, k));
    return gap ? `repeating-linear-gradient(90deg,${colour} 0 ${drawn}px,transparent ${drawn}px ${drawn + gap}px)` : colour;
  }

  function legend(chart) {
    if (chart.series.length < 2) return "";
    if (chart.ramp && chart.series.length > 6) {
      const stops = [0, 0.25, 0.5, 0.75, 1].map(Sidewall.shade);
      return el("div", { class: "ramp" }, el("span", {}, chart.series[0].name),
                el("i", { style: `background:linear-gradient(90deg,${stops.join(",")})` }),
                el("span", {}, chart.series[chart.series.length - 1].name));
    }
    return el("div", { class: "keys" }, ...chart.series.map((series, k) =>
      el("span", {}, el("i", { style: `background:${keyOf(chart, series, k)}` }), series.name)));
  }

  // Draws now and whenever the width changes.
  Sidewall.fitted = (holder, draw) => {
    let last = 0;
    const again = () => {
      const width = holder.clientWidth;
      if (width && width !== last) { last = width; draw(width); }
    };
    new ResizeObserver(() => requestAnimationFrame(again)).observe(holder);  // draws after all observers were called
    requestAnimationFrame(again);
  };

  Sidewall.lineChart = (chart) => {
    const plot = el("div", { class: "plot" }), tip = el("div", { class: "tip" });
    tip.hidden = true;
    const points = chart.series.flatMap((s) => s.points).filter((p) => drawable(p, chart));
    const figure = el("figure", { class: "chart" + (chart.same_scale ? " shape" : "") },
                      el("figcaption", {}, chart.title), plot, legend(chart));
    if (!points.length) {
      plot.append(el("p", { class: "none" }, "no values"));
      return figure;
    }
    const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
    Sidewall.fitted(plot, (width) => {
      let height = kHeight;
      if (chart.same_scale) {
        const aspect = (Math.max(...ys) - Math.min(...ys) || 1) / (Math.max(...xs) - Math.min(...xs) || 1);
        height = Math.min(Math.max(1.1 * aspect * (width - 70) + 60, 220), 560, 1.25 * width + 60);
      }
      const root = svg("svg", { width, height, role: "img", "aria-label": `${chart.title}: ${chart.y} over ${chart.x}` });
      const box = { right: width - 12, top: 10, bottom: height - 42 };
      const y = axis(ys, box.bottom, box.top, chart.log_y, height / 50);
      const widest = Math.max(...y.ticks.map((v) => number(v).length));
      box.left = 30 + 7 * Math.max(3, widest);
      const x = axis(xs, box.left, box.right, chart.log_x, width / 90);
      if (chart.same_scale) equalAxes(x, y, box);
      drawAxes(root, chart, x, y, box);
      const groups = drawSeries(root, chart, x, y);
      addReadout(root, chart, x, y, groups, tip);
      plot.replaceChildren(root, tip);
    });
    return figure;
  };

  // Horizontal bars: a row a name, a bar a column; zero rows are left out.
  Sidewall.bars = (section) => {
    const rows = section.rows.filter((row) => row.slice(1).some((v) => v > 0));
    const most = Math.max(...rows.flatMap((row) => row.slice(1).filter((v) => v !== null)), 0);
    const several = section.names.length > 1;
    const total = rows.reduce((sum, row) => sum + (row[1] || 0), 0);
    const table = el("div", { class: "bars", role: "table", "aria-label": section.title });
    for (const row of rows)
      table.append(el("div", { class: "bar-row", role: "row" }, el("span", { role: "rowheader" }, row[0]),
                      el("div", { class: "bar-set", role: "cell" }, ...row.slice(1).map((value, k) =>
        el("div", { class: "bar" },
           el("i", { style: `width:${most ? 78 * (value || 0) / most : 0}%;background:var(--c${several ? k % kColours : 0})` }),
           el("span", {}, `${number(value, 3)} ${section.unit}` +
              (several || !total || section.unit !== "s" ? "" : ` (${(100 * value / total).toFixed(0)} %)`)))))));
    return el("div", {}, table, several ? el("div", { class: "keys" }, ...section.names.map((name, k) =>
      el("span", {}, el("i", { style: `background:var(--c${k % kColours})` }), name))) : "");
  };

  // Fitted values with their 95 % intervals within the bounds that were searched.
  Sidewall.intervals = (section) => {
    const list = el("div", { class: "intervals" });
    for (const row of section.rows) {
      const [low, high] = row.bounds || row.interval;
      const place = (v) => {
        const share = row.log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low);
        return 100 * Math.min(Math.max(Number.isFinite(share) ? share : 0, 0), 1);
      };
      const [from, to] = row.interval, known = from !== null && to !== null;
      const at = known ? [place(from), place(to)] : [0, 100];
      list.append(el("div", { class: "interval" },
        el("div", { class: "interval-name" }, el("code", {}, row.name),
           el("b", {}, number(row.value, 5)), row.unit || "",
           el("span", {}, (known ? `95 %: ${number(from)} to ${number(to)}` : row.at_bound ? "95 %: none" : "95 %: unknown") +
              (row.at_bound ? ", at the bound of its range" : ""))),
        el("div", { class: "interval-bar" },
           el("i", { class: known ? "range" : "range unknown", style: `left:${at[0]}%;width:${Math.max(at[1] - at[0], 0.4)}%` }),
           el("i", { class: "value", style: `left:${place(row.value)}%` })),
        el("div", { class: "interval-ends" }, el("span", {}, number(low)),
           el("span", {}, `bounds${row.unit ? ` in ${row.unit}` : ""}${row.log ? ", logarithmic" : ""}`), el("span", {}, number(high)))));
    }
    return list;
  };

  Object.assign(Sidewall, { svg, axis, drawAxes });
})();
