"use strict";
// Put into a page of results before its own scripts: once the page has drawn its charts, checks it and leaves what it found
// as JSON in an element #selftest.
(() => {
  const caught = [];
  for (const kind of ["error", "warn"]) {
    const before = console[kind];
    console[kind] = (...words) => { caught.push(words.join(" ")); before(...words); };
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

  const read = (viewer, place) => place && !place.face ? { ...place, ...viewer.reading(place.hit) } : place;

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
    const result = { tried: 0, same: 0, faces: 0, worst: null };
    for (const { x, y, place, around } of list) {
      const wanted = expected(read(viewer, place));
      // At borders, and where colours run steeply, a pixel beside the ray's own differs.
      const others = around.map((other) => expected(read(viewer, other)));
      if (!wanted || others.some((other) => !other || far(other, wanted) > 8)) continue;
      // Outlines between materials are dark.
      if (place.face && [place, ...around].some((p) => far(p.colour, wanted) > 30)) continue;
      ++result.tried;
      result.faces += place.face ? 1 : 0;
      const drawn = picture.at(x, y), off = far(drawn, wanted);
      if (off <= 10) ++result.same;
      else if (!result.worst || off > result.worst.off) result.worst = { off, x, y, wanted: [...wanted], drawn: [...drawn] };
    }
    return result;
  }

  function selftest() {
    const { viewer, el } = Sidewall, data = JSON.parse(document.getElementById("data").textContent);
    const result = { sections: data.sections.map((s) => s.type) };
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
      const mouse = (target, type, x) => target.dispatchEvent(new MouseEvent(type, { clientX: x, clientY: 200, bubbles: true }));
      mouse(viewer.canvas, "mousedown", 200);
      mouse(document, "mousemove", 240);
      mouse(document, "mouseup", 240);
      result.drag_turns_picture = pixels(viewer).hash !== last.hash;
      viewer.canvas.dispatchEvent(new MouseEvent("dblclick"));
      result.reset_returns_picture = pixels(viewer).hash === last.hash;
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
    const styles = [...document.querySelectorAll(".plot svg")].map((chart) => [...chart.querySelectorAll(".series path[d^=M]")].map((path) =>
      getComputedStyle(path).stroke + getComputedStyle(path).strokeDasharray));
    result.same_lines = styles.reduce((sum, all) => sum + all.length - new Set(all).size, 0);
    result.most_lines = Math.max(0, ...styles.map((all) => all.length));
    result.not_numbers = [...document.querySelectorAll("svg *")].filter((e) =>
      [...e.attributes].some((a) => /NaN|undefined|Infinity/.test(a.value))).length;
    result.requests = performance.getEntriesByType("resource").filter((e) => !/^(data|blob):/.test(e.name)).length;
    result.width = [document.documentElement.scrollWidth, innerWidth];
    result.webgl = Boolean(viewer);
    result.errors = [...caught, ...Sidewall.errors];
    document.body.append(el("pre", { id: "selftest", hidden: "" }, JSON.stringify(result)));
  }

  // After the charts have got their widths, which a busy browser gives late.
  const drawn = () => [...document.querySelectorAll(".plot, .matrix")].every((chart) => chart.childElementCount > 0);
  const test = (waits) => {
    if (waits > 0 && !drawn()) return setTimeout(test, 100, waits - 1);
    try { selftest(); } catch (error) {
      document.body.append(Sidewall.el("pre", { id: "selftest", hidden: "" }, JSON.stringify({ errors: [String(error.stack)] })));
    }
  };
  addEventListener("load", () => setTimeout(test, 300, 1500));
})();
