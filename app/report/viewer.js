"use strict";
// The 3-D view: the surface, and the materials on its sides and on a cut. three.js draws it, only when something has
// changed; the orbit controls of three.js move the camera.
(() => {
  const { el } = Sidewall, kViews = {
    "3-D": [28, 32], Front: [0, 0], Side: [90, 0], Top: [0, 89.9],
  };
  const kGrey = [200, 204, 210], kField = 20, kTexture = 1024;

  const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));

  class Viewer {
    constructor(section) {
      this.take(section);
      this.frame = section.frames.length - 1;
      this.colour = -1;  // -1: colour by material; else index of an attribute
      this.log = false;
      this.shading = true;
      this.triangles = false;
      this.cutAxis = -1;
      this.cutAt = this.middle.slice();
      const deep = Math.min(this.max[0] - this.min[0], this.max[1] - this.min[1]) >
                   0.2 * Math.max(this.max[0] - this.min[0], this.max[1] - this.min[1]);
      if (section.cut && deep) { this.cutAxis = section.cut.axis; this.cutAt[section.cut.axis] = section.cut.at; }
    }

    take(section) {
      this.section = section;
      this.min = section.min.slice();
      this.max = section.max.slice();
      // The solid is shown down to a little below its lowest point.
      this.min[2] -= 0.12 * Math.max(this.max[0] - this.min[0], this.max[1] - this.min[1]);
      this.box = { min: this.min, max: this.max };
      this.size = Math.hypot(...this.max.map((v, k) => v - this.min[k])) || 1;
      this.middle = this.max.map((v, k) => (v + this.min[k]) / 2);
      this.colours = new Map(section.materials.map((m) => [m.id, rgb(m.colour)]));
      this.decoded = new Map();
      this.interfaces = new Map();
    }

    // Shows another state of the same wafer: fitted as before, or from the same place if the user has moved the camera.
    update(section) {
      const seen = this.moved() && this.seenFrom();
      this.take(section);
      this.frame = Math.min(this.frame, section.frames.length - 1);
      this.placeBottom();
      this.drawOutlines();
      if (seen) this.seeFrom(seen);
      else this.fit(this.fitted.name);
      this.refresh("frame");
    }
    moved() { return this.eye.position.distanceTo(this.fitted.at) > 1e-6; }
    // Positions of the camera and of its target, in world units.
    seenFrom() {
      return [this.eye.position, this.controls.target].map((p) => ["x", "y", "z"].map((axis, k) => p[axis] * this.size + this.middle[k]));
    }
    seeFrom(points) {
      [this.eye.position, this.controls.target].forEach((p, i) => p.fromArray(points[i].map((v, k) => this.local(v, k))));
      this.controls.update();
    }

    // Sets up the picture in `holder`; false if there is no WebGL.
    start(holder) {
      const canvas = el("canvas", { tabindex: "0", role: "img", "aria-label": "3-D view: arrow keys turn, plus and minus " +
        "zoom, shift and arrow keys move, 0 resets" });
      let context = null;
      try {
        const wanted = { antialias: true, alpha: true, preserveDrawingBuffer: true };
        context = canvas.getContext("webgl", wanted) || canvas.getContext("experimental-webgl", wanted);
      } catch (error) { context = null; }
      if (!context) return false;
      this.canvas = canvas;
      holder.append(canvas);
      this.renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.renderer.localClippingEnabled = true;
      this.scene = new THREE.Scene();
      this.eye = new THREE.PerspectiveCamera(kField, 1, 0.1, 20);
      this.eye.up.set(0, 0, 1);
      this.lamp = new THREE.DirectionalLight(0xffffff, 0.55);
      this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.62), this.lamp, this.lamp.target);
      this.clip = new THREE.Plane(new THREE.Vector3(0, 1, 0), 1e3);
      this.makeMaterials();
      this.makeFaces();
      this.steer();
      this.fit();
      Sidewall.fitted(holder, () => this.resize());
      this.resize();
      return true;
    }

    makeMaterials() {
      const map = new THREE.DataTexture(new Uint8Array(256 * 2 * 4), 256, 2, THREE.RGBAFormat);
      for (let i = 0; i < 256; ++i) {
        map.image.data.set([...Sidewall.viridis(i / 255), 255], 4 * i);
        map.image.data.set([150, 150, 150, 255], 4 * (256 + i));  // grey: no value
      }
      map.magFilter = map.minFilter = THREE.LinearFilter;
      map.needsUpdate = true;
      const clippingPlanes = [this.clip], side = THREE.DoubleSide;
      this.materials = {
        material: new THREE.MeshLambertMaterial({ vertexColors: THREE.VertexColors, clippingPlanes, side }),
        value: new THREE.MeshLambertMaterial({ map, clippingPlanes, side }),
        flatMaterial: new THREE.MeshBasicMaterial({ vertexColors: THREE.VertexColors, clippingPlanes, side }),
        flatValue: new THREE.MeshBasicMaterial({ map, clippingPlanes, side }),
        triangles: new THREE.LineBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.3, clippingPlanes }),
      };
    }

    local(v, k) { return (v - this.middle[k]) / this.size; }

    // Makes the four sides and the cut, on which the materials are painted, and the bottom.
    makeFaces() {
      this.faces = [];
      for (const [axis, high] of [[0, 0], [0, 1], [1, 0], [1, 1], [-1, 0]]) {
        const canvas = document.createElement("canvas"), texture = new THREE.CanvasTexture(canvas);
        texture.anisotropy = this.renderer.capabilities.getMaxAnisotropy();
        // Premultiplied alpha: colours do not darken towards the transparent gas beside them.
        texture.premultiplyAlpha = true;
        const material = new THREE.MeshBasicMaterial({
          map: texture, transparent: true, alphaTest: 0.02, side: THREE.DoubleSide, blending: THREE.CustomBlending,
          blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor, clippingPlanes: axis < 0 ? [] : [this.clip],
        });
        const face = { axis, high, canvas, texture, mesh: new THREE.Mesh(new THREE.BufferGeometry(), material) };
        this.scene.add(face.mesh);
        this.faces.push(face);
      }
      const material = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, clippingPlanes: [this.clip] });
      this.bottom = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
      this.outlines = new THREE.Group();
      this.scene.add(this.bottom, this.outlines);
      this.placeBottom();
      this.drawOutlines();
    }
    placeBottom() {
      this.bottom.scale.set(...[0, 1].map((k) => (this.max[k] - this.min[k]) / this.size), 1);
      this.bottom.position.z = this.local(this.min[2], 2);
    }

    // Draws the outlines of masks a little above the wafer, clipped at its sides and the cut.
    drawOutlines() {
      for (const line of this.outlines.children.splice(0)) line.geometry.dispose();
      const z = this.local(this.max[2], 2) + 0.03, sides = [0, 1].flatMap((k) => [1, -1].map((sign) =>
        new THREE.Plane(new THREE.Vector3(k ? 0 : sign, k ? sign : 0, 0), (this.max[k] - this.min[k]) / this.size / 2 + 1e-6)));
      for (const points of this.section.outlines || []) {
        const geometry = new THREE.BufferGeometry().setFromPoints(
          points.map(([x, y]) => new THREE.Vector3(this.local(x, 0), this.local(y, 1), z)));
        this.outlines.add(new THREE.LineLoop(geometry, new THREE.LineBasicMaterial({ color: 0xd0342c, clippingPlanes: [...sides, this.clip] })));
      }
    }

    mesh(number) {
      if (!this.interfaces.has(number))
        this.interfaces.set(number, Sidewall.decode(this.section.meshes[number], this.section.min, this.section.max));
      return this.interfaces.get(number);
    }

    surface(number) {
      if (!this.decoded.has(number)) {
        if (this.decoded.size > 8) this.decoded.delete(this.decoded.keys().next().value);
        this.decoded.set(number, Sidewall.decode(this.section.frames[number].surface, this.section.min, this.section.max));
      }
      return this.decoded.get(number);
    }

    // Meshes with their colours, from the uppermost layer down.
    solids() {
      const frame = this.section.frames[this.frame];
      const colour = (id) => {
        const c = this.colours.get(id) || kGrey;
        return Sidewall.css(this.colour < 0 ? c : c.map((v, k) => Math.round(0.45 * v + 0.55 * kGrey[k])));
      };
      return [{ mesh: this.surface(this.frame), colour: colour(frame.top) },
              ...frame.layers.slice().reverse().map(([mesh, id]) => ({ mesh: this.mesh(mesh), colour: colour(id) }))];
    }

    // Position of a value on the colour bar, from 0 to 1.
    share(value) {
      const { low, high } = this.section.attributes[this.colour];
      if (!this.log) return (value - low) / (high - low);
      const floor = this.logFloor();
      return Math.log(Math.max(value, floor) / floor) / Math.log(high / floor);
    }
    logFloor() {
      const { low, high } = this.section.attributes[this.colour];
      return low > 0 ? low : high * 1e-4;
    }
    value(word) {
      const { low, high } = this.section.attributes[this.colour];
      return word === 65535 ? NaN : low + word / 65534 * (high - low);
    }

    showSurface() {
      const data = this.surface(this.frame), n = data.position.length / 3;
      const geometry = new THREE.BufferGeometry(), position = new Float32Array(3 * n);
      for (let i = 0; i < 3 * n; ++i) position[i] = this.local(data.position[i], i % 3);
      geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
      geometry.setIndex(new THREE.BufferAttribute(data.index, 1));
      geometry.computeVertexNormals();
      if (this.colour < 0) {
        const colours = new Uint8Array(3 * n);
        for (let v = 0; v < n; ++v) colours.set(this.colours.get(data.material[v]) || kGrey, 3 * v);
        geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3, true));
      } else {
        const uv = new Float32Array(2 * n);
        for (let v = 0; v < n; ++v) {
          const share = this.share(this.value(data.values[this.colour][v]));
          const known = Number.isFinite(share);
          uv[2 * v] = 0.5 / 256 + (known ? Math.min(Math.max(share, 0), 1) : 0) * 255 / 256;
          uv[2 * v + 1] = known ? 0.25 : 0.75;
        }
        geometry.setAttribute("uv", new THREE.BufferAttribute(uv, 2));
      }
      const name = this.colour < 0 ? (this.shading ? "material" : "flatMaterial") : (this.shading ? "value" : "flatValue");
      for (const old of [this.shown, this.lines]) if (old) { this.scene.remove(old); old.geometry.dispose(); }
      this.lines = null;
      this.shown = new THREE.Mesh(geometry, this.materials[name]);
      this.scene.add(this.shown);
      if (this.triangles) {
        this.lines = new THREE.LineSegments(new THREE.WireframeGeometry(geometry), this.materials.triangles);
        this.scene.add(this.lines);
      }
    }

    placeFace(face, axis, at) {
      const [a, b] = [[1, 2], [0, 2], [0, 1]][axis];
      const corner = (u, v) => {
        const p = [0, 0, 0];
        p[axis] = this.local(at, axis);
        p[a] = this.local(u ? this.max[a] : this.min[a], a);
        p[b] = this.local(v ? this.max[b] : this.min[b], b);
        return p;
      };
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(
        new Float32Array([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)].flat()), 3));
      geometry.setAttribute("uv", new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      face.mesh.geometry.dispose();
      face.mesh.geometry = geometry;
      // Powers of two: WebGL 1 makes mipmaps of no other sizes.
      const w = this.max[a] - this.min[a], h = this.max[b] - this.min[b], scale = kTexture / Math.max(w, h);
      const power = (length) => 2 ** Math.max(4, Math.round(Math.log2(length * scale)));
      face.canvas.width = power(w);
      face.canvas.height = power(h);
    }

    showFace(face, axis, at) {
      this.placeFace(face, axis, at);
      // Cut a little inside: exactly on a side the mesh ends, and above or below is undefined.
      const inside = Math.min(Math.max(at, this.min[axis] + 1e-5 * (this.max[axis] - this.min[axis])),
                              this.max[axis] - 1e-5 * (this.max[axis] - this.min[axis]));
      Sidewall.paintSection(face.canvas, this.painted, axis, inside, this.box);
      face.texture.needsUpdate = true;
    }

    showSides() {
      this.painted = this.solids();
      for (const face of this.faces)
        if (face.axis >= 0) this.showFace(face, face.axis, face.high ? this.max[face.axis] : this.min[face.axis]);
      this.bottom.material.color.set(this.painted[this.painted.length - 1].colour);
    }

    showCut() {
      const face = this.faces[4];
      face.mesh.visible = this.cutAxis >= 0;
      this.bottom.visible = this.cutAxis !== 2 || !this.aboveCut();
      if (this.cutAxis >= 0) {
        this.painted = this.painted || this.solids();
        this.showFace(face, this.cutAxis, this.cutAt[this.cutAxis]);
      }
      this.clipped = null;
    }

    // Orbit controls handle mouse, wheel, touch, and arrow keys with shift. Other keys are handled here: arrows turn.
    steer() {
      const reset = () => { this.fit(); this.refresh(); };
      this.canvas.addEventListener("keydown", (event) => {
        const turn = { ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, -5], ArrowDown: [0, 5] }[event.key];
        this.controls.enableKeys = event.shiftKey;
        if (turn && event.shiftKey) return;
        if (turn) this.turn(...turn);
        else if (event.key === "+" || event.key === "=") this.zoom(0.87);
        else if (event.key === "-") this.zoom(1.15);
        else if (event.key === "0") reset();
        else return;
        event.preventDefault();
      });
      this.canvas.addEventListener("dblclick", reset);
      this.canvas.addEventListener("pointermove", (event) => event.buttons || this.read(event));
      this.controls = new THREE.OrbitControls(this.eye, this.canvas);
      Object.assign(this.controls,
                    { rotateSpeed: 0.6, keyPanSpeed: -25, screenSpacePanning: true, minDistance: 0.05, maxDistance: 40 });
      this.controls.addEventListener("change", () => this.refresh());
    }

    // Puts the camera at a distance from its target, in a direction given in degrees.
    place(azimuth, elevation, distance) {
      const a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
      const away = new THREE.Vector3(Math.sin(a) * Math.cos(e), -Math.cos(a) * Math.cos(e), Math.sin(e));
      this.eye.position.copy(this.controls.target).addScaledVector(away, distance);
      this.controls.update();
      this.eye.updateMatrixWorld();
    }
    distance() { return this.eye.position.distanceTo(this.controls.target); }
    turn(azimuth, elevation) {
      const degrees = 180 / Math.PI, { controls } = this, e = 90 - degrees * controls.getPolarAngle() + elevation;
      this.place(degrees * controls.getAzimuthalAngle() + azimuth, Math.min(Math.max(e, -89.9), 89.9), this.distance());
    }
    zoom(factor) {
      const { target } = this.controls;
      this.eye.position.sub(target).multiplyScalar(factor).add(target);
      this.controls.update();
    }

    // Whether the camera is above the cut along its axis; the half towards the camera is clipped.
    aboveCut() { return this.eye.position.getComponent(this.cutAxis) > this.local(this.cutAt[this.cutAxis], this.cutAxis); }

    placeClip() {
      if (this.cutAxis < 0) return this.clip.set(new THREE.Vector3(0, 0, 1), 1e3);
      const sign = this.aboveCut() ? -1 : 1, normal = new THREE.Vector3();
      normal.setComponent(this.cutAxis, sign);
      this.clip.set(normal, -sign * this.local(this.cutAt[this.cutAxis], this.cutAxis) + 1e-5);
      this.bottom.visible = this.cutAxis !== 2 || sign < 0;
    }

    draw() {
      const { eye, lamp } = this, distance = this.distance();
      eye.near = Math.max(0.02, distance - 2);
      eye.far = distance + 2;
      eye.updateProjectionMatrix();
      eye.updateMatrixWorld();
      const right = new THREE.Vector3().setFromMatrixColumn(eye.matrixWorld, 0);
      lamp.position.copy(eye.position).add(new THREE.Vector3(-0.6 * right.x, -0.6 * right.y, 0.8).multiplyScalar(distance));
      lamp.target.position.copy(this.controls.target);
      this.placeClip();
      this.renderer.render(this.scene, eye);
    }

    // Redraws after a change of "frame", "colour" or "cut"; without an argument only the view has changed.
    refresh(what) {
      if (what === "frame" || what === "colour") {
        this.showSurface();
        this.showSides();
      }
      if (what) this.showCut();
      if (this.waiting) return;
      this.waiting = requestAnimationFrame(() => { this.waiting = 0; this.draw(); });
    }

    // Moves the camera so that the part that the cut leaves fills the canvas.
    fit(name = "3-D") {
      const { target } = this.controls, [azimuth, elevation] = kViews[name];
      target.set(0, 0, 0);
      this.place(azimuth, elevation, 4);
      const low = [0, 1, 2].map((k) => this.local(this.min[k], k)), high = [0, 1, 2].map((k) => this.local(this.max[k], k));
      if (this.cutAxis >= 0)
        (this.aboveCut() ? high : low)[this.cutAxis] = this.local(this.cutAt[this.cutAxis], this.cutAxis);
      target.fromArray(low.map((v, k) => (v + high[k]) / 2));
      const tangent = Math.tan(kField * Math.PI / 360), aspect = this.aspect || 1.6;
      let distance = 4;
      for (let round = 0; round < 10; ++round) {
        this.place(azimuth, elevation, distance);
        let most = 0;
        for (let corner = 0; corner < 8; ++corner) {
          const p = new THREE.Vector3(...[0, 1, 2].map((k) => (corner >> k & 1 ? high : low)[k]));
          p.applyMatrix4(this.eye.matrixWorldInverse);
          most = Math.max(most, Math.abs(p.y / p.z) / tangent, Math.abs(p.x / p.z) / tangent / aspect);
        }
        distance = Math.max(0.6, distance * most / 0.93);
      }
      this.place(azimuth, elevation, distance);
      this.fitted = { name, at: this.eye.position.clone() };
    }

    resize() {
      const width = this.canvas.parentNode.clientWidth;
      if (!width) return;
      const height = Math.round(Math.min(Math.max(0.58 * width, 280), 560, 0.7 * innerHeight || 560));
      const first = !this.aspect;
      this.aspect = width / height;
      this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
      this.renderer.setSize(width, height);
      this.eye.aspect = this.aspect;
      this.eye.updateProjectionMatrix();
      if (first) this.fit();
      this.refresh();
    }
  }

  Sidewall.Viewer = Viewer;
  Sidewall.viewNames = Object.keys(kViews);
})();
