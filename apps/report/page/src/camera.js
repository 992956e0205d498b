// From where the view first looks.
import { along, cross, dot, median, quantile } from './linear.js';

const kMargin = 1.06;

// Of points, every n-th: a few thousand are enough to frame them.
function sample(positions) {
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 4000));
  const points = [];
  for (let k = 0; k < positions.length; k += step)
    points.push([positions[k], positions[k + 1], positions[k + 2]]);
  return points;
}

// As the sensor saw the points: its place, and as narrow a view as shows nearly all.
function fromSensor(view, points, aspect) {
  const { eye, forward, right } = view;
  const down = cross(forward, right);
  const seen = points
    .map((p) => along(p, -1, eye))
    .map((q) => [dot(q, right), dot(q, down), dot(q, forward)])
    .filter(([, , z]) => z > 0);
  const range = (values) => [quantile(values, 0.01), quantile(values, 0.99)];
  const [left, end] = range(seen.map(([x, , z]) => x / z));
  const [top, bottom] = range(seen.map(([, y, z]) => y / z));
  const depth = median(seen.map(([, , z]) => z));
  const ray = along(along(forward, (left + end) / 2, right), (top + bottom) / 2, down);
  const half = kMargin * Math.max((bottom - top) / 2, (end - left) / 2 / aspect);
  return { eye, target: along(eye, depth, ray), half };
}

function fromAside(view, points) {
  const middle = [0, 1, 2].map((k) =>
    (quantile(points.map((p) => p[k]), 0.02) + quantile(points.map((p) => p[k]), 0.98)) / 2);
  const radius = quantile(points.map((p) => Math.hypot(...along(p, -1, middle))), 0.98) || 1;
  return { eye: along(middle, 2.8 * radius, view.aside), target: middle, half: 0.36 };
}

// { eye, target, fov in degrees, depth }.
export function firstView(view, positions, aspect) {
  const points = sample(positions);
  const { eye, target, half } = view.seen && points.length
    ? fromSensor(view, points, aspect)
    : fromAside(view, points.length ? points : [[0, 0, 0]]);
  const fov = (2 * Math.atan(half) * 180) / Math.PI;
  return {
    eye,
    target,
    fov: Math.min(100, Math.max(5, fov)),
    depth: Math.hypot(...along(target, -1, eye)),
  };
}
