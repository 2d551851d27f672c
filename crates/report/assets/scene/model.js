// Train and track at a time, as numbers. Nothing is drawn here.
{
  // What a view draws: positions along the track in metres, and what is across it, heights and angles exaggerated.
  scenes.Model = class {
    // `data` is the scene in the report's data, `get` returns the array of a reference.
    constructor(data, get) {
      const channel = (reference) => (reference ? get(reference) : null);
      this.data = data;
      this.time = channel(data.time);
      this.position = channel(data.position);
      this.gaps = data.gaps.map(channel);
      this.poses = data.poses.map((pose) =>
        Object.fromEntries(Object.entries(pose).map(([name, reference]) => [name, channel(reference)])),
      );
      this.course = new scenes.Course(data.line, get);
      const sway = (it) => it && { ...it, values: channel(it.values) };
      this.spans = data.spans.map((span) => ({
        ...span, modes: span.modes.map(channel), natural: span.natural.map(channel), lateral: sway(span.lateral), twist: sway(span.twist),
      }));
      this.profiles = data.irregularity.map((it) => ({ ...it, values: channel(it.values) }));
      this.carriers = data.groups.map((group, g) => ({
        ...group,
        magnets: data.magnets.flatMap((magnet, k) => (magnet.group === g ? [k] : [])),
        above: this.below(g),
      }));
      const reach = data.boxes.flatMap((box) => [box.center[0] - box.size[0] / 2, box.center[0] + box.size[0] / 2]);
      this.reach = [Math.min(...reach), Math.max(...reach)];
      this.frame = { index: 0, part: 0, time: this.time[0] };
      // a natural mode of the girders instead of the recorded deflection
      this.mode = null;
      // or a mode of the coupled system, of train and girders
      this.coupled = null;
      this.phase = Math.PI / 2;
    }

    // Whether a mode is drawn and not the recorded motion.
    get animated() {
      return this.mode !== null || this.coupled !== null;
    }

    // Re(amplitude · e^(iφ)), as a fraction of the mode's largest displacement.
    moved(re, im) {
      return re * Math.sin(this.phase) + im * Math.cos(this.phase);
    }

    // Drawn displacement (m) of the largest in a coupled mode: readable, and no gap closes.
    size(scale) {
      const widest = this.widestGap();
      const room = widest > 0 ? (0.9 * scale.gap * this.data.nominal_gap) / widest : Infinity;
      return Math.min(scale.deflection * this.amplitude(), room);
    }

    // Complex displacement in a coupled mode of the girders at x: [re, im] upward, to the left, and of the twist.
    girderShape(x) {
      const s = this.spans.findIndex((span) => x >= span.start && x <= span.end);
      const points = s < 0 ? [] : this.coupled.spans[s];
      if (points.length < 2) return [0, 0, 0, 0, 0, 0];
      const place = (x - this.spans[s].start) / (this.spans[s].end - this.spans[s].start);
      const high = Math.max(points.findIndex((point) => point[0] >= place), 1);
      const [a, b] = [points[high - 1], points[high]];
      const part = (place - a[0]) / (b[0] - a[0]);
      // a smooth line through few points
      const smooth = (i) => {
        const at = (k) => points[Math.min(Math.max(k, 0), points.length - 1)][i];
        const [p, q, r, t] = [at(high - 2), at(high - 1), at(high), at(high + 1)];
        return q + 0.5 * part * (r - p + part * (2 * p - 5 * q + 4 * r - t + part * (3 * (q - r) + t - p)));
      };
      return [1, 2, 3, 4, 5, 6].map(smooth);
    }

    // The same of a rail beside the middle of the track, upward.
    railShape(x, y) {
      const [re, im, , , turnRe, turnIm] = this.girderShape(x);
      return [re + y * turnRe, im + y * turnIm];
    }

    // The same of a magnet.
    magnetShape(k) {
      const { group, position } = this.data.magnets[k];
      const { center } = this.data.groups[group];
      const m = this.coupled.groups[group];
      return [0, 1].map((i) => m[2 + i] - m[6 + i] * (position[0] - center[0]) + m[4 + i] * (position[1] - center[1]));
    }

    // Largest change of a gap in a coupled mode, as a fraction of its largest displacement.
    widestGap() {
      const key = [this.coupled, this.travelled()];
      if (this.widest?.key.every((it, i) => it === key[i])) return this.widest.value;
      const changes = this.data.magnets.map(({ position }, k) => {
        const [a, b] = [this.railShape(this.travelled() + position[0], position[1]), this.magnetShape(k)];
        return Math.hypot(a[0] - b[0], a[1] - b[1]);
      });
      this.widest = { key, value: Math.max(0, ...changes) };
      return this.widest.value;
    }

    // Number of natural modes that all girders have.
    get modeCount() {
      return this.spans.length > 0 ? Math.min(...this.spans.map((span) => span.natural.length)) : 0;
    }

    // The magnets along the length of a group's leading body.
    below(g) {
      const { boxes, magnets } = this.data;
      const lead = boxes.find((box) => box.lead && box.group === g);
      const near = ({ position }) => Math.abs(position[0] - lead.center[0]) <= lead.size[0] / 2;
      return magnets.flatMap((magnet, k) => (lead && near(magnet) ? [k] : []));
    }

    get begin() {
      return this.time[0];
    }

    get end() {
      return this.time[this.time.length - 1];
    }

    // Goes to a time. Values are interpolated between the two frames around it.
    seek(time) {
      const times = this.time;
      const t = Math.min(Math.max(time, this.begin), this.end);
      let low = 0;
      let high = times.length - 1;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (times[middle] <= t) low = middle;
        else high = middle;
      }
      const step = times[high] - times[low];
      this.frame = { index: low, next: high, part: step > 0 ? (t - times[low]) / step : 0, time: t };
    }

    // Time of the frame `count` frames from here.
    neighbour(count) {
      const { index, part } = this.frame;
      const here = count < 0 && part > 0 ? index + 1 : part > 0.999 ? index + 1 : index;
      return this.time[Math.min(Math.max(here + count, 0), this.time.length - 1)];
    }

    // Current value of a channel; `otherwise` if it is not recorded.
    value(channel, otherwise = 0) {
      if (!channel) return otherwise;
      const { index, next, part } = this.frame;
      return part > 0 ? channel[index] + part * (channel[next] - channel[index]) : channel[index];
    }

    travelled() {
      return this.value(this.position);
    }

    // Deflection (m) of the girders at x.
    deflection(x) {
      for (const span of this.spans) {
        if (x < span.start || x > span.end) continue;
        const place = (x - span.start) / (span.end - span.start);
        if (this.mode !== null) {
          const shape = span.natural[this.mode];
          return (this.amplitude() * Math.sin(this.phase) * sample(shape, place)) / (largest(shape) || 1);
        }
        return span.modes.reduce((sum, mode, n) => sum + this.value(mode) * sample(span.shapes[n], place), 0);
      }
      return 0;
    }

    // Height (m) at which the girders' deflection is drawn.
    bent(x, scale) {
      if (this.coupled === null) return scale.deflection * this.deflection(x);
      return this.size(scale) * this.moved(...this.girderShape(x).slice(0, 2));
    }

    // How the girders are drawn beside their straight line: shifted to the left (m), and turned, left side up (rad).
    sway(x, scale) {
      if (this.coupled !== null) {
        const [, , ...parts] = this.girderShape(x);
        const [shift, turn] = [0, 2].map((i) => this.size(scale) * this.moved(parts[i], parts[i + 1]));
        return { shift, turn: Math.atan(turn) };
      }
      const span = this.mode === null && this.spans.find((it) => x >= it.start && x <= it.end);
      if (!span) return { shift: 0, turn: 0 };
      const place = (x - span.start) / (span.end - span.start);
      const value = (it) => (it ? scale.deflection * this.value(it.values) * sample(it.shape, place) : 0);
      return { shift: value(span.lateral), turn: Math.atan(value(span.twist)) };
    }

    // A point of the girder or a rail, `y` to the left and `z` up of the undeflected rails' middle, where it is drawn
    // across the line: bent, and turned about the shear centre.
    across(x, y, z, scale) {
      const { shift, turn } = this.sway(x, scale);
      const high = z + this.data.rail_height;
      const [c, s] = [Math.cos(turn), Math.sin(turn)];
      return [shift + c * y - s * high, this.bent(x, scale) + s * y + c * high - this.data.rail_height];
    }

    // Irregularity (m) of the rail at the side of y, at x; 0 where it is unknown.
    irregularity(x, y) {
      const profile = this.profiles.find(({ side }) => side === 0 || side === Math.sign(y));
      if (!profile) return 0;
      const { start, step, values } = profile;
      const place = (x - start) / step / (values.length - 1);
      return place >= 0 && place <= 1 ? sample(values, place) : 0;
    }

    // Height (m) at which the irregularity of a rail is drawn.
    rough(x, y, scale) {
      return this.coupled === null ? scale.gap * this.irregularity(x, y) : 0;
    }

    // Height (m) at which the surface of a rail is drawn: deflection and irregularity, each with its factor.
    surface(x, scale, y = 0) {
      return this.across(x, y, 0, scale)[1] + this.rough(x, y, scale);
    }

    gap(k) {
      return this.value(this.gaps[k], this.data.nominal_gap);
    }

    // Deviation of magnet k's gap from the nominal one (m), null if it is not recorded.
    // In a coupled mode its change, so that the largest has the last colour.
    deviation(k) {
      if (this.coupled !== null) {
        const { position } = this.data.magnets[k];
        const [a, b] = [this.railShape(this.travelled() + position[0], position[1]), this.magnetShape(k)];
        this.usual ??= this.usualDeviation();
        return (this.usual * this.moved(a[0] - b[0], a[1] - b[1])) / (this.widestGap() || 1);
      }
      return this.gaps[k] ? this.gap(k) - this.data.nominal_gap : null;
    }

    // 98th percentile of the deviations (m), rounded up to 1, 2 or 5 of a decade.
    usualDeviation() {
      const all = [];
      const { nominal_gap: nominal } = this.data;
      for (const gap of this.gaps) if (gap) for (const value of gap) all.push(Math.abs(value - nominal));
      const sorted = Float64Array.from(all).sort();
      const usual = sorted[Math.floor(0.98 * sorted.length)] ?? 0;
      return scenes.roundUp(Math.min(Math.max(usual, 1e-6), nominal));
    }

    // Amplitude (m) of a natural mode, whose size is arbitrary: that of the largest deflection.
    amplitude() {
      this.largest ??= this.largestDeflection() || 1e-3;
      return this.largest;
    }

    // Largest deflection over the run (m).
    largestDeflection() {
      let largest = 0;
      for (const span of this.spans) {
        const peak = (n) => span.shapes[n].reduce((most, value) => Math.max(most, Math.abs(value)), 0);
        span.modes.forEach((mode, n) => {
          // the values of a diverged run may be infinite
          for (const value of mode) if (Number.isFinite(value)) largest = Math.max(largest, Math.abs(value) * peak(n));
        });
      }
      return largest;
    }

    // Time of the largest deflection; without girders, that of the gap farthest from the nominal one.
    timeOfLargest() {
      const sums = new Float64Array(this.time.length);
      for (const span of this.spans) {
        for (let place = 0; place <= 1; place += 0.125) {
          const shapes = span.shapes.map((shape) => sample(shape, place));
          for (let i = 0; i < sums.length; i++) {
            const here = Math.abs(span.modes.reduce((sum, mode, n) => sum + mode[i] * shapes[n], 0));
            if (Number.isFinite(here) && here > sums[i]) sums[i] = here;
          }
        }
      }
      if (sums.every((it) => it === 0)) {
        for (const gap of this.gaps) gap?.forEach((value, i) => { sums[i] = Math.max(sums[i], Math.abs(value - this.data.nominal_gap) || 0); });
      }
      return this.time[sums.reduce((best, it, i) => (it > sums[best] ? i : best), 0)];
    }

    // The deflection of the girders is multiplied by one factor, everything relative to the girders by
    // another. A magnet moves up with the surface and down by the deviation of its gap.
    lift(k, scale) {
      if (this.coupled !== null) return this.size(scale) * this.moved(...this.magnetShape(k));
      const [x, y] = this.data.magnets[k].position;
      return this.surface(this.travelled() + x, scale, y) - scale.gap * (this.deviation(k) ?? 0);
    }

    // The drawn pose of group g about its place in the vehicle file.
    pose(g, scale) {
      if (this.coupled !== null) {
        const m = this.coupled.groups[g];
        const [lateral, vertical, roll, pitch, yaw] = [0, 2, 4, 6, 8].map((i) => this.size(scale) * this.moved(m[i], m[i + 1]));
        return { lateral, vertical, roll: Math.atan(roll), pitch: Math.atan(pitch), yaw: Math.atan(yaw) };
      }
      const recorded = this.poses[g];
      const turn = (channel) => Math.atan(scale.gap * this.value(channel));
      const { center, magnets, above } = this.carriers[g];
      // offsets are relative to the rails, positions of cars are not
      const moved = magnets.length > 0 ? this.across(this.travelled() + center[0], 0, 0, scale)[0] : 0;
      const sideways = { lateral: moved + scale.gap * this.value(recorded.lateral), roll: turn(recorded.roll), yaw: turn(recorded.yaw) };
      if (magnets.length > 0) {
        const { height, slope } = this.line(magnets, center[0], (k) => this.lift(k, scale));
        return { ...sideways, vertical: height, pitch: -Math.atan(slope) };
      }
      // a car moves with the girders below it
      const girders = this.line(above, center[0], (k) => this.deflection(this.travelled() + this.data.magnets[k].position[0]));
      const part = (channel, under) => {
        const own = channel ? this.value(channel) - under : 0;
        return scale.deflection * under + scale.gap * own;
      };
      return {
        ...sideways,
        vertical: part(recorded.vertical, girders.height),
        pitch: Math.atan(part(recorded.pitch, -girders.slope)),
      };
    }

    // Least-squares line through values at some magnets, about x.
    line(magnets, x, value) {
      if (magnets.length === 0) return { height: 0, slope: 0 };
      const points = magnets.map((k) => [this.data.magnets[k].position[0] - x, value(k)]);
      const mean = (i) => points.reduce((sum, point) => sum + point[i], 0) / points.length;
      const [middle, height] = [mean(0), mean(1)];
      const spread = points.reduce((sum, [a]) => sum + (a - middle) ** 2, 0);
      const slope = spread > 0 ? points.reduce((sum, [a, b]) => sum + (a - middle) * (b - height), 0) / spread : 0;
      return { height: height - slope * middle, slope };
    }
  };

  // Value of an evenly spaced table at `place`, 0 … 1.
  function sample(table, place) {
    const at = place * (table.length - 1);
    const index = Math.min(Math.floor(at), table.length - 2);
    return index < 0 ? table[0] : table[index] + (at - index) * (table[index + 1] - table[index]);
  }

  // Rounds up to 1, 2 or 5 of a decade.
  scenes.roundUp = (value) => {
    const decade = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].map((digit) => digit * decade).find((it) => it >= value * (1 - 1e-9));
  };

  // ColorBrewer RdBu, reversed: small gaps blue, large gaps red. Colour-blind readers can distinguish them.
  const COLOURS = ["#2166ac", "#67a9cf", "#d1e5f0", "#f7f7f7", "#fddbc7", "#ef8a62", "#b2182b"].map((text) =>
    [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)),
  );

  // Colour [r, g, b] (0 … 255) of a deviation over `range`; grey if it is unknown.
  scenes.colour = (deviation, range) => {
    if (deviation === null) return [128, 128, 128];
    const at = (Math.min(Math.max(deviation / range, -1), 1) + 1) * 0.5 * (COLOURS.length - 1);
    const index = Math.min(Math.floor(at), COLOURS.length - 2);
    return COLOURS[index].map((low, i) => Math.round(low + (at - index) * (COLOURS[index + 1][i] - low)));
  };

  scenes.gradient = () => `linear-gradient(to right, ${COLOURS.map((colour) => `rgb(${colour})`).join(", ")})`;
}
