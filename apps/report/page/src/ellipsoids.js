// Ellipsoids of covariances, as the columns of matrices that a unit sphere is drawn with.
import { along, cross, dot, eigen, median } from './linear.js';

const kFlat = 0.02; // thickness of the ellipse of a normal, of its longer axis
const kVisible = 5; // px, of the median's semi-axis by default
export const kMagnifications = [1, 2, 5, 10, 20, 50, 100];

// { centre, columns } of one sigma about the centre of a patch, m, or null.
export function centreEllipsoid(result, i) {
  const covariance = result.hasShape(i) ? result.centreCovarianceOf(i) : null;
  if (!covariance) return null;
  const principal = eigen(covariance);
  const radii = principal.map(({ value }) => Math.sqrt(Math.max(0, value)));
  const axes = principal.map(({ vector }) => vector);
  axes[2] = cross(axes[0], axes[1]);
  return { centre: result.centreOf(i), columns: axes.map((axis, k) => axis.map((x) => x * radii[k])) };
}

// The same about the tip of a normal of that length, m, in the plane at right angles to
// it: a small turn moves the tip by length times angle.
export function normalEllipsoid(result, i, length) {
  const normal = result.hasShape(i) ? result.normalOf(i) : null;
  if (!normal) return null;
  const { axes: [x, y, z], covariance } = normal;
  const columns = eigen(covariance).map(({ value, vector }) => {
    const sigma = length * Math.sqrt(Math.max(0, value));
    return along(x.map((c) => c * vector[0]), vector[1], y).map((c) => c * sigma);
  });
  columns.push(cross(...columns.map(unit)).map((c) => c * kFlat * Math.hypot(...columns[0])));
  return { centre: along(result.centreOf(i), length, z), columns };
}

function unit(v) {
  const size = Math.hypot(...v) || 1;
  return v.map((c) => c / size);
}

export const radiiOf = ({ columns }) => columns.map((column) => Math.hypot(...column));

// The longer semi-axis of how it looks from the eye, m: errors along the rays of a
// sensor, the largest of all, cannot be seen from where it stands.
export function apparentRadius({ centre, columns }, eye) {
  const ray = unit(along(centre, -1, eye));
  const across = columns.map((column) => along(column, -dot(column, ray), ray));
  const scatter = [0, 1, 2].map((i) =>
    [0, 1, 2].map((j) => across.reduce((sum, column) => sum + column[i] * column[j], 0)));
  return Math.sqrt(eigen(scatter)[0].value);
}

// The least magnification at which the median ellipsoid is visible from the eye.
// \param pixelsPerMetre where the patches are.
export function visibleMagnification(ellipsoids, eye, sigmas, pixelsPerMetre) {
  const radii = ellipsoids.filter(Boolean).map((ellipsoid) => apparentRadius(ellipsoid, eye));
  const size = sigmas * median(radii) * pixelsPerMetre;
  return kMagnifications.find((x) => x * size >= kVisible) ?? kMagnifications.at(-1);
}
