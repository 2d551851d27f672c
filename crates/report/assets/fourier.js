// Spectra of a part of a recorded signal, as crates/analysis computes those of the whole signal.

/** Fourier transform in place of a length that is a power of two. */
function transform(real, imaginary, inverse = false) {
  const n = real.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [real[i], real[j]] = [real[j], real[i]];
      [imaginary[i], imaginary[j]] = [imaginary[j], imaginary[i]];
    }
  }
  const turn = (inverse ? 2 : -2) * Math.PI;
  const cosines = Float64Array.from({ length: n / 2 }, (_, k) => Math.cos((turn * k) / n));
  const sines = Float64Array.from({ length: n / 2 }, (_, k) => Math.sin((turn * k) / n));
  for (let size = 2; size <= n; size *= 2) {
    const [half, stride] = [size / 2, n / size];
    for (let start = 0; start < n; start += size) {
      for (let k = 0; k < half; k++) {
        const [a, b] = [start + k, start + k + half];
        const [c, s] = [cosines[k * stride], sines[k * stride]];
        const [x, y] = [real[b] * c - imaginary[b] * s, real[b] * s + imaginary[b] * c];
        real[b] = real[a] - x;
        imaginary[b] = imaginary[a] - y;
        real[a] += x;
        imaginary[a] += y;
      }
    }
  }
}

/** |X_k|² of real values, k = 0 … N/2, for any N: Bluestein's convolution with a chirp. */
function power(values) {
  const n = values.length;
  let m = 1;
  while (m < 2 * n) m *= 2;
  // k² mod 2n keeps the angle exact
  const angle = (k) => (Math.PI * ((k * k) % (2 * n))) / n;
  const [ar, ai, br, bi] = Array.from({ length: 4 }, () => new Float64Array(m));
  for (let k = 0; k < n; k++) {
    const [c, s] = [Math.cos(angle(k)), Math.sin(angle(k))];
    ar[k] = values[k] * c;
    ai[k] = -values[k] * s;
    br[k] = c;
    bi[k] = s;
    if (k > 0) [br[m - k], bi[m - k]] = [c, s];
  }
  transform(ar, ai);
  transform(br, bi);
  for (let k = 0; k < m; k++) [ar[k], ai[k]] = [ar[k] * br[k] - ai[k] * bi[k], ar[k] * bi[k] + ai[k] * br[k]];
  transform(ar, ai, true);
  return Float64Array.from({ length: Math.floor(n / 2) + 1 }, (_, k) => (ar[k] ** 2 + ai[k] ** 2) / (m * m));
}

/** A piece without its mean through a Hann window: { bins: |X_k|², sum: Σw, square: Σw², mean }. */
function windowed(piece) {
  const n = piece.length;
  const mean = piece.reduce((sum, value) => sum + value, 0) / n;
  const weights = Float64Array.from({ length: n }, (_, k) => 0.5 - 0.5 * Math.cos((2 * Math.PI * k) / n));
  const bins = power(weights.map((weight, k) => weight * (piece[k] - mean)));
  return { bins, mean, sum: weights.reduce((a, b) => a + b, 0), square: weights.reduce((a, b) => a + b * b, 0) };
}

/** 2 for bins that stand for a positive and a negative frequency, 1 for the ends. */
function sides(k, n) {
  return k === 0 || 2 * k === n ? 1 : 2;
}

/** Fewest samples that have a spectrum. */
const FEWEST = 16;

/** The spectrum of a part of a signal without its first bin: { x, y, resolution }. */
function partialSpectrum(values, rate, kind) {
  const n = values.length;
  if (kind === "amplitude") {
    const { bins, sum } = windowed(values);
    const y = bins.map((value, k) => (sides(k, n) * Math.sqrt(value)) / sum);
    return { x: y.map((_, k) => (k * rate) / n).slice(1), y: y.slice(1), resolution: rate / n };
  }
  // Welch: segments of a quarter that overlap by half
  const length = Math.max(Math.floor(n / 4), 8);
  const step = length - Math.floor(length / 2);
  const total = new Float64Array(Math.floor(length / 2) + 1);
  let count = 0;
  for (let start = 0; start + length <= n; start += step, count++) {
    const { bins, square } = windowed(values.slice(start, start + length));
    bins.forEach((value, k) => { total[k] += (sides(k, length) * value) / (rate * square); });
  }
  const y = total.map((value) => value / count);
  return { x: y.map((_, k) => (k * rate) / length).slice(1), y: y.slice(1), resolution: rate / length };
}

/** Peaks of a spectrum that exceed both valleys by 6 dB, the six highest by frequency: [{ frequency, value }]. */
function spectrumPeaks({ x, y, resolution }, kind, floor) {
  const factor = kind === "density" ? 4 : 2;
  const valley = (k, way) => {
    let lowest = y[k];
    for (let i = k + way; i >= 0 && i < y.length && y[i] <= y[k]; i += way) lowest = Math.min(lowest, y[i]);
    return lowest;
  };
  const found = [];
  for (let k = 2; k + 1 < y.length; k++) {
    if (y[k] < floor || y[k] <= y[k - 1] || y[k] < y[k + 1] || y[k] <= factor * Math.max(valley(k, -1), valley(k, 1))) continue;
    const [a, b, c] = [y[k - 1], y[k], y[k + 1]].map((value) => Math.log(Math.max(value, Number.MIN_VALUE)));
    const bend = a - 2 * b + c;
    const off = bend < 0 ? (0.5 * (a - c)) / bend : 0;
    found.push({ frequency: x[k] + off * resolution, value: Math.exp(b - 0.25 * (a - c) * off), damping: null });
  }
  return found.sort((a, b) => b.value - a.value).slice(0, 6).sort((a, b) => a.frequency - b.frequency);
}
