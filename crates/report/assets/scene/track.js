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
      this.ground = this.top - GROUND;
      const travel = model.position ?? [0];
      const from = Math.min(...travel) + model.reach[0];
      const to = Math.max(...travel) + model.reach[1];
      const spans = model.spans;
      const start = spans.length ? spans[0].start : from;
      const end = spans.length ? spans[spans.length - 1].end : to;
      this.range = [Math.min(from - 5, start - RUN), Math.max(to + 5, end + RUN)];
      this.addRigid(this.range[0], start);
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

    // A body with an outline, bent along x: `bend(geometry, height)` moves its slices.
    extrude(outline, from, to, slices, material) {
      const { THREE } = this;
      const points = [];
      const index = [];
      const n = outline.length;
      for (let i = 0; i <= slices; i++) {
        const x = from + ((to - from) * i) / slices;
        for (const [y, z] of outline) points.push(x, y, z);
        if (i === 0) continue;
        for (let k = 0; k < n; k++) {
          const [a, b] = [(i - 1) * n + k, (i - 1) * n + ((k + 1) % n)];
          index.push(a, a + n, b, b, a + n, b + n);
        }
      }
      const cap = THREE.ShapeUtils.triangulateShape(outline.map(([y, z]) => new THREE.Vector2(y, z)), []);
      for (const [a, b, c] of cap) index.push(a, c, b, a + slices * n, b + slices * n, c + slices * n);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
      geometry.setIndex(index);
      const mesh = new THREE.Mesh(geometry, material);
      mesh.castShadow = true;
      // shadows on small parts look ragged
      mesh.receiveShadow = material !== this.materials.rail;
      mesh.frustumCulled = false;
      this.root.add(mesh);
      if (material !== this.materials.rail) this.solids.push(mesh);
      return { mesh, outline };
    }

    bend({ mesh, outline }, height) {
      const points = mesh.geometry.attributes.position;
      const n = outline.length;
      for (let i = 0; i < points.count; i += n) {
        const z = height(points.getX(i));
        for (let k = 0; k < n; k++) points.setZ(i + k, outline[k][1] + z);
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
      this.extrude(outline, from + 0.02, to - 0.02, 1, this.materials.rigid);
    }

    addPier(x) {
      const { THREE, root, materials } = this;
      const under = this.top - GIRDER.depth;
      const block = (size, z, material) => {
        const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
        mesh.position.set(x, 0, z);
        mesh.castShadow = mesh.receiveShadow = true;
        root.add(mesh);
      };
      block([0.8, this.half, 0.1], under - 0.05, materials.bearing);
      block([1.3, this.half * 1.9, 0.55], under - 0.375, materials.rigid);
      const height = under - 0.65 - this.ground;
      const column = new THREE.Mesh(new THREE.CylinderGeometry(0.52, 0.6, height, 24), materials.rigid);
      column.rotation.x = Math.PI / 2;
      column.position.set(x, 0, this.ground + height / 2);
      column.castShadow = column.receiveShadow = true;
      root.add(column);
    }

    addRail(y) {
      const w = RAIL.width / 2;
      const outline = [[-w, RAIL.height], [w, RAIL.height], [w, 0], [-w, 0]].map(([a, z]) => [y + a, z]);
      const [from, to] = this.range;
      return this.extrude(outline, from, to, Math.ceil((to - from) / RAIL.step), this.materials.rail);
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
        places: Array.from({ length: count }, (_, i) => from + (i + 0.5) * SLEEPER.every),
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
        const geometry = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(from, y, 0), new THREE.Vector3(to, y, 0)]);
        const line = new THREE.Line(geometry, materials.reference);
        line.computeLineDistances();
        root.add(line);
        return line;
      });
    }

    addGround() {
      const { THREE, root, materials } = this;
      const [from, to] = this.range;
      const ground = new THREE.Mesh(new THREE.PlaneGeometry(to - from + 400, 500), materials.ground);
      ground.position.set((from + to) / 2, 0, this.ground);
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
      this.girders.forEach((girder) => this.bend(girder, (x) => model.bent(x, scale)));
      this.rails.forEach((rail) => this.bend(rail, (x) => under + model.surface(x, scale)));
      this.references.forEach((line) => (line.position.z = under));
      const { places, bars, legs, posts } = this.sleepers;
      const node = new THREE.Object3D();
      places.forEach((x, i) => {
        const slab = this.top + model.bent(x, scale);
        const bar = under + model.surface(x, scale) + RAIL.height / 2;
        node.scale.set(1, 1, 1);
        node.position.set(x, 0, bar);
        node.updateMatrix();
        bars.setMatrixAt(i, node.matrix);
        const height = Math.max(bar - slab, 0.01);
        node.scale.set(1, 1, height);
        legs.forEach((y, leg) => {
          node.position.set(x, y, slab + height / 2);
          node.updateMatrix();
          posts.setMatrixAt(i * legs.length + leg, node.matrix);
        });
      });
      bars.instanceMatrix.needsUpdate = posts.instanceMatrix.needsUpdate = true;
    }
  };
}
