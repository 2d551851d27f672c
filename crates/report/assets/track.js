// The irregularity of the track: profile, and its density compared with the target.

function irregularitySection() {
  const runs = data.runs.filter((run) => run.irregularity);
  if (runs.length === 0) return;
  const it = section("irregularity", "Irregularity of the track");
  const distance = new Axis({ label: "position along the track (m)", format: (value) => `${number(value, 5)} m` });
  const wavenumber = new Axis({ label: "wavenumber Ω (rad/m)", log: true, format: (value) => `${number(value, 4)} rad/m, wave of ${number(2 * Math.PI / value, 3)} m` });
  const profiles = runs.map((run, r) => {
    const { start, step, heights } = run.irregularity;
    const y = arrays.get(heights).map((value) => 1e3 * value);
    return { label: runPrefix(run) + run.irregularity.signal, x: Float64Array.from(y, (_, k) => start + k * step), y, colour: r, dash: r };
  });
  new Chart(it, { title: "", ylabel: "irregularity (mm)", axis: distance, curves: profiles });
  const densities = runs.map((run, r) => ({
    label: `${runPrefix(run)}recorded`, x: arrays.get(run.irregularity.wavenumbers), y: arrays.get(run.irregularity.densities), colour: r, dash: r,
  }));
  const targets = new Map(runs.filter((run) => run.irregularity.target).map((run) => [JSON.stringify(run.irregularity.target), run.irregularity.target]));
  [...targets.values()].forEach((target, k) => {
    const ends = [2 * Math.PI / target.longest, 2 * Math.PI / target.shortest];
    const x = Float64Array.from({ length: 240 }, (_, j) => ends[0] * (ends[1] / ends[0]) ** (j / 239));
    const mean = target.pole > 0 ? `, mean over a pole of ${number(target.pole)} m` : "";
    densities.push({ label: `target A/Ω², A = ${number(target.amplitude)} m·rad${mean}`, x, y: x.map((omega) => targetDensity(target, omega)), colour: runs.length + k, dash: 1 });
  });
  // waves shorter than the target's are only leakage of the window
  const ends = [...targets.values()].map((target) => target.amplitude * (target.shortest / (2 * Math.PI)) ** 2);
  const low = ends.length > 0 ? Math.min(...ends) * 1e-2 : Math.min(...densities.map((curve) => curve.y.reduce((a, b) => Math.min(a, b > 0 ? b : a), Infinity)));
  new Chart(it, { title: "", ylabel: "PSD (m²/(rad/m))", axis: wavenumber, curves: densities, logY: true, lowest: low, height: 300 });
}

// The PSD that a magnet feels: of each wave its pole leaves sin(Ωℓ/2)/(Ωℓ/2).
function targetDensity({ amplitude, pole }, omega) {
  const half = omega * pole / 2;
  const remains = half > 0 ? Math.sin(half) / half : 1;
  return amplitude * (remains / omega) ** 2;
}
