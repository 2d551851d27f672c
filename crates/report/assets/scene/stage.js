// The 3D picture: three.js, light, materials, cameras.
{
  // The modules of three.js import each other; a blob gives each an address.
  scenes.loadThree = async ({ core, module, orbit }) => {
    const address = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    const coreAt = address(core);
    const threeAt = address(module.replaceAll('"./three.core.min.js"', JSON.stringify(coreAt)));
    const orbitAt = address(orbit.replace("from 'three'", `from ${JSON.stringify(threeAt)}`));
    const [THREE, { OrbitControls }] = await Promise.all([import(threeAt), import(orbitAt)]);
    [coreAt, threeAt, orbitAt].forEach((it) => URL.revokeObjectURL(it));
    return { THREE, OrbitControls };
  };

  const LIGHT = {
    sky: 0xeef3f8, ground: 0xdfe5dc, car: 0xfbfcfd, window: 0x27343f, stripe: 0x0f7f8c, frame: 0x5d6b78, part: 0x8a97a3,
    girder: 0xc9c6bf, rigid: 0xb9b5ad, rail: 0x6f7982, sleeper: 0x8f979e, bearing: 0x3f464c, rod: 0x46525d, spring: 0x2b3138,
    reference: 0x0072b2, sun: 2.4, air: 1.5,
  };
  const DARK = {
    ...LIGHT,
    sky: 0x10161c, ground: 0x1b232a, car: 0xd5dce2, window: 0x0e151b, frame: 0x75838f, part: 0x93a0ab, girder: 0x6c6f72,
    rigid: 0x54585c, rail: 0x9aa5af, sleeper: 0x7c868e, bearing: 0x24292e, rod: 0x8794a0, spring: 0x0c0f12, reference: 0x56b4e9,
    sun: 1.9, air: 0.9,
  };

  // Position of each camera and the point it looks at, relative to the middle of the train: [x, y, z] in
  // half lengths of the train, or in metres relative to a magnet if near.
  const VIEWS = {
    side: { label: "Side", from: [0, -1, 0.05], aim: [0, 0, -0.02], across: 2.4 },
    quarter: { label: "Three-quarter", from: [0.95, -0.9, 0.42], aim: [0.12, 0, -0.02], across: 2.0 },
    under: { label: "Underneath", from: [0.5, -0.75, -0.2], aim: [0.1, 0, 0], across: 1.2 },
    magnet: { label: "At a magnet", near: true, from: [1.1, -2.3, 0.1], aim: [-0.4, 0, 0.05] },
    ahead: { label: "From the front", from: [1, -0.28, 0.16], aim: [0.5, 0, 0.02], across: 1.5 },
  };
  scenes.VIEWS = VIEWS;

  scenes.Stage = class {
    constructor({ THREE, OrbitControls }, model, canvas) {
      Object.assign(this, { THREE, model, canvas });
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.renderer.shadowMap.enabled = true;
      this.renderer.shadowMap.type = THREE.PCFShadowMap;
      this.scene = new THREE.Scene();
      this.camera = new THREE.PerspectiveCamera(32, 2, 0.1, 900);
      this.camera.up.set(0, 0, 1);
      this.controls = new OrbitControls(this.camera, canvas);
      this.controls.maxDistance = 300;
      this.controls.minDistance = 0.6;
      this.controls.zoomToCursor = true;
      this.controls.enableDamping = false;
      this.materials = this.makeMaterials();
      this.track = new scenes.Track(THREE, model, this.materials);
      this.train = new scenes.Train(THREE, model, this.materials);
      this.scene.add(this.track.root, this.train.root);
      this.addLight();
      this.middle = (model.reach[0] + model.reach[1]) / 2;
      this.base = this.level(this.middle);
      // short vehicles are as high as they are long
      this.half = Math.max((model.reach[1] - model.reach[0]) / 2, model.data.boxes.length > 1 ? 6.5 : 2.5);
    }

    // The heading of the line at a place on the train, as a matrix.
    level(x) {
      const { THREE, model } = this;
      return scenes.Course.matrix(THREE, model.course.level(model.travelled() + x));
    }

    makeMaterials() {
      const { THREE } = this;
      const standard = (roughness, metalness = 0, more = {}) => new THREE.MeshStandardMaterial({ roughness, metalness, ...more });
      const flat = { flatShading: true };
      const both = { side: THREE.DoubleSide };
      return {
        car: standard(0.35, 0.05, both), window: standard(0.15, 0.3, both), stripe: standard(0.4, 0, both),
        frame: standard(0.6, 0.2), part: standard(0.65, 0.1), rod: standard(0.5, 0.3), spring: standard(0.8),
        magnet: new THREE.MeshBasicMaterial(), girder: standard(0.95, 0, flat), rigid: standard(0.95, 0, flat), rail: standard(0.4, 0.35, flat),
        sleeper: standard(0.8), bearing: standard(0.7), ground: standard(1),
        reference: new THREE.LineDashedMaterial({ dashSize: 0.5, gapSize: 0.35 }),
      };
    }

    addLight() {
      const { THREE, scene } = this;
      this.air = new THREE.HemisphereLight(0xffffff, 0xb8b2a4);
      this.sun = new THREE.DirectionalLight(0xffffff);
      this.sun.castShadow = true;
      this.sun.shadow.mapSize.set(4096, 1024);
      this.sun.shadow.bias = -0.0008;
      this.sun.shadow.normalBias = 0.03;
      const reach = Math.max((this.model.reach[1] - this.model.reach[0]) * 0.75, 8);
      Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: 12, bottom: -12, near: 1, far: 80 });
      scene.add(this.air, this.sun, this.sun.target);
    }

    // Colours for a light or a dark page.
    paint(dark) {
      const colours = dark ? DARK : LIGHT;
      for (const [name, material] of Object.entries(this.materials)) {
        if (name in colours) material.color.setHex(colours[name]);
      }
      this.scene.background = new this.THREE.Color(colours.sky);
      this.scene.fog = new this.THREE.Fog(colours.sky, 90, 260);
      this.sun.intensity = colours.sun;
      this.air.intensity = colours.air;
    }

    seeThrough(on) {
      for (const name of ["car", "window", "stripe"]) {
        const material = this.materials[name];
        material.transparent = on;
        material.opacity = on ? 0.16 : 1;
        material.depthWrite = !on;
        material.needsUpdate = true;
      }
    }

    resize(width, height) {
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
    }

    // Position and target of a preset camera.
    look(name, scale) {
      const { THREE, model, camera } = this;
      const view = VIEWS[name];
      const under = this.track.under(scale);
      if (view.near) {
        const k = this.nearest();
        const [x, y, z] = model.data.magnets[k].position;
        const side = y > 0 ? -1 : 1;
        const beside = this.level(x);
        const place = ([a, b, c]) => new THREE.Vector3(a, y + side * b, c + z + model.lift(k, scale)).applyMatrix4(beside);
        return this.free({ from: place(view.from), aim: place(view.aim) });
      }
      // far enough away that the train fits across, however narrow the window
      const wide = Math.tan((camera.fov * Math.PI) / 360) * Math.min(camera.aspect, 2.6);
      const away = (view.across * this.half) / wide / 2;
      const aim = new THREE.Vector3(0, 0, under + 0.08 * this.half).addScaledVector(new THREE.Vector3(...view.aim), this.half);
      const from = aim.clone().addScaledVector(new THREE.Vector3(...view.from).normalize(), away * 1.06);
      const here = this.level(this.middle);
      return this.free({ from: from.applyMatrix4(here), aim: aim.applyMatrix4(here) });
    }

    // Raises a camera until it is above the ground and no girder or rigid ground hides what it looks at.
    free({ from, aim }) {
      const { THREE, track } = this;
      this.sight ??= new THREE.Raycaster();
      track.solids.forEach((mesh) => mesh.geometry.computeBoundingSphere());
      const far = from.distanceTo(aim);
      for (let step = 0; step < 12; step++) {
        this.sight.set(aim, from.clone().sub(aim).normalize());
        this.sight.far = from.distanceTo(aim);
        if (from.z > track.ground + 0.5 && this.sight.intersectObjects(track.solids).length === 0) break;
        from.z += 0.08 * far;
      }
      return { from, aim };
    }

    // The magnet on the near side whose gap is farthest from the nominal one.
    nearest() {
      const { model } = this;
      let best = 0;
      let largest = -1;
      model.data.magnets.forEach(({ position }, k) => {
        const deviation = Math.abs(model.deviation(k) ?? 0);
        if (position[1] <= 0.1 && deviation > largest) [best, largest] = [k, deviation];
      });
      return best;
    }

    // Moves the camera to a place within some milliseconds; `changed` asks for a drawing.
    glide({ from, aim }, duration, changed) {
      const { camera, controls } = this;
      // relative to the train, which may go on meanwhile
      const way = [[camera.position, from], [controls.target, aim]].map(([now, then]) => {
        const local = this.base.clone().invert();
        const start = (duration > 0 ? now : then).clone().applyMatrix4(local);
        return [now, start, then.clone().applyMatrix4(local)];
      });
      const begin = performance.now();
      const token = (this.gliding = {});
      controls.addEventListener("start", () => { this.gliding = null; });
      const step = () => {
        if (this.gliding !== token) return;
        const part = duration > 0 ? Math.min((performance.now() - begin) / duration, 1) : 1;
        const eased = part * part * (3 - 2 * part);
        for (const [now, start, end] of way) {
          now.lerpVectors(start, end, eased).applyMatrix4(this.base);
        }
        controls.update();
        changed();
        if (part < 1) requestAnimationFrame(step);
      };
      step();
    }

    // Brings everything to the model's time; the camera goes with the train if it follows.
    update(scale, range, follow) {
      const here = this.level(this.middle);
      if (follow && !here.equals(this.base)) {
        const way = here.clone().multiply(this.base.clone().invert());
        this.camera.position.applyMatrix4(way);
        this.controls.target.applyMatrix4(way);
        this.controls.update();
      }
      this.base = here;
      this.track.update(scale);
      this.train.update(scale, range);
      this.sun.position.set(-9, -22, 24).applyMatrix4(here);
      this.sun.target.position.set(0, 0, 0).applyMatrix4(here);
    }

    // The magnet under a point of the canvas, in −1 … 1 both ways; −1 for none.
    pick(x, y) {
      this.ray ??= new this.THREE.Raycaster();
      this.ray.setFromCamera(new this.THREE.Vector2(x, y), this.camera);
      this.train.magnets.computeBoundingSphere();
      const [hit] = this.ray.intersectObject(this.train.magnets);
      return hit ? hit.instanceId : -1;
    }

    destroy() {
      this.gliding = null;
      this.controls.dispose();
      this.scene.traverse((node) => node.geometry?.dispose());
      this.renderer.dispose();
    }

    render() {
      this.renderer.render(this.scene, this.camera);
    }
  };
}
