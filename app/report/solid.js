"use strict";
// Decodes meshes of the page and paints sections through the materials. The mesh of a layer is its upper boundary: a
// point is below the boundary, in this layer or a lower one, if an odd number of its faces lie above the point.
(() => {
  const bytes = (text) => {
    const binary = atob(text), array = new Uint8Array(binary.length);
    for (let i = 0; i < binary.length; ++i) array[i] = binary.charCodeAt(i);
    return array;
  };
  const words = (text) => {
    const b = bytes(text), array = new Uint16Array(b.length / 2);
    for (let i = 0; i < array.length; ++i) array[i] = b[2 * i] | b[2 * i + 1] << 8;
    return array;
  };

  // A mesh from its encoded form (view_mesh.hpp); positions in world units, from 16 bits across the box.
  Sidewall.decode = (json, min, max) => {
    const p = words(json.p), position = new Float32Array(p.length);
    for (let i = 0; i < p.length; ++i) position[i] = min[i % 3] + p[i] / 65535 * (max[i % 3] - min[i % 3]);
    let index = words(json.i);
    if (json.wide) {
      const half = index;
      index = new Uint32Array(half.length / 2);
      for (let i = 0; i < index.length; ++i) index[i] = half[2 * i] + 65536 * half[2 * i + 1];
    }
    return { position, index, material: json.m ? bytes(json.m) : null, values: (json.a || []).map(words) };
  };

  const kOthers = [[1, 2], [0, 2], [0, 1]];

  // Section of a mesh by the plane `axis` = `at`: ends u0, v0, u1, v1 of each segment, along the other two axes.
  Sidewall.crossing = (mesh, axis, at) => {
    const { position, index } = mesh, [a, b] = kOthers[axis], pieces = [];
    for (let t = 0; t < index.length; t += 3) {
      const above = [0, 1, 2].map((k) => position[3 * index[t + k] + axis] >= at);
      if (above[0] === above[1] && above[1] === above[2]) continue;
      for (let k = 0; k < 3; ++k) {
        const n = (k + 1) % 3;
        if (above[k] === above[n]) continue;
        const i = 3 * index[t + k], j = 3 * index[t + n];
        const share = (at - position[i + axis]) / (position[j + axis] - position[i + axis]);
        pieces.push(position[i + a] + share * (position[j + a] - position[i + a]),
                    position[i + b] + share * (position[j + b] - position[i + b]));
      }
    }
    return pieces;
  };

  // Adds for each segment the quadrilateral between it and a far side, to which `far` moves a point. The even-odd rule
  // then fills the region between the boundary and that side.
  function addSpans(path, pieces, x, y, far) {
    for (let i = 0; i < pieces.length; i += 4) {
      const a = [x(pieces[i]), y(pieces[i + 1])], b = [x(pieces[i + 2]), y(pieces[i + 3])];
      path.moveTo(...a);
      for (const p of [b, far(b), far(a)]) path.lineTo(...p);
      path.closePath();
    }
  }

  // The region below a boundary on a horizontal plane: quadrilaterals to the right side, and rectangles for the parts of the
  // left side that lie below the boundary. `side` is the section by the vertical plane at the left side.
  function addBeside(path, pieces, side, height, x, y, box) {
    const right = x(box.max[0]);
    addSpans(path, pieces, x, y, (p) => [right, p[1]]);
    const corner = box.min[1] + 1e-5 * (box.max[1] - box.min[1]);
    let above = 0;
    for (let i = 0; i < side.length; i += 4) {
      const [y0, z0, y1, z1] = [side[i], side[i + 1], side[i + 2], side[i + 3]];
      if ((y0 >= corner) !== (y1 >= corner) && z0 + (corner - y0) / (y1 - y0) * (z1 - z0) > height) ++above;
      if ((z0 >= height) !== (z1 >= height)) {
        const from = y0 + (height - z0) / (z1 - z0) * (y1 - y0);
        path.rect(x(box.min[0]), y(from), right - x(box.min[0]), y(box.max[1]) - y(from));
      }
    }
    if (above % 2) path.rect(x(box.min[0]), y(box.min[1]), right - x(box.min[0]), y(box.max[1]) - y(box.min[1]));
  }

  // Paints the materials in a plane; gas stays transparent. `solids` are { mesh, colour } from the uppermost down, each
  // painted over those before it. `box` bounds the picture.
  Sidewall.paintSection = (canvas, solids, axis, at, box) => {
    const [a, b] = kOthers[axis], context = canvas.getContext("2d"), { width, height } = canvas;
    const x = (u) => (u - box.min[a]) / (box.max[a] - box.min[a]) * width;
    const y = (v) => (box.max[b] - v) / (box.max[b] - box.min[b]) * height;
    context.clearRect(0, 0, width, height);
    const lines = new Path2D();
    for (const { mesh, colour } of solids) {
      const pieces = Sidewall.crossing(mesh, axis, at), path = new Path2D();
      if (axis === 2)
        addBeside(path, pieces, Sidewall.crossing(mesh, 0, box.min[0] + 1e-5 * (box.max[0] - box.min[0])), at, x, y, box);
      else
        addSpans(path, pieces, x, y, (p) => [p[0], height + 1]);
      context.fillStyle = colour;
      context.fill(path, "evenodd");
      for (let i = 0; i < pieces.length; i += 4) {
        lines.moveTo(x(pieces[i]), y(pieces[i + 1]));
        lines.lineTo(x(pieces[i + 2]), y(pieces[i + 3]));
      }
    }
    context.strokeStyle = "rgba(0,0,0,0.45)";
    context.lineWidth = Math.max(width, height) / 500;
    context.stroke(lines);
  };
})();
