// Small symmetric matrices and rotations. Matrices are arrays of rows.

// The full matrix of an upper triangle, row by row.
export function symmetric(upper, n) {
  const matrix = Array.from({ length: n }, () => new Array(n));
  let at = 0;
  for (let i = 0; i < n; ++i)
    for (let j = i; j < n; ++j) matrix[i][j] = matrix[j][i] = upper[at++];
  return matrix;
}

export function block(matrix, first, count) {
  return matrix.slice(first, first + count).map((row) => row.slice(first, first + count));
}

export const isFinite2 = (matrix) => matrix.every((row) => row.every(Number.isFinite));

// One of Jacobi's rotations, which makes a[p][q] zero; v collects them.
function rotate(a, v, p, q) {
  const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
  const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
  const c = 1 / Math.sqrt(t * t + 1);
  const s = t * c;
  const turn = (m, i, j) => {
    const x = m[i][p];
    m[i][p] = c * x - s * m[i][q];
    m[i][q] = s * x + c * m[i][q];
  };
  for (let i = 0; i < a.length; ++i) turn(a, i);
  for (let i = 0; i < a.length; ++i) {
    const x = a[p][i];
    a[p][i] = c * x - s * a[q][i];
    a[q][i] = s * x + c * a[q][i];
  }
  for (let i = 0; i < v.length; ++i) turn(v, i);
}

// Eigenvalues, largest first, with unit vectors: [{ value, vector }].
export function eigen(matrix) {
  const n = matrix.length;
  const a = matrix.map((row) => row.slice());
  const v = a.map((_, i) => a.map((__, j) => (i === j ? 1 : 0)));
  const scale = Math.max(...a.map((row, i) => Math.abs(row[i])), Number.MIN_VALUE);
  for (let sweep = 0; sweep < 50; ++sweep) {
    let rest = 0;
    for (let p = 0; p < n; ++p)
      for (let q = p + 1; q < n; ++q) {
        rest = Math.max(rest, Math.abs(a[p][q]));
        if (Math.abs(a[p][q]) > 1e-16 * scale) rotate(a, v, p, q);
      }
    if (rest <= 1e-15 * scale) break;
  }
  return a
    .map((row, i) => ({ value: row[i], vector: v.map((r) => r[i]) }))
    .sort((x, y) => y.value - x.value);
}

// Columns of the rotation of a quaternion x y z w.
export function axesOf(q, at = 0) {
  const [x, y, z, w] = [q[at], q[at + 1], q[at + 2], q[at + 3]];
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
}

// a + s b
export const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export function quantile(values, share) {
  const sorted = Array.from(values).filter(Number.isFinite).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.round(share * (sorted.length - 1))] : NaN;
}

export const median = (values) => quantile(values, 0.5);
