// Spectrograms: power spectral density over time and frequency, as a picture below a plot.

const DEPTH = 80; // decibels from the brightest shade to the darkest, as in spectrogram.rs

class SpectrogramView {
  constructor(parent, entries) {
    this.entries = entries;
    const options = entries.map((it, k) => element("option", { value: k }, runPrefix(it.run) + it.signal.name));
    this.select = element("select", { "aria-label": "Signal of the spectrogram" }, options);
    this.select.addEventListener("change", () => this.draw());
    const first = firstSignals(entries.map((it) => it.signal.name))[0];
    this.select.value = String(Math.max(0, entries.findIndex((it) => it.signal.name === first)));
    this.place = element("div");
    this.scale = element("canvas", { class: "scale", width: 256, height: 1, "aria-hidden": "true" });
    this.ends = [element("span"), element("span")];
    parent.append(
      element("div", { class: "choices" }, element("label", { class: "choice" }, "Signal ", this.select),
        element("div", { class: "scalebox" }, this.ends[0], this.scale, this.ends[1])),
      this.place);
    this.paintScale();
    this.draw();
  }

  paintScale() {
    const context = this.scale.getContext("2d");
    const image = context.createImageData(256, 1);
    for (let k = 0; k < 256; k++) image.data.set([...viridis(k / 255), 255], 4 * k);
    context.putImageData(image, 0, 0);
  }

  draw() {
    this.chart?.destroy();
    const { run, signal } = this.entries[Number(this.select.value)];
    const it = signal.spectrogram;
    this.picture = picture(it);
    const unit = prettyUnit(signal.unit);
    const level = 10 * Math.log10(it.brightest);
    const text = (value) => `${value.toFixed(0).replace("-", "−")} dB`;
    this.ends[0].textContent = Number.isFinite(level) ? text(level - DEPTH) : "–";
    this.ends[1].textContent = Number.isFinite(level) ? `${text(level)} and above, re 1 ${SPECTRA.density.unit(unit)}` : "constant";
    const chirp = run.guideway?.chirp;
    const [low, high] = timeAxis.limits ?? [it.from, it.to];
    const curves = [{ label: chirp ? "frequency of the chirp force" : "", x: [low, high], y: [null, null], colour: 1, dash: 0 }];
    if (chirp) {
      // within the run: the axis is that of the time histories
      const end = chirp.start + chirp.end_frequency;
      const times = [low, chirp.start, end, high].filter((x) => x >= low && x <= high).sort((a, b) => a - b);
      curves[0].x = times.filter((x, k) => k === 0 || x > times[k - 1]);
      curves[0].y = curves[0].x.map((x) => (x >= chirp.start && x <= end ? x - chirp.start : null));
    }
    this.chart = new Chart(this.place, {
      title: "", ylabel: "frequency (Hz)", axis: timeAxis, curves, timed: true, height: 340,
      levels: modeMarks(), yRange: [0, it.top], under: (plot) => this.paint(plot, it), plain: !chirp,
      read: (time, frequency) => this.read(it, time, frequency, level),
    });
  }

  /** The picture at its place in time and frequency. */
  paint(plot, it) {
    const columns = this.picture.width;
    const half = columns > 1 ? (it.to - it.from) / (columns - 1) / 2 : 0.5;
    const left = plot.valToPos(it.from - half, "x", true);
    const right = plot.valToPos(it.to + half, "x", true);
    const top = plot.valToPos(it.top, "y", true);
    const bottom = plot.valToPos(0, "y", true);
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.imageSmoothingEnabled = false;
    ctx.drawImage(this.picture, left, top, right - left, bottom - top);
    ctx.restore();
  }

  /** Level at a time and frequency, as text. */
  read(it, time, frequency, level) {
    const columns = this.picture.width;
    const column = Math.round((time - it.from) / ((it.to - it.from) / Math.max(columns - 1, 1)));
    const row = Math.floor((frequency / it.top) * it.rows);
    if (column < 0 || column >= columns || row < 0 || row >= it.rows || !Number.isFinite(level)) return "";
    const shade = arrays.get(it.shades)[row * columns + column];
    const value = level - DEPTH * (1 - shade / 255);
    return `${number(frequency, 4)} Hz: ${shade === 0 ? "≤ " : ""}${value.toFixed(1).replace("-", "−")} dB`;
  }
}

/** The shades as a canvas, with the lowest frequency at the bottom. */
function picture(it) {
  const shades = arrays.get(it.shades);
  const columns = shades.length / it.rows;
  const canvas = element("canvas", { width: columns, height: it.rows });
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, it.rows);
  const colours = Array.from({ length: 256 }, (_, k) => [...viridis(k / 255), 255]);
  for (let row = 0; row < it.rows; row++) {
    for (let column = 0; column < columns; column++) {
      image.data.set(colours[shades[row * columns + column]], 4 * ((it.rows - 1 - row) * columns + column));
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function spectrogramSection() {
  const entries = data.runs.flatMap((run) => run.signals.filter((signal) => signal.spectrogram).map((signal) => ({ run, signal })));
  if (entries.length === 0) return;
  const it = section("spectrogram", "Spectrogram", element("p", { class: "hint" }, "Power spectral density. The time histories share its time axis."));
  new SpectrogramView(it, entries);
}
