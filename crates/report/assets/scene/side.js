// A side view in two dimensions, for browsers without WebGL.
{
  scenes.SideStage = class {
    constructor(model, canvas) {
      Object.assign(this, { model, canvas });
      this.context = canvas.getContext("2d");
      this.middle = (model.reach[0] + model.reach[1]) / 2;
      this.half = Math.max((model.reach[1] - model.reach[0]) / 2, 1.5);
      this.centre = model.travelled() + this.middle;
    }

    paint(dark) {
      this.colours = dark
        ? { sky: "#10161c", line: "#c3ced8", fill: "#3c444b", car: "#2a333b" }
        : { sky: "#eef3f8", line: "#33414d", fill: "#c9c6bf", car: "#ffffff" };
    }

    resize(width, height) {
      const ratio = Math.min(devicePixelRatio, 2);
      this.canvas.width = width * ratio;
      this.canvas.height = height * ratio;
    }

    update(scale, range, follow) {
      if (follow) this.centre = this.model.travelled() + this.middle;
      Object.assign(this, { scale, range });
    }

    render() {
      const { context, canvas, colours, model, scale } = this;
      const pixels = canvas.width / (this.half * 2.7);
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.fillStyle = colours.sky;
      context.fillRect(0, 0, canvas.width, canvas.height);
      // metres, z up, the magnets a little below the middle
      context.setTransform(pixels, 0, 0, -pixels, canvas.width / 2 - this.centre * pixels, canvas.height * 0.55);
      context.lineWidth = 1.5 / pixels;
      context.strokeStyle = colours.line;
      const magnets = model.data.magnets;
      const faces = Math.max(...magnets.map((it) => it.position[2])) + scenes.MAGNET.height / 2;
      const under = faces + scale.gap * model.data.nominal_gap;
      const near = Math.min(...magnets.map((it) => it.position[1]));
      this.ribbon((x) => under + model.surface(x, scale, near), 0.07, colours.line);
      this.ribbon((x) => faces - 0.8 + model.bent(x, scale), -1.5, colours.fill);
      this.boxes();
      magnets.forEach(({ position: [x, y, z] }, k) => {
        if (y > 0.1) return;
        const length = model.data.pole_length;
        const [left, low] = [model.travelled() + x - length / 2, z + model.lift(k, scale) - scenes.MAGNET.height / 2];
        context.fillStyle = `rgb(${scenes.colour(model.deviation(k), this.range)})`;
        context.fillRect(left, low, length, scenes.MAGNET.height);
        context.strokeRect(left, low, length, scenes.MAGNET.height);
      });
    }

    // Fills the area along the track between a line and `thick` above it.
    ribbon(height, thick, colour) {
      const { context } = this;
      const [from, to] = [this.centre - this.half * 1.4, this.centre + this.half * 1.4];
      const places = Array.from({ length: 241 }, (_, i) => from + ((to - from) * i) / 240);
      context.fillStyle = colour;
      context.beginPath();
      places.forEach((x) => context.lineTo(x, height(x)));
      places.reverse().forEach((x) => context.lineTo(x, height(x) + thick));
      context.fill();
    }

    boxes() {
      const { context, colours, model, scale } = this;
      for (const { group, lead, center, size } of model.data.boxes) {
        if (!lead || model.data.groups[group].kind !== "car") continue;
        const pose = model.pose(group, scale);
        context.save();
        context.translate(model.travelled() + center[0], center[2] + pose.vertical);
        context.rotate(-pose.pitch);
        context.fillStyle = colours.car;
        context.fillRect(-size[0] / 2, -size[2] * 0.33, size[0], size[2] * 0.83);
        context.strokeRect(-size[0] / 2, -size[2] * 0.33, size[0], size[2] * 0.83);
        context.restore();
      }
    }
  };
}
