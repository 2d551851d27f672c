// The girders on their supports, the sleepers and the rails, as meshes.
{
  // Lengths in m. Whatever a layout file does not define is drawn like an elevated urban line.
  const RUN = 40; // rigid ground drawn before and after the spans
  const GROUND = 5.2; // ground below the girders' top
  const RAIL = { width: 0.3, height: 0.07, step: 0.25 };
  const SLEEPER = { every: 0.8, width: 0.14, height: 0.1 };
  const GIRDER = { depth: 1.7, slices: 40 };

  scenes.Track = class {
    constructor(THREE, model, materials) {
      Object.assign(this, { THREE, model, materials });
      this.root = new THREE.Group();
      // girders and rigid ground, which can hide the train
      this.solids = [];
      const magnets = model.data.magnets.map((it) => it.position);
      this.lines = [...new Set(magnets.map((it) => it[1]))];
      this.half = Math.max(0.5, ...this.lines.map(Math.abs));
      // the magnets' upper faces, and the girders' top well below the magnets
      this.faces = Math.max(...magnets.map((it) => it[2])) + scenes.MAGNET.height / 2;
      this.top = Math.min(...magnets.map((it) => it[2])) - 0.5;
      const travel = model.position ?? [0];
      const from = Math.min(...travel) + model.reach[0];
      const to = Math.max(...travel) + model.reach[1];
      const spans = model.spans;
      const start = spans.length ? spans[0].start : from;
      const end = spans.length ? spans[spans.length - 1].end : to;
      this.range = [Math.min(from - 5, start - RUN), Math.max(to + 5, end + RUN)];
      const { course } = model;
      const places = Array.from({ length: 201 }, (_, i) => this.range[0] + ((this.range[1] - this.range[0]) * i) / 200);
      this.points = places.map((x) => course.at(x).origin);
      this.ground = this.top - GROUND + Math.min(...this.points.map((it) => it[2]));
      this.addRigid(this.range[0], spans.length ? start : this.range[1]);
      if (spans.length) this.addRigid(end, this.range[1]);
      this.girders = spans.map((span) => this.addGirder(span));
      [...spans.map((span) => span.start), end].forEach((x) => spans.length && this.addPier(x));
      this.rails = this.lines.map((y) => this.addRail(y));
      this.addSleepers();
      this.addReference();
      this.addGround();
    }

    // Outline of the girder across the track: a box with a wider top slab, [y, z] from its top.
    outline() {
      const w = this.half;
      const d = GIRDER.depth;
      return [[-w, 0], [w, 0], [w, -0.22], [w * 0.62, -0.42], [w * 0.5, -d], [-w * 0.5, -d], [-w * 0.62, -0.42], [-w, -0.22]];
    }

    // A body with an outline [y, z] along the line; `bend` moves its slices.
    extrude(outline, from, to, least, material) {
      const { THREE, model } = this;
      const slices = model.course.pieces(from, to, least);
      const frames = [];
      const index = [];
      const n = outline.length;
      for (let i = 0; i <= slices; i++) {
        const x = from + ((to - from) * i) / slices;
        frames.push({ x, ...model.course.at(x) });
        if (i === 0) continue;
        for (let k = 0; k < n; k++) {
          const [a, b] = [(i - 1) * n + k, (i - 1) * n + ((k + 1) % n)];
          index.push(a, a + n, b, b, a + n, b + n);
        }
      }
      const cap = THREE.ShapeUtils.triangulateShape(outline.map(([y, z]) => new THREE.Vector2(y, z)), []);
      for (const [a, b, c] of cap) index.push(a, c, b, a + slices * n, b + slices * n, c + slices * n);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(new Float32Array(3 * n * frames.length), 3));
      geometry.setIndex(index);
      const mesh = new THREE.Mesh(geometry, material);
      mesh.castShadow = true;
      // shadows on small parts look ragged
      mesh.receiveShadow = material !== this.materials.rail;
      mesh.frustumCulled = false;
      this.root.add(mesh);
      if (material !== this.materials.rail) this.solids.push(mesh);
      const body = { mesh, outline, frames };
      this.bend(body, (x, y, z) => [y, z]);
      return body;
    }

    // Draws the slices of a body at [y, z] = place(x, y, z) across the line.
    bend({ mesh, outline, frames }, place) {
      const points = mesh.geometry.attributes.position;
      let i = 0;
      for (const frame of frames) {
        for (const [y, z] of outline) points.setXYZ(i++, ...scenes.Course.point(frame, ...place(frame.x, y, z)));
      }
      points.needsUpdate = true;
    }

    addGirder(span) {
      const outline = this.outline().map(([y, z]) => [y, z + this.top]);
      // a narrow joint shows where a girder ends
      return this.extrude(outline, span.start + 0.04, span.end - 0.04, GIRDER.slices, this.materials.girder);
    }

    // Ground on which the train runs before and after the spans.
    addRigid(from, to) {
      if (to - from < 0.1) return;
      const w = this.half * 1.15;
      const depth = GROUND;
      const outline = [[-w, 0], [w, 0], [w * 1.5, -depth], [-w * 1.5, -depth]].map(([y, z]) => [y, z + this.top]);
      const { mesh } = this.extrude(outline, from + 0.02, to - 0.02, 1, this.materials.rigid);
      // its foot is on the ground, however high the line is
      const points = mesh.geometry.attributes.position;
      for (let i = 0; i < points.count; i++) if (i % 4 > 1) points.setZ(i, this.ground - 0.05);
    }

    addPier(x) {
      const { THREE, root, materials } = this;
      const frame = this.model.course.at(x);
      const under = this.top - GIRDER.depth;
      const block = (size, z, material) => {
        const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
        mesh.position.set(0, 0, z);
        mesh.applyMatrix4(scenes.Course.matrix(THREE, frame));
        mesh.castShadow = mesh.receiveShadow = true;
        root.add(mesh);
      };
      block([0.8, this.half, 0.1], under - 0.05, materials.bearing);
      block([1.3, this.half * 1.9, 0.55], under - 0.375, materials.rigid);
      const [px, py, pz] = scenes.Course.point(frame, 0, under - 0.65);
      const height = pz - this.ground;
      const column = new THREE.Mesh(new THREE.CylinderGeometry(0.52, 0.6, height, 24), materials.rigid);
      column.rotation.x = Math.PI / 2;
      column.position.set(px, py, this.ground + height / 2);
      column.castShadow = column.receiveShadow = true;
      root.add(column);
    }

    addRail(y) {
      const w = RAIL.width / 2;
      const outline = [[-w, RAIL.height], [w, RAIL.height], [w, 0], [-w, 0]].map(([a, z]) => [y + a, z]);
      const [from, to] = this.range;
      return { y, ...this.extrude(outline, from, to, Math.ceil((to - from) / RAIL.step), this.materials.rail) };
    }

    // Sleepers carry the rails on a post in the middle of the track, or on two if a rail is there.
    addSleepers() {
      const { THREE, root, materials } = this;
      const [from, to] = this.range;
      const count = Math.floor((to - from) / SLEEPER.every);
      const legs = this.lines.some((y) => Math.abs(y) < 0.3) ? [-this.half * 0.9, this.half * 0.9] : [0];
      const row = (size, material, many = 1) => {
        const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(...size), material, count * many);
        mesh.frustumCulled = false;
        mesh.castShadow = true;
        root.add(mesh);
        return mesh;
      };
      this.sleepers = {
        frames: Array.from({ length: count }, (_, i) => from + (i + 0.5) * SLEEPER.every).map((x) => ({
          x, matrix: scenes.Course.matrix(THREE, this.model.course.at(x)),
        })),
        bars: row([SLEEPER.width, this.half * 2 + 0.2, SLEEPER.height], materials.sleeper),
        legs,
        // two posts beside a rail in the middle are thin, so that they do not hide the train
        posts: row([SLEEPER.width / legs.length ** 1.5, 0.3 / legs.length, 1], materials.sleeper, legs.length),
      };
    }

    // A dashed line at the outer edge of the undeflected rails.
    addReference() {
      const { THREE, root, materials } = this;
      const [from, to] = this.range;
      this.references = [-1, 1].map((side) => {
        const y = side * (this.half + RAIL.width / 2 + 0.02);
        const pieces = this.model.course.pieces(from, to, 1);
        const frames = Array.from({ length: pieces + 1 }, (_, i) => this.model.course.at(from + ((to - from) * i) / pieces));
        const line = new THREE.Line(new THREE.BufferGeometry(), materials.reference);
        line.frustumCulled = false;
        root.add(line);
        return { line, y, frames };
      });
    }

    // Puts the dashed lines at a height, if it has changed.
    refer(height) {
      if (this.referred === height) return;
      this.referred = height;
      for (const { line, y, frames } of this.references) {
        line.geometry.setFromPoints(frames.map((frame) => new this.THREE.Vector3(...scenes.Course.point(frame, y, height))));
        line.computeLineDistances();
      }
    }

    addGround() {
      const { THREE, root, materials } = this;
      const ends = [0, 1].map((i) => this.points.map((it) => it[i])).map((all) => [Math.min(...all), Math.max(...all)]);
      const [[west, east], [south, north]] = ends;
      const ground = new THREE.Mesh(new THREE.PlaneGeometry(east - west + 400, north - south + 500), materials.ground);
      ground.position.set((west + east) / 2, (south + north) / 2, this.ground);
      ground.receiveShadow = true;
      root.add(ground);
    }

    // Height of the lower face of the undeflected rails: the nominal gap, exaggerated, above the magnets.
    under(scale) {
      return this.faces + scale.gap * this.model.data.nominal_gap;
    }

    update(scale) {
      const { THREE, model } = this;
      const under = this.under(scale);
      const place = (x, y, z) => model.across(x, y, z, scale);
      this.girders.forEach((girder) => this.bend(girder, place));
      this.rails.forEach((rail) => this.bend(rail, (x, y, z) => {
        const [left, up] = place(x, y, z);
        return [left, under + up + model.rough(x, rail.y, scale)];
      }));
      this.refer(under);
      const { frames, bars, legs, posts } = this.sleepers;
      const node = new THREE.Object3D();
      const put = (mesh, i, matrix) => {
        node.updateMatrix();
        mesh.setMatrixAt(i, node.matrix.premultiply(matrix));
      };
      frames.forEach(({ x, matrix }, i) => {
        const { turn } = model.sway(x, scale);
        const [left, up] = place(x, 0, RAIL.height / 2);
        // a bar carries both rails
        const rough = this.lines.map((y) => model.rough(x, y, scale));
        const mean = rough.reduce((sum, it) => sum + it, 0) / rough.length;
        const reach = Math.max(...this.lines) - Math.min(...this.lines);
        const tilt = reach > 0 ? (rough[this.lines.indexOf(Math.max(...this.lines))] - rough[this.lines.indexOf(Math.min(...this.lines))]) / reach : 0;
        const bar = under + up + mean;
        node.scale.set(1, 1, 1);
        node.rotation.set(turn + Math.atan(tilt), 0, 0);
        node.position.set(0, left, bar);
        put(bars, i, matrix);
        const slab = place(x, 0, this.top)[1];
        const height = Math.max(bar - slab, 0.01);
        node.scale.set(1, 1, height);
        node.rotation.set(turn, 0, 0);
        legs.forEach((y, leg) => {
          node.position.set(0, left + y, slab + height / 2 + Math.sin(turn) * y);
          put(posts, i * legs.length + leg, matrix);
        });
      });
      bars.instanceMatrix.needsUpdate = posts.instanceMatrix.needsUpdate = true;
    }
  };
}
