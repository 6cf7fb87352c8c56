"use strict";
// Contours of figures over the two keys of a sweep or a fit, linear between runs.
(() => {
  const { el, number, svg } = Sidewall;

  // Delaunay triangulation of points in the unit square, as indices (A. Bowyer, Computer J. 24 (1981) 162).
  function triangulate(points) {
    const all = [...points, [-50, -50], [100, -50], [-50, 100]], n = points.length;
    const circled = (a, b, c) => {
      const [ax, ay] = all[a], bx = all[b][0] - ax, by = all[b][1] - ay, cx = all[c][0] - ax, cy = all[c][1] - ay;
      const d = 2 * (bx * cy - by * cx), bb = bx * bx + by * by, cc = cx * cx + cy * cy;
      const x = (cy * bb - by * cc) / d, y = (bx * cc - cx * bb) / d;
      return { corners: [a, b, c], x: ax + x, y: ay + y, r2: x * x + y * y, area: Math.abs(d) / 4 };
    };
    let triangles = [circled(n, n + 1, n + 2)];
    points.forEach(([px, py], p) => {
      const edges = new Map(), inside = (t) => (t.x - px) ** 2 + (t.y - py) ** 2 < t.r2;
      for (const { corners } of triangles.filter(inside))
        corners.forEach((a, k) => {
          const b = corners[(k + 1) % 3], name = a < b ? `${a} ${b}` : `${b} ${a}`;
          if (!edges.delete(name)) edges.set(name, [a, b]);  // edges of two triangles are inside the cavity
        });
      triangles = triangles.filter((t) => !inside(t));
      for (const [a, b] of edges.values()) triangles.push(circled(a, b, p));
    });
    const kSliver = 1e-6;  // area; points along a straight side are shifted and span slivers
    return triangles.filter((t) => t.area > kSliver && t.corners.every((c) => c < n)).map((t) => t.corners);
  }

  // Segments of a contour, as pairs of ends.
  function contour(points, triangles, level) {
    const pieces = [];
    for (const corners of triangles) {
      const ends = [];
      corners.forEach((a, k) => {
        const p = points[a], q = points[corners[(k + 1) % 3]];
        if (p.value < level === q.value < level) return;
        const w = (level - p.value) / (q.value - p.value);
        ends.push([p.x + w * (q.x - p.x), p.y + w * (q.y - p.y)]);
      });
      if (ends.length === 2) pieces.push(ends);
    }
    return pieces;
  }

  // Points with the mean value of all runs that have the same keys, such as runs of several seeds.
  function places(rows, keys, column) {
    const found = new Map();
    for (const row of rows) {
      const at = keys.map((k) => row[k.column]), value = row[column];
      if (![...at, value].every((v) => typeof v === "number") || keys.some((k, i) => k.log && at[i] <= 0)) continue;
      const name = at.join(" "), place = found.get(name) || { at, runs: [], sum: 0 };
      place.runs.push(row[0]);
      place.sum += value;
      place.value = place.sum / place.runs.length;
      found.set(name, place);
    }
    return [...found.values()];
  }

  // Draws a contour line; its label is on the longest segment that is away from other labels.
  function drawLine(root, pieces, kind, colour, text, labels) {
    if (!pieces.length) return;
    const kAway = 45, flat = (p) => `${p[0].toFixed(1)} ${p[1].toFixed(1)}`;
    const middles = pieces.map(([a, b]) => ({ x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2, long: Math.hypot(a[0] - b[0], a[1] - b[1]) }))
      .sort((a, b) => b.long - a.long);
    const at = middles.find((m) => labels.every((l) => Math.hypot(m.x - l.x, m.y - l.y) > kAway)) || middles[0];
    labels.push(at);
    root.append(svg("path", { class: kind, style: `stroke:${colour}`, d: pieces.map(([a, b]) => `M${flat(a)}L${flat(b)}`).join("") }),
                svg("text", { class: `${kind} label`, style: `fill:${colour}`, "text-anchor": "middle", x: at.x, y: at.y + 4 }, text));
  }

  Sidewall.contours = (section, rows) => {
    const kHeight = 420;
    const good = rows.filter((row) => row[row.length - 1] === "ok"), plot = el("div", { class: "plot" });
    const measures = section.measures.filter((m) => Sidewall.varies(good, m.column));
    const targets = section.targets;
    let chosen = measures.findIndex((m) => targets.some((t) => t.column === m.column));
    if (chosen < 0) chosen = 0;
    const draw = (width) => {
      const measure = measures[chosen], found = places(good, section.keys, measure.column);
      const chart = { x: section.keys[0].label, y: section.keys[1].label };
      const root = svg("svg", { width, height: kHeight, role: "img", "aria-label": `${measure.label} over ${chart.x} and ${chart.y}` });
      const box = { left: 84, right: width - 16, top: 12, bottom: kHeight - 42 };
      const [x, y] = [[box.left, box.right, width / 90], [box.bottom, box.top, kHeight / 50]].map(([from, to, wanted], k) =>
        Sidewall.axis(found.map((p) => p.at[k]), from, to, section.keys[k].log, wanted));
      Sidewall.drawAxes(root, chart, x, y, box);
      const pixels = (list) => list.map((p) => ({ ...p, x: x.at(p.at[0]), y: y.at(p.at[1]) }));
      const points = pixels(found), values = points.map((p) => p.value);
      const low = Math.min(...values), high = Math.max(...values), hue = (v) => Sidewall.shade((v - low) / (high - low || 1));
      const triangles = (list) => triangulate(list.map((p, k) => [   // shifted: no four on one circle
        (p.x - box.left) / (box.right - box.left) + 1e-7 * Math.sin(12.9 * k),
        (p.y - box.top) / (box.bottom - box.top) + 1e-7 * Math.sin(78.2 * k)]));
      const over = triangles(points), labels = [];
      for (const level of Sidewall.ticks(low, high, 8))
        drawLine(root, contour(points, over, level), "contour", hue(level), number(level), labels);
      targets.forEach((target, k) => {
        const own = pixels(places(good, section.keys, target.column));
        drawLine(root, contour(own, triangles(own), target.value), "target", `var(--c${k % 8})`,
                 `${target.name} = ${number(target.value)}`, labels);
      });
      for (const p of points)
        root.append(svg("circle", { cx: p.x.toFixed(1), cy: p.y.toFixed(1), r: 3.5, style: `fill:${hue(p.value)}` },
                        svg("title", {}, `run ${p.runs.join(", ")}: ${measure.label} = ${number(p.value)}`)));
      if (section.best) {
        const [bx, by] = [x.at(section.best[0]), y.at(section.best[1])];
        root.append(svg("path", { class: "best", d: `M${bx - 7} ${by}H${bx + 7}M${bx} ${by - 7}V${by + 7}` }, svg("title", {}, "best values")));
      }
      plot.replaceChildren(over.length ? root : el("p", { class: "none" }, "No contours: the values of all runs lie on one line."));
    };
    if (!measures.length) return el("p", { class: "none" }, "No measure varies.");
    Sidewall.fitted(plot, draw);
    return el("div", { class: "contours" },
              Sidewall.choice("Contours of", measures.map((m) => m.label), (k) => { chosen = k; draw(plot.clientWidth); }, chosen), plot);
  };
})();
