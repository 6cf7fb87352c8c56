"use strict";
// Controls of the 3-D view: buttons, sliders, colour legend, and a readout of the point under the pointer.
(() => {
  const { el, number } = Sidewall, kAxes = "xyz";

  Object.assign(Sidewall.Viewer.prototype, {
    // Picks the surface, or a painted face with its colour, at (x, y) in shares of the canvas; null if neither.
    picked(x, y) {
      const ray = new THREE.Raycaster();
      ray.setFromCamera({ x: 2 * x - 1, y: 1 - 2 * y }, this.eye);
      const faces = [...this.faces.filter((f) => f.mesh.visible).map((f) => f.mesh), this.bottom];
      const hits = ray.intersectObjects([this.shown, ...faces]).filter((hit) =>
        hit.object === this.faces[4].mesh || this.clip.distanceToPoint(hit.point) >= -1e-6);
      for (const hit of hits) {
        const face = this.faces.find((f) => f.mesh === hit.object);
        if (face) {  // transparent where it shows gas
          const px = Math.min(Math.floor(hit.uv.x * face.canvas.width), face.canvas.width - 1);
          const py = Math.min(Math.floor((1 - hit.uv.y) * face.canvas.height), face.canvas.height - 1);
          const c = face.canvas.getContext("2d").getImageData(px, py, 1, 1).data;
          if (c[3] >= 128) return { face: true, colour: [c[0], c[1], c[2]] };
          continue;
        }
        return hit.object === this.shown ? { face: false, hit } : null;
      }
      return null;
    },

    // Material of the surface at a hit; with an attribute also its value and its place on the colour bar.
    reading(hit) {
      const data = this.surface(this.frame), { a, b, c } = hit.face, position = data.position;
      const triangle = [a, b, c].map((v) => new THREE.Vector3(...[0, 1, 2].map((k) => this.local(position[3 * v + k], k))));
      const weights = new THREE.Vector3();
      new THREE.Triangle(...triangle).getBarycoord(hit.point, weights);
      const result = { material: data.material ? data.material[a] : -1 };
      if (this.colour >= 0) {
        const v = [a, b, c].map((k) => this.value(data.values[this.colour][k]));
        result.value = weights.x * v[0] + weights.y * v[1] + weights.z * v[2];
        // The place on the bar is linear within a triangle, as in the picture.
        const s = v.map((w) => Math.min(Math.max(this.share(w), 0), 1));
        result.share = weights.x * s[0] + weights.y * s[1] + weights.z * s[2];
      }
      return result;
    },

    read(event) {
      if (!this.readout || event.pointerType === "touch" || this.reads) return;
      this.reads = requestAnimationFrame(() => {
        this.reads = 0;
        const place = this.canvas.getBoundingClientRect();
        const picked = this.picked((event.clientX - place.left) / place.width, (event.clientY - place.top) / place.height);
        if (!picked || picked.face) { this.readout.textContent = ""; return; }
        const found = this.reading(picked.hit);
        const { length_unit: unit, materials, attributes } = this.section;
        const p = ["x", "y", "z"].map((k, i) => `${k} ${number(picked.hit.point[k] * this.size + this.middle[i], 4)}`).join("  ");
        const material = materials.find((m) => m.id === found.material);
        this.readout.textContent = `${p} ${unit}` + (material ? `   ${material.name}` : "") +
          (this.colour >= 0 ? `   ${attributes[this.colour].label} ${number(found.value)} ${attributes[this.colour].unit}` : "");
      });
    },
  });

  const button = (text, title, click) => el("button", { type: "button", title, onclick: click }, text);
  const check = (text, on, change) => {
    const box = el("input", { type: "checkbox", onchange: () => change(box.checked) });
    box.checked = on;
    return el("label", { class: "check" }, box, text);
  };

  // The colour legend: swatches of the materials, or a bar with round values.
  function drawLegend(viewer, holder) {
    const { section } = viewer;
    if (viewer.colour < 0) {
      holder.replaceChildren(...section.materials.map((m) => {
        const swatch = el("i", { "data-material": m.id });
        swatch.style.background = Sidewall.css(viewer.colours.get(m.id));
        return el("span", { class: "swatch" }, swatch, m.name);
      }));
      return;
    }
    const attribute = section.attributes[viewer.colour], low = viewer.log ? viewer.logFloor() : attribute.low;
    const bar = el("canvas", { width: 256, height: 1, class: "bar-map", role: "img", "aria-label": "colour bar" });
    const context = bar.getContext("2d");
    for (let i = 0; i < 256; ++i) {
      context.fillStyle = Sidewall.css(Sidewall.viridis(i / 255));
      context.fillRect(i, 0, 1, 1);
    }
    const marks = el("div", { class: "bar-ticks" }), high = attribute.high;
    const values = viewer.log ? [0, 1, 2, 3, 4].map((k) => low * (high / low) ** (k / 4))
                              : Sidewall.ticks(low, high, 4);
    for (const value of values) {
      const mark = el("span", {}, number(value, viewer.log ? 2 : 4));
      mark.style.left = `${100 * viewer.share(value)}%`;
      marks.append(mark);
    }
    holder.replaceChildren(el("div", { class: "bar-title" }, attribute.label + (attribute.unit ? ` [${attribute.unit}]` : "")),
                           bar, marks);
  }

  function framePanel(viewer, changed) {
    const label = el("output", { class: "frame-label" });
    const { length } = viewer.section.frames;
    const slider = el("input", { type: "range", min: 0, max: length - 1, step: 1, "aria-label": "saved surface" });
    const show = viewer.showFrame = () => {
      const { frames } = viewer.section;
      label.textContent = `${frames[viewer.frame].label}  (${viewer.frame + 1} of ${frames.length})`;
      slider.value = viewer.frame;
      slider.setAttribute("aria-valuetext", frames[viewer.frame].label);
    };
    const go = (k) => { viewer.frame = k; show(); changed(); };
    slider.addEventListener("input", () => go(Number(slider.value)));
    let timer = 0;
    const play = button("▶", "play", () => {
      const stop = () => { clearInterval(timer); timer = 0; play.textContent = "▶"; play.title = "play"; };
      if (timer) return stop();
      play.textContent = "❚❚";
      play.title = "pause";
      if (viewer.frame === length - 1) go(0);
      timer = setInterval(() => viewer.frame + 1 < length ? go(viewer.frame + 1) : stop(), 180);
    });
    show();
    viewer.slider = slider;
    return el("div", { class: "row frames" }, ...(length > 1 ? [play, slider] : []), label);
  }

  function cutPanel(viewer) {
    const slider = el("input", { type: "range", min: 0, max: 1000, step: 1, "aria-label": "place of the cut" });
    const label = el("output", {}), low = (k) => viewer.section.min[k];
    const high = (k) => viewer.section.max[k] + (k === 2 ? 1e-3 * (viewer.section.max[k] - low(k)) : 0);
    const show = () => {
      const k = viewer.cutAxis;
      slider.disabled = k < 0;
      if (k < 0) { label.textContent = ""; return; }
      slider.value = 1000 * (viewer.cutAt[k] - low(k)) / (high(k) - low(k));
      label.textContent = `${kAxes[k]} = ${number(viewer.cutAt[k], 3)} ${viewer.section.length_unit}`;
    };
    const select = el("select", { "aria-label": "cut", onchange: () => {
      viewer.cutAxis = select.selectedIndex - 1;
      show();
      viewer.refresh("cut");
    } }, el("option", {}, "no cut"), ...[..."xyz"].map((k) => el("option", {}, `cut across ${k}`)));
    select.selectedIndex = viewer.cutAxis + 1;
    slider.addEventListener("input", () => {
      const k = viewer.cutAxis;
      viewer.cutAt[k] = low(k) + Number(slider.value) / 1000 * (high(k) - low(k));
      show();
      viewer.refresh("cut");
    });
    show();
    return el("div", { class: "row" }, select, slider, label);
  }

  Sidewall.view = (section) => {
    const holder = el("div", { class: "canvas" });
    const note = el("p", { class: "note" }, section.note || "");
    if (!section.frames) return el("div", {}, note);
    const viewer = new Sidewall.Viewer(section);
    Sidewall.viewer = viewer;
    const legend = el("div", { class: "legend" }), log = check("log", false, (on) => { viewer.log = on; recolour(); });
    const recolour = () => {
      log.hidden = viewer.colour < 0;
      drawLegend(viewer, legend);
      viewer.refresh("colour");
    };
    const colour = el("select", { "aria-label": "colour by", onchange: () => {
      viewer.colour = colour.selectedIndex - 1;
      recolour();
    } }, el("option", {}, "material"), ...section.attributes.map((a) => el("option", {}, a.label)));
    viewer.chooseColour = (k) => { colour.selectedIndex = k + 1; viewer.colour = k; recolour(); };
    const panel = el("div", { class: "panel" },
      framePanel(viewer, () => viewer.refresh("frame")),
      el("div", { class: "row" }, el("label", {}, "Colour by ", colour), log,
         check("shading", true, (on) => { viewer.shading = on; viewer.refresh("colour"); }),
         check("triangles", false, (on) => { viewer.triangles = on; viewer.refresh("colour"); }),
         ...(section.outlines && section.outlines.length
           ? [check("masks", true, (on) => { viewer.outlines.visible = on; viewer.refresh(); })] : [])),
      cutPanel(viewer),
      el("div", { class: "row" }, ...Sidewall.viewNames.map((name) =>
        button(name, `view: ${name}`, () => { viewer.fit(name); viewer.refresh(); })),
        button("+", "zoom in", () => viewer.zoom(0.8)), button("−", "zoom out", () => viewer.zoom(1.25))));
    viewer.readout = el("p", { class: "readout", "aria-live": "off" });
    const root = el("div", { class: "view" }, holder, el("div", { class: "side" }, legend, panel), viewer.readout,
      el("p", { class: "note" }, "Drag to turn, wheel or pinch to zoom, shift-drag or two fingers to move, double click to " +
        "reset; with the keyboard: arrows, + and −, shift and arrows, 0. "), note);
    // Whether this view can show `next`: as many frames, the same attributes, and a size within a factor of about 1.5.
    viewer.takes = (next) => {
      const before = viewer.section, size = ({ min, max }) => Math.hypot(...max.map((v, k) => v - min[k]));
      const form = ({ frames, attributes, outlines }) => JSON.stringify([frames.length, attributes.map((a) => a.label), !(outlines || []).length]);
      return viewer.controls && next.frames && form(next) === form(before) && Math.abs(Math.log(size(next) / size(before))) < 0.4;
    };
    viewer.show = (next) => {
      viewer.update(next);
      viewer.showFrame();
      note.textContent = next.note || "";
      drawLegend(viewer, legend);
    };
    let begun = false;
    viewer.begin = () => {
      if (begun) return;
      begun = true;
      if (!viewer.start(holder)) {
        root.replaceChildren(el("p", { class: "none" }, "This browser cannot draw 3-D pictures (WebGL is missing or switched " +
          "off). The sections and charts below show the same run."));
        Sidewall.viewer = null;
        return;
      }
      recolour();
      viewer.refresh("frame");
    };
    return root;
  };
})();
