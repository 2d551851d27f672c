// The 3D view with its controls, played over time.
{
  const KEYS = "Space: play or stop · ← →: one frame, with Shift 1 s · Home, End · 1 to 5: cameras · drag: turn · wheel or two fingers: zoom · right button: move";
  // Sliders of factors hold the decimal logarithm.
  const DEFLECTION = { least: 1, most: 2000, start: 500 };
  const GAP = { least: 1, most: 20, start: 10 };
  const SPEED = { least: 0.001, most: 10 };
  // Initial size of the largest deflection in the drawing (m).
  const READABLE = 0.25;
  // Initial duration of playing a run (s), approximately.
  const PLEASANT = 20;
  // Duration of a period of a natural mode (s).
  const PERIOD = 2;
  const calm = matchMedia("(prefers-reduced-motion: reduce)");

  scenes.View = class {
    constructor(parent, run) {
      this.run = run;
      this.model = new scenes.Model(run.scene, (reference) => arrays.get(reference));
      this.scale = { deflection: this.readable(), gap: GAP.start };
      this.range = this.model.usualDeviation();
      this.playing = false;
      this.follow = true;
      this.through = false;
      this.camera = "quarter";
      this.model.seek(this.model.timeOfLargest());
      this.build(parent);
      this.ready = this.start();
    }

    // The factor, 1, 2 or 5 of a decade, that makes the deflection readable.
    readable() {
      const wanted = scenes.roundUp(READABLE / Math.max(this.model.largestDeflection(), 1e-6));
      return Math.min(Math.max(wanted, DEFLECTION.least), DEFLECTION.start);
    }

    // ---- elements ----

    build(parent) {
      this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-describedby": "view-keys" });
      this.tip = element("output", { class: "tip", "aria-live": "off" });
      this.stageBox = element("div", { class: "stage" }, this.canvas, this.legend(), this.tip);
      this.words = element("p", { class: "words", "aria-live": "polite" });
      this.note = element("div", { class: "missing" });
      this.box = element("div", { class: "view" }, this.cameras(), this.stageBox, this.player(), this.sliders(), this.words,
        element("p", { class: "hint", id: "view-keys" }, KEYS), this.note);
      parent.append(this.box);
      this.say();
      const { missing } = this.model.data;
      if (missing.length > 0) {
        this.note.append(element("details", {}, element("summary", {}, "What this view leaves out"),
          element("ul", {}, missing.map((text) => element("li", {}, text)))));
      }
    }

    cameras() {
      const buttons = Object.entries(scenes.VIEWS).map(([name, { label }]) => {
        const button = element("button", { type: "button", class: "chip", "data-camera": name, "aria-pressed": "false" }, label);
        button.addEventListener("click", () => this.look(name));
        return button;
      });
      this.cameraButtons = buttons;
      const option = (label, on, change) => {
        const box = element("input", { type: "checkbox" });
        box.checked = on;
        box.addEventListener("change", () => { change(box.checked); this.changed(); });
        return element("label", { class: "option" }, box, label);
      };
      return element("div", { class: "row", role: "group", "aria-label": "Camera" }, buttons,
        this.motions(),
        option("follow the train", this.follow, (on) => { this.follow = on; }),
        option("see-through cars", this.through, (on) => { this.through = on; this.stage?.seeThrough?.(on); }));
    }

    // The recorded motion, a mode of train and girders, or a natural mode of the empty girders.
    motions() {
      const { model } = this;
      const { coupled } = model.data;
      if (model.modeCount === 0 && coupled.length === 0) return null;
      const names = Array.from({ length: model.modeCount }, (_, k) => element("option", { value: k }, this.modeName(k)));
      const both = coupled.map((mode, k) => element("option", { value: `coupled ${k}` }, this.coupledName(mode)));
      const group = (label, options) => (options.length > 0 ? element("optgroup", { label }, options) : null);
      const select = element("select", { "aria-label": "Motion" }, element("option", { value: "" }, "recorded motion"),
        group("Coupled modes, least damped first", both), group("Empty girders", names));
      select.addEventListener("change", () => {
        const [, k] = select.value.match(/^coupled (\d+)$/) ?? [];
        model.coupled = k === undefined ? null : coupled[Number(k)];
        model.mode = k !== undefined || select.value === "" ? null : Number(select.value);
        model.phase = Math.PI / 2;
        // the modes are those at the start
        if (model.coupled !== null) this.seek(model.begin);
        // its colours have no unit
        this.stageBox.querySelector(".colours").style.display = model.coupled === null ? "" : "none";
        this.playing = false;
        this.say();
        this.changed();
      });
      return select;
    }

    coupledName({ frequency, damping, with: units }) {
      return `${number(frequency, 4)} Hz, ζ ${number(damping, 3)}${units.length > 0 ? `, ${units.join(" and ")}` : ""}`;
    }

    modeName(k) {
      const mode = this.run.guideway?.modes[k];
      return `girder mode ${k + 1}${mode ? `: ${number(mode.frequency, 4)} Hz${mode.damping == null ? "" : `, ζ ${number(mode.damping, 3)}`}` : ""}`;
    }

    legend() {
      const [unit, factor] = this.range < 5e-5 ? ["µm", 1e6] : ["mm", 1e3];
      const size = number(this.range * factor, 3);
      const bar = element("span", { class: "bar" });
      bar.style.background = scenes.gradient();
      return element("div", { class: "colours", role: "img", "aria-label": `Colours of the magnets: gap from ${size} ${unit} less to ${size} ${unit} more than the nominal ${number(this.model.data.nominal_gap * 1e3)} mm, blue to red` },
        element("span", { class: "what" }, `gap − ${number(this.model.data.nominal_gap * 1e3)} mm`), bar,
        element("span", { class: "ends" }, element("span", {}, `≤ −${size}`), element("span", {}, "0"), element("span", {}, `≥ ${size} ${unit}`)));
    }

    player() {
      const { model } = this;
      this.button = element("button", { type: "button", class: "action play" });
      this.button.addEventListener("click", () => this.play(!this.playing));
      this.slider = element("input", { type: "range", class: "time", min: model.begin, max: model.end, step: "any", "aria-label": "Time" });
      this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
      this.slider.addEventListener("keydown", (event) => this.key(event));
      this.clock = element("output", { class: "clock" });
      return element("div", { class: "row" }, this.button, this.slider, this.clock);
    }

    sliders() {
      const length = Math.max(this.model.end - this.model.begin, 1e-9);
      this.speed = Math.min(Math.max(scenes.roundUp(length / PLEASANT), SPEED.least), SPEED.most);
      const factor = (label, { least, most }, get, set) => {
        const value = element("output", { class: "value" });
        const input = element("input", { type: "range", min: Math.log10(least), max: Math.log10(most), step: "0.01", "aria-label": label });
        const show = () => {
          value.textContent = `× ${number(get(), 2)}`;
          input.setAttribute("aria-valuetext", `${number(get(), 2)} times`);
        };
        input.value = Math.log10(get());
        input.addEventListener("input", () => { set(10 ** Number(input.value)); show(); this.say(); this.changed(); });
        show();
        return element("label", { class: "factor" }, element("span", {}, label), input, value);
      };
      return element("div", { class: "row factors" },
        factor("Speed of time", SPEED, () => this.speed, (it) => { this.speed = it; }),
        factor("Exaggeration of deflection", DEFLECTION, () => this.scale.deflection, (it) => { this.scale.deflection = it; }),
        factor("Exaggeration of gaps", GAP, () => this.scale.gap, (it) => { this.scale.gap = it; }));
    }

    // Describes the exaggeration in words.
    say() {
      const { deflection, gap } = this.scale;
      const times = (factor) => (factor < 1.005 ? "true to scale" : `${number(factor, 2)} times too large`);
      const { mode, coupled } = this.model;
      if (coupled !== null) {
        this.words.textContent = `Mode of the train and the girders together, ${this.coupledName(coupled)}, as maglev modes found it at the start of the scenario; drawn once in ${PERIOD} s, without its growth or decay. The amplitude is arbitrary: as large as the exaggerated gaps allow. Colours: change of the gaps, relative to the largest.`;
        return;
      }
      if (mode !== null) {
        this.words.textContent = `Natural mode of the empty girders, ${this.modeName(mode)}, drawn once in ${PERIOD} s with an amplitude of ${number(this.model.amplitude() * 1e3, 3)} mm, ${times(deflection)}. The train stands where it was at the time of the slider and only follows the girders.`;
        return;
      }
      const rough = this.model.profiles.length > 0 ? ", the track's irregularity" : "";
      const twist = this.model.spans.some((span) => span.twist || span.lateral) ? " and twist" : "";
      this.words.textContent = `The girders' deflection${twist} ${twist ? "are" : "is"} drawn ${times(deflection)}; air gaps${rough} and the train's motion on the girders ${times(gap)}; everything else is to scale${this.model.course.straight ? "" : ", the line in plan and elevation and its cant too"}. Dashed: the rail without deflection and irregularity.`;
    }

    // ---- drawing ----

    async start() {
      try {
        const text = (reference) => new TextDecoder().decode(arrays.get(reference));
        if (!webGl()) throw new Error("this browser has no WebGL, or it is switched off");
        // once for all runs
        scenes.three ??= scenes.loadThree({ core: text(data.three.core), module: text(data.three.module), orbit: text(data.three.orbit) });
        const three = await scenes.three;
        if (this.gone) return;
        this.stage = new scenes.Stage(three, this.model, this.canvas);
        this.stage.controls.addEventListener("change", () => this.changed());
        this.stage.controls.addEventListener("start", () => this.press(null));
      } catch (error) {
        this.flat(error);
      }
      this.listen();
      this.repaint();
      this.resize();
      this.look(this.camera);
      this.refresh();
      this.box.dataset.ready = this.stage instanceof scenes.SideStage ? "flat" : "3d";
    }

    // Without WebGL: the side view, and the reason.
    flat(error) {
      const canvas = element("canvas", { tabindex: "0", role: "img", "aria-describedby": "view-keys" });
      this.canvas.replaceWith(canvas);
      this.canvas = canvas;
      this.stage = new scenes.SideStage(this.model, canvas);
      this.box.querySelectorAll("[data-camera]").forEach((button) => { button.hidden = true; });
      this.note.prepend(element("p", { class: "error", role: "status" }, `The 3D view cannot be drawn: ${error.message}. A side view replaces it.`));
    }

    listen() {
      const { canvas } = this;
      this.observer = new ResizeObserver(() => { this.resize(); this.refresh(); });
      this.observer.observe(this.stageBox);
      this.onTheme = () => { this.repaint(); this.changed(); };
      document.addEventListener("themechange", this.onTheme);
      this.onTime = (time) => this.seek(time, true);
      this.leave = timeline.subscribe(this.onTime);
      canvas.addEventListener("keydown", (event) => this.key(event));
      canvas.addEventListener("pointermove", (event) => this.point(event));
      canvas.addEventListener("pointerleave", () => { this.pointed = -1; this.tip.textContent = ""; });
    }

    destroy() {
      this.gone = true;
      this.playing = false;
      cancelAnimationFrame(this.asked);
      this.observer?.disconnect();
      this.leave?.();
      document.removeEventListener("themechange", this.onTheme);
      this.stage?.destroy?.();
      this.box.remove();
    }

    repaint() {
      this.stage.paint(theme.name() === "dark");
    }

    resize() {
      const { clientWidth, clientHeight } = this.stageBox;
      if (clientWidth > 0) this.stage.resize(clientWidth, clientHeight);
    }

    // Requests one redraw.
    changed() {
      if (this.gone) return;
      this.asked ??= requestAnimationFrame((now) => {
        this.asked = null;
        this.advance(now);
        this.refresh();
        if (this.playing) this.changed();
      });
    }

    refresh() {
      const { stage, model } = this;
      if (!stage) return;
      stage.update(this.scale, this.range, this.follow);
      stage.render();
      this.slider.value = model.frame.time;
      this.slider.setAttribute("aria-valuetext", `${number(model.frame.time, 6)} s`);
      this.clock.textContent = `${model.frame.time.toFixed(2)} s of ${number(model.end, 6)} s`;
      this.button.textContent = this.playing ? "❚❚ stop" : "▶ play";
      this.canvas.setAttribute("aria-label", this.spoken());
      this.showTip();
    }

    // The state in words.
    spoken() {
      const { model } = this;
      if (model.coupled !== null) return `The train and the girders in the coupled mode ${this.coupledName(model.coupled)}.`;
      if (model.mode !== null) return `The girders in ${this.modeName(model.mode)}.`;
      const worst = model.gaps.reduce((best, _, k) => (Math.abs(model.deviation(k) ?? 0) > Math.abs(model.deviation(best) ?? 0) ? k : best), 0);
      const gap = model.gaps[worst] ? ` Largest deviation of a gap: magnet ${worst + 1}, ${number(model.gap(worst) * 1e3, 4)} mm.` : "";
      const spans = model.spans.map((span, k) => `span ${k + 1} ${number(model.deflection((span.start + span.end) / 2) * 1e3, 3)} mm`).join(", ");
      return `The train on its girders at ${number(model.frame.time, 5)} s.${gap}${spans ? ` Mid-span deflection: ${spans}.` : ""}`;
    }

    // ---- time ----

    seek(time, told = false) {
      this.model.seek(time);
      if (!told) timeline.set(this.model.frame.time, this.onTime);
      this.changed();
    }

    play(on) {
      const { model } = this;
      if (on && !model.animated && model.frame.time >= model.end) this.seek(model.begin);
      this.playing = on;
      this.last = null;
      this.changed();
    }

    // While playing: advances by the wall time since the last drawing.
    advance(now) {
      if (!this.playing) return;
      const { model } = this;
      const passed = this.last == null ? 0 : Math.min(now - this.last, 250) / 1000;
      this.last = now;
      if (model.animated) {
        model.phase += (2 * Math.PI * passed) / PERIOD;
        return;
      }
      const time = model.frame.time + passed * this.speed;
      if (time >= model.end) this.playing = false;
      model.seek(time);
      timeline.set(model.frame.time, this.onTime);
    }

    // ---- interaction ----

    look(name) {
      if (!this.stage?.look) return;
      this.press(name);
      this.stage.glide(this.stage.look(name, this.scale), calm.matches ? 0 : 450, () => this.changed());
    }

    // Marks the button of the current camera; null after the reader has moved it.
    press(name) {
      this.camera = name;
      for (const button of this.cameraButtons) button.setAttribute("aria-pressed", String(button.dataset.camera === name));
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const { model } = this;
      const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      const camera = Object.keys(scenes.VIEWS)[Number(event.key) - 1];
      if (event.key === " ") this.play(!this.playing);
      else if (way) this.seek(event.shiftKey ? model.frame.time + way : model.neighbour(way));
      else if (event.key === "Home") this.seek(model.begin);
      else if (event.key === "End") this.seek(model.end);
      else if (camera) this.look(camera);
      else return;
      event.preventDefault();
    }

    // Names the magnet under the pointer.
    point(event) {
      const { left, top, width, height } = this.canvas.getBoundingClientRect();
      const [x, y] = [event.clientX - left, event.clientY - top];
      this.pointed = event.buttons === 0 && this.stage.pick ? this.stage.pick((2 * x) / width - 1, 1 - (2 * y) / height) : -1;
      this.tip.style.transform = `translate(${Math.min(x + 14, width - 190)}px, ${Math.max(y - 34, 4)}px)`;
      this.showTip();
    }

    showTip() {
      const k = this.pointed ?? -1;
      const { model } = this;
      this.tip.textContent = k < 0 ? "" : model.coupled !== null ? `magnet ${k + 1}` : model.gaps[k] ? `magnet ${k + 1}: gap ${number(model.gap(k) * 1e3, 4)} mm` : `magnet ${k + 1}: gap not recorded`;
    }
  };

  function webGl() {
    const canvas = document.createElement("canvas");
    return Boolean(canvas.getContext("webgl2"));
  }
}

/** The section with the 3D view of one run at a time. */
function sceneSection() {
  const runs = data.runs.filter((run) => run.scene);
  const failed = data.runs.filter((run) => run.scene_error);
  if (runs.length + failed.length === 0) return;
  const it = section("view", "The train on its girders");
  for (const run of failed) it.append(element("p", { class: "error", role: "status" }, `${runPrefix(run)}There is no 3D view: ${run.scene_error}.`));
  if (runs.length === 0) return;
  let view;
  const show = (run) => {
    view?.destroy();
    view = new scenes.View(it, run);
    // for tests
    it.view = view;
  };
  if (runs.length > 1) {
    const select = element("select", { "aria-label": "Run shown" }, runs.map((run, k) => element("option", { value: k }, run.name)));
    select.addEventListener("change", () => show(runs[Number(select.value)]));
    it.append(element("p", {}, "Run: ", select));
  }
  show(runs[0]);
}
