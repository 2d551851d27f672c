// The train as meshes.
{
  const MAGNET = { width: 0.24, height: 0.12 };
  scenes.MAGNET = MAGNET;
  // Distance of a side frame outside its magnets (m).
  const OUTSIDE = 0.24;

  scenes.Train = class {
    constructor(THREE, model, materials) {
      Object.assign(this, { THREE, model, materials });
      this.root = new THREE.Group();
      this.groups = model.data.groups.map((group) => {
        const node = new THREE.Group();
        node.matrixAutoUpdate = false;
        this.root.add(node);
        return node;
      });
      const cars = model.data.boxes.filter((box) => box.lead && this.kind(box.group) === "car");
      const ends = cars.flatMap((box) => [box.center[0] - box.size[0] / 2, box.center[0] + box.size[0] / 2]);
      this.tips = [Math.min(...ends), Math.max(...ends)];
      for (const box of model.data.boxes) this.addBox(box);
      this.addMagnets();
      this.rods = this.addLinks(model.data.rods, materials.rod);
      this.springs = this.addLinks(model.data.springs, materials.spring);
    }

    kind(g) {
      return this.model.data.groups[g].kind;
    }

    addBox(box) {
      const kind = box.lead ? this.kind(box.group) : "part";
      if (kind === "car") this.addCar(box);
      else if (kind === "frame") this.addFrame(box);
      else this.block(box.group, box.center, box.size, this.materials.part);
    }

    // A box on a group, at a position of the vehicle file.
    block(g, center, size, material) {
      const { THREE } = this;
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
      const origin = this.model.data.groups[g].center;
      mesh.position.set(...center.map((it, i) => it - origin[i]));
      mesh.castShadow = true;
      this.groups[g].add(mesh);
      return mesh;
    }

    // A car body: a shell over an open underfloor, a band of windows, and a nose where the train ends.
    addCar({ group, center, size }) {
      const [length, width, height] = size;
      const floor = center[2] - height / 2 + 0.17 * height;
      const top = center[2] + height / 2;
      const shell = { group, center, length, width, floor, top };
      this.addShell(shell, 1, floor, top, 0.34, this.materials.car);
      const band = floor + (top - floor) * 0.42;
      this.addShell({ ...shell, length: length * 1.003 }, 1.006, band, band + (top - floor) * 0.32, 0.06, this.materials.window);
      this.addShell(shell, 1.003, floor + 0.06, floor + 0.2, 0.02, this.materials.stripe);
    }

    // A slice of a car's shell between two heights, `wide` times its width.
    addShell({ group, center, length, width, floor, top }, wide, low, high, round, material) {
      const { THREE } = this;
      const [w, h] = [(wide * width) / 2, high - low];
      const shape = new THREE.Shape();
      const r = Math.min(round, h / 2);
      shape.moveTo(-w, 0);
      shape.lineTo(w, 0);
      shape.lineTo(w, h - r);
      shape.quadraticCurveTo(w, h, w - r, h);
      shape.lineTo(-w + r, h);
      shape.quadraticCurveTo(-w, h, -w, h - r);
      const geometry = new THREE.ExtrudeGeometry(shape, { depth: length, steps: 60, bevelEnabled: false, curveSegments: 6 });
      const points = geometry.attributes.position;
      for (let i = 0; i < points.count; i++) {
        const [y, z, along] = [points.getX(i), points.getY(i) + low, points.getZ(i) - length / 2];
        const x = center[0] + along;
        const [px, py] = this.nose(x, y, (z - floor) / (top - floor));
        points.setXYZ(i, px - center[0], py, z - center[2]);
      }
      geometry.computeVertexNormals();
      const mesh = new THREE.Mesh(geometry, material);
      const origin = this.model.data.groups[group].center;
      mesh.position.set(...center.map((it, i) => it - origin[i]));
      mesh.castShadow = true;
      this.groups[group].add(mesh);
    }

    // Rounds the ends of the train, more towards the roof: `up` is 0 at the floor and 1 at the roof.
    nose(x, y, up) {
      const long = Math.min(1.7, 0.2 * (this.tips[1] - this.tips[0]));
      for (const [tip, side] of [[this.tips[0], -1], [this.tips[1], 1]]) {
        const near = 1 - (side * (tip - x)) / long;
        if (near > 0) return [x - side * near * near * long * 0.62 * Math.max(up, 0) ** 1.6, y * (1 - 0.16 * near * near)];
      }
      return [x, y];
    }

    // A side frame grips around the rail: a beam below the magnets, one above the rail, and posts outside.
    // One in the middle of the track is a box below its magnets.
    addFrame({ group, center, size }) {
      const magnets = this.model.carriers[group].magnets.map((k) => this.model.data.magnets[k].position);
      const [length, width, height] = size;
      const low = Math.min(...magnets.map((it) => it[2])) - MAGNET.height / 2;
      const { frame } = this.materials;
      const side = Math.sign(center[1]);
      if (Math.abs(center[1]) < 0.1) {
        this.block(group, [center[0], center[1], low - height / 2], [length, Math.max(width, MAGNET.width), height], frame);
        return;
      }
      const top = center[2] + height / 2 + 0.03;
      const outside = center[1] + side * OUTSIDE;
      this.block(group, [center[0], center[1], low - 0.05], [length, 0.34, 0.1], frame);
      this.block(group, [center[0], outside, top], [length, 0.1, 0.1], frame);
      const places = [...new Set(magnets.map((it) => it[0]))].sort((a, b) => a - b);
      const posts = places.slice(1).map((x, i) => (x + places[i]) / 2);
      for (const x of [center[0] - length / 2 + 0.04, ...posts, center[0] + length / 2 - 0.04]) {
        this.block(group, [x, outside, (top + low - 0.1) / 2], [0.07, 0.08, top - low + 0.1], frame);
        this.block(group, [x, center[1] + (side * OUTSIDE) / 2, low - 0.05], [0.07, OUTSIDE, 0.1], frame);
        this.block(group, [x, center[1] + (side * OUTSIDE) / 2, top], [0.07, OUTSIDE, 0.08], frame);
      }
    }

    addMagnets() {
      const { THREE, model } = this;
      const box = new THREE.BoxGeometry(model.data.pole_length * 0.96, MAGNET.width, MAGNET.height);
      this.magnets = new THREE.InstancedMesh(box, this.materials.magnet, model.data.magnets.length);
      this.magnets.frustumCulled = false;
      this.magnets.castShadow = true;
      this.root.add(this.magnets);
    }

    addLinks(links, material) {
      const { THREE } = this;
      const shape = new THREE.CylinderGeometry(0.5, 0.5, 1, 14);
      const mesh = new THREE.InstancedMesh(shape, material, Math.max(links.length, 1));
      mesh.count = links.length;
      mesh.frustumCulled = false;
      mesh.castShadow = true;
      this.root.add(mesh);
      return { mesh, links };
    }

    update(scale, range) {
      const { model, groups } = this;
      this.poses = groups.map((node, g) => {
        const pose = model.pose(g, scale);
        const [x, y, z] = model.data.groups[g].center;
        this.put(node.matrix, x, y + pose.lateral, z + pose.vertical, pose);
        node.matrixWorldNeedsUpdate = true;
        return pose;
      });
      this.updateMagnets(scale, range);
      this.updateLinks(this.rods);
      this.updateLinks(this.springs);
    }

    // Sets a matrix to a place on the train, x along it from its origin, turned by a pose.
    put(matrix, x, y, z, { roll, pitch, yaw }) {
      const { THREE, model } = this;
      const turned = new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(roll, pitch, yaw, "ZYX")).setPosition(0, y, z);
      matrix.multiplyMatrices(scenes.Course.matrix(THREE, model.course.at(model.travelled() + x)), turned);
    }

    updateMagnets(scale, range) {
      const { THREE, model } = this;
      const matrix = new THREE.Matrix4();
      const colour = new THREE.Color();
      model.data.magnets.forEach(({ group, position: [x, y, z] }, k) => {
        const pose = this.poses[group];
        this.put(matrix, x, y + pose.lateral, z + model.lift(k, scale), pose);
        this.magnets.setMatrixAt(k, matrix);
        const [r, g, b] = scenes.colour(model.deviation(k), range);
        this.magnets.setColorAt(k, colour.setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace));
      });
      this.magnets.instanceMatrix.needsUpdate = true;
      this.magnets.instanceColor.needsUpdate = true;
    }

    updateLinks({ mesh, links }) {
      const { THREE } = this;
      const up = new THREE.Vector3(0, 1, 0);
      const node = new THREE.Object3D();
      links.forEach(({ ends, thickness }, i) => {
        const [a, b] = ends.map(({ group, position }) => {
          const origin = this.model.data.groups[group].center;
          return new THREE.Vector3(...position.map((it, n) => it - origin[n])).applyMatrix4(this.groups[group].matrix);
        });
        const along = b.clone().sub(a);
        const length = Math.max(along.length(), 1e-3);
        node.position.copy(a).addScaledVector(along, 0.5);
        node.quaternion.setFromUnitVectors(up, along.divideScalar(length));
        node.scale.set(thickness, length, thickness);
        node.updateMatrix();
        mesh.setMatrixAt(i, node.matrix);
      });
      mesh.instanceMatrix.needsUpdate = true;
    }
  };
}
