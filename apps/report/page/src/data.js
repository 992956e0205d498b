// What the program put into the page (apps/report/page_data.cpp), as objects.
import { unzlibSync } from 'fflate';
import { axesOf, block, isFinite2, symmetric } from './linear.js';

const kTypes = {
  float32: Float32Array,
  int16: Int16Array,
  uint16: Uint16Array,
  uint8: Uint8Array,
};

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// Bytes are sorted by their place in a number.
function arrayAt(bytes, { type, offset, length }) {
  const array = new kTypes[type](length);
  const size = array.BYTES_PER_ELEMENT;
  const out = new Uint8Array(array.buffer);
  for (let k = 0; k < size; ++k)
    for (let i = 0; i < length; ++i) out[i * size + k] = bytes[offset + k * length + i];
  return array;
}

// Every description of an array in a tree, replaced by the array.
function unpacked(bytes, tree) {
  if ('type' in tree && 'offset' in tree && 'length' in tree) return arrayAt(bytes, tree);
  const result = {};
  for (const [name, value] of Object.entries(tree))
    result[name] = value && typeof value === 'object' ? unpacked(bytes, value) : value;
  return result;
}

// Where each patch's numbers begin, when it has size(i) of them.
function starts(count, size) {
  const at = new Uint32Array(count + 1);
  for (let i = 0; i < count; ++i) at[i + 1] = at[i] + size(i);
  return at;
}

const triangle = (n) => (n * (n + 1)) / 2;

// What `holdfast risk` has found: of each patch, and of footholds, best first.
export class Risk {
  constructor({ head, statusNames, footholds, corners, ...arrays }, bytes) {
    const { statuses, rows, soles, columns } = unpacked(bytes, arrays);
    Object.assign(this, { head, columns, rows });
    this.count = footholds;
    this.statusOf = (i) => statusNames[statuses[i]];
    const point = (at) => Array.from(soles.subarray(3 * at, 3 * at + 3));
    // Of each foothold, m, in the frame of the cloud's points.
    this.soles = Array.from({ length: footholds }, (_, k) => {
      const first = k * (corners + 2);
      return {
        corners: Array.from({ length: corners }, (__, c) => point(first + c)),
        middle: point(first + corners),
        toe: point(first + corners + 1),
      };
    });
  }

  // Foothold k is on this patch.
  patchOf(k) {
    return this.rows[k];
  }

  // Null where there is none.
  footholdOn(i) {
    const k = this.rows.indexOf(i);
    return k < 0 ? null : k;
  }
}

export class Result {
  constructor(json, bytes, names) {
    this.title = json.title;
    this.source = json.source;
    this.isMap = json.isMap;
    this.hasFits = json.hasFits; // else of the patches no more than shapes is known
    this.head = json.head;
    this.offset = json.offset;
    this.count = json.patches;
    this.view = json.view;
    this.names = names;
    this.kinds = unpacked(bytes, json.kinds);
    this.columns = unpacked(bytes, json.columns);
    this.meshes = unpacked(bytes, json.meshes);
    this.cloud = unpacked(bytes, json.cloud);
    this.estimates = unpacked(bytes, json.estimates);
    this.risk = json.risk ? new Risk(json.risk, bytes) : null;
    const type = (i) => this.typeOf(i);
    this.parameterStarts = starts(this.count, (i) => type(i).parameters.length);
    this.stateStarts = starts(this.count, (i) => type(i).state.length);
    this.parameterTriangles = starts(this.count, (i) => triangle(type(i).parameters.length));
    this.stateTriangles = starts(this.count, (i) => triangle(type(i).state.length));
  }

  typeOf(i) {
    return this.names.types[this.kinds.types[i]];
  }

  hasShape(i) {
    return this.meshes.vertexCounts[i] > 0;
  }

  // Null where there is no fit to have one.
  statusOf(i) {
    if (!this.hasFits) return null;
    return this.names.statuses[this.kinds.statuses[i]];
  }

  verdictOf(i) {
    const verdict = this.kinds.verdicts[i];
    return verdict === 255 ? null : this.names.verdicts[verdict];
  }

  flagsOf(i) {
    return this.names.flags.filter((_, bit) => this.kinds.flags[i] & (1 << bit));
  }

  parametersOf(i) {
    return this.estimates.parameters.subarray(this.parameterStarts[i], this.parameterStarts[i + 1]);
  }

  stateOf(i) {
    return this.estimates.states.subarray(this.stateStarts[i], this.stateStarts[i + 1]);
  }

  parameterCovarianceOf(i) {
    return symmetric(
      this.estimates.parameterCovariances.subarray(this.parameterTriangles[i]),
      this.typeOf(i).parameters.length,
    );
  }

  stateCovarianceOf(i) {
    return symmetric(
      this.estimates.stateCovariances.subarray(this.stateTriangles[i]),
      this.typeOf(i).state.length,
    );
  }

  // All that is said of a patch in words.
  wordsOf(i) {
    const contact = this.risk?.statusOf(i);
    return [this.statusOf(i), this.verdictOf(i), ...this.flagsOf(i), contact === 'ok' ? null : contact]
      .filter(Boolean);
  }

  // In the frame of the cloud's points, m.
  centreOf(i) {
    const parameters = this.parametersOf(i);
    return Array.from(parameters.subarray(parameters.length - 3));
  }

  axesOf(i) {
    return axesOf(this.estimates.turns, 4 * i);
  }

  // Null where it is not known.
  centreCovarianceOf(i) {
    const { layout } = this.typeOf(i);
    const covariance = block(this.stateCovarianceOf(i), layout.c, 3);
    return isFinite2(covariance) ? covariance : null;
  }

  // Of the tip of the unit normal, in the axes x and y of the frame, rad^2. A turn nu
  // about these axes moves the tip by (nu_y, -nu_x).
  normalOf(i) {
    const { layout } = this.typeOf(i);
    const nu = block(this.stateCovarianceOf(i), layout.nu, 2);
    if (!isFinite2(nu)) return null;
    const axes = axesOf(this.estimates.stateTurns, 4 * i);
    return { axes, covariance: [[nu[1][1], -nu[0][1]], [-nu[0][1], nu[0][0]]] };
  }
}

export function readData(text) {
  const json = JSON.parse(text);
  const bytes = unzlibSync(bytesOf(json.binary));
  const { version, types, statuses, verdicts, flags, riskScale } = json;
  const names = { types, statuses, verdicts, flags, riskScale };
  return { version, results: json.results.map((result) => new Result(result, bytes, names)) };
}
