// Lines of equal value on a grid of nodes.

/** Lines where a table over nodes xs × ys has a value: [[[x, y], [x, y]], …], by marching squares. NaN cuts lines. */
function contour(xs, ys, at, level) {
  const segments = [];
  const cut = (a, b, va, vb) => {
    const part = (level - va) / (vb - va);
    return [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])];
  };
  for (let i = 0; i + 1 < xs.length; i++) {
    for (let j = 0; j + 1 < ys.length; j++) {
      const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
      const places = corners.map(([a, b]) => [xs[a], ys[b]]);
      const values = corners.map(([a, b]) => at(a, b));
      if (!values.every(Number.isFinite)) continue;
      const ends = [];
      for (let k = 0; k < 4; k++) {
        const n = (k + 1) % 4;
        if ((values[k] < level) !== (values[n] < level)) ends.push(cut(places[k], places[n], values[k], values[n]));
      }
      if (ends.length === 2) segments.push(ends);
      if (ends.length === 4) {
        // a saddle: the mean in the middle decides
        const high = values.reduce((sum, it) => sum + it, 0) / 4 >= level;
        const first = values[0] >= level;
        segments.push(...(high === first ? [[ends[0], ends[1]], [ends[2], ends[3]]] : [[ends[3], ends[0]], [ends[1], ends[2]]]));
      }
    }
  }
  return segments;
}

/** Round values between two limits. */
function roundLevels(low, high, most = 8) {
  return ticksOfAxis({ low, high }, most).map(([value]) => value).filter((value) => value > low && value < high);
}
