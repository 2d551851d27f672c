// A response surface of second degree: all factors, their squares and products.

/** Solves the normal equations of a least-squares fit by Gauss, with pivots; null if they are singular. */
function solve(matrix, right) {
  const n = right.length;
  const a = matrix.map((row, i) => [...row, right[i]]);
  for (let k = 0; k < n; k++) {
    let best = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(a[i][k]) > Math.abs(a[best][k])) best = i;
    if (!(Math.abs(a[best][k]) > 1e-9 * Math.max(...matrix.map((row, i) => Math.abs(row[i]))))) return null;
    [a[k], a[best]] = [a[best], a[k]];
    for (let i = k + 1; i < n; i++) {
      const factor = a[i][k] / a[k][k];
      for (let j = k; j <= n; j++) a[i][j] -= factor * a[k][j];
    }
  }
  const x = new Array(n).fill(0);
  for (let k = n - 1; k >= 0; k--) x[k] = (a[k][n] - a[k].slice(k + 1, n).reduce((sum, it, j) => sum + it * x[k + 1 + j], 0)) / a[k][k];
  return x;
}

/** Fits values at the rows; returns { at(row), explained, count } or null. Factors that do not vary are left out. */
function quadratic(rows, values) {
  const known = rows.map((_, k) => k).filter((k) => Number.isFinite(values[k]) && rows[k].every(Number.isFinite));
  const d = rows[0]?.length ?? 0;
  const ends = Array.from({ length: d }, (_, j) => [Math.min(...known.map((k) => rows[k][j])), Math.max(...known.map((k) => rows[k][j]))]);
  const varying = ends.map(([low, high], j) => (high > low ? j : -1)).filter((j) => j >= 0);
  const terms = (row) => {
    const u = varying.map((j) => (2 * (row[j] - ends[j][0])) / (ends[j][1] - ends[j][0]) - 1);
    const list = [1, ...u];
    for (let i = 0; i < u.length; i++) for (let j = i; j < u.length; j++) list.push(u[i] * u[j]);
    return list;
  };
  const n = 1 + varying.length + (varying.length * (varying.length + 1)) / 2;
  if (known.length < n + 2) return null;
  const matrix = Array.from({ length: n }, () => new Float64Array(n));
  const right = new Float64Array(n);
  for (const k of known) {
    const t = terms(rows[k]);
    for (let i = 0; i < n; i++) {
      right[i] += t[i] * values[k];
      for (let j = 0; j < n; j++) matrix[i][j] += t[i] * t[j];
    }
  }
  const coefficients = solve(matrix.map((row) => [...row]), [...right]);
  if (!coefficients) return null;
  const at = (row) => terms(row).reduce((sum, it, i) => sum + it * coefficients[i], 0);
  const mean = meanOf(known.map((k) => values[k]));
  const all = known.reduce((sum, k) => sum + (values[k] - mean) ** 2, 0);
  const rest = known.reduce((sum, k) => sum + (values[k] - at(rows[k])) ** 2, 0);
  return { at, explained: all > 0 ? 1 - rest / all : 0, count: known.length };
}
