// All patches as one mesh with ranges, and all lines as one.
import { along } from './linear.js';

const kAxisColors = [[0.84, 0.2, 0.18], [0.2, 0.62, 0.25], [0.2, 0.42, 0.9]];

// { positions, index, vertexStarts, indexStarts }: patch i has the vertices from
// vertexStarts[i] to that of the next, and the same of the index.
export function mergedPatches(result) {
  const { meshes, count } = result;
  const vertexStarts = new Uint32Array(count + 1);
  const indexStarts = new Uint32Array(count + 1);
  for (let i = 0; i < count; ++i) {
    vertexStarts[i + 1] = vertexStarts[i] + meshes.vertexCounts[i];
    indexStarts[i + 1] = indexStarts[i] + 3 * meshes.triangleCounts[i];
  }
  const positions = new Float32Array(3 * vertexStarts[count]);
  const index = new Uint32Array(indexStarts[count]);
  for (let i = 0; i < count; ++i) {
    const centre = result.centreOf(i);
    const step = meshes.reach[i] / 32767;
    for (let k = 3 * vertexStarts[i]; k < 3 * vertexStarts[i + 1]; ++k)
      positions[k] = centre[k % 3] + step * meshes.vertices[k];
    for (let k = indexStarts[i]; k < indexStarts[i + 1]; ++k)
      index[k] = vertexStarts[i] + meshes.triangles[k];
  }
  return { positions, index, vertexStarts, indexStarts };
}

// The index of the visible patches alone.
export function visibleIndex({ index, indexStarts }, visible) {
  const parts = visible.flatMap((isVisible, i) =>
    (isVisible ? [index.subarray(indexStarts[i], indexStarts[i + 1])] : []));
  const all = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

// The patch that a vertex belongs to.
export function patchOfVertex(vertexStarts, vertex) {
  let low = 0;
  let high = vertexStarts.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (vertexStarts[middle] <= vertex) low = middle;
    else high = middle;
  }
  return low;
}

// All soles as one mesh: { positions, colors, starts, triangles(k) }, fans about their
// middles; sole k has the vertices from starts[k].
export function mergedSoles({ soles, count }, soleColors) {
  const size = count ? soles[0].corners.length : 0;
  const positions = new Float32Array(soles.flatMap(({ middle, corners }) => [middle, ...corners].flat()));
  const colors = new Float32Array(soleColors.flatMap((color) => new Array(size + 1).fill(color).flat()));
  const starts = soles.map((_, k) => k * (size + 1));
  const triangles = (k) => Array.from({ length: size }, (_, c) =>
    [starts[k], starts[k] + 1 + c, starts[k] + 1 + ((c + 1) % size)]).flat();
  return { positions, colors, starts, triangles };
}

// Segments with colours.
export class Lines {
  constructor() {
    this.positions = [];
    this.colors = [];
  }

  add(from, to, color) {
    this.positions.push(...from, ...to);
    this.colors.push(...color, ...color);
  }

  addFrame(origin, axes, length) {
    axes.forEach((axis, k) => this.add(origin, along(origin, length, axis), kAxisColors[k]));
  }

  // Edges, and a line to the toe.
  addSole({ corners, middle, toe }, color) {
    corners.forEach((corner, c) => this.add(corner, corners[(c + 1) % corners.length], color));
    this.add(middle, toe, color);
  }

  // The first vertices of a patch are those of its outline.
  addOutline(patches, meshes, i, color) {
    const first = patches.vertexStarts[i];
    const count = meshes.outlineCounts[i];
    const point = (k) => {
      const at = 3 * (first + (k % count));
      return patches.positions.subarray(at, at + 3);
    };
    for (let k = 0; k < count; ++k) this.add(point(k), point(k + 1), color);
  }
}
