// What the numbers of patches are called and in which unit people read them.

const kDegree = 180 / Math.PI;

// Columns of the data by name; those that are not here are shown as they are.
const kKnown = {
  points: { label: 'points', digits: 0 },
  chi2_per_dof: { label: 'chi2/dof' },
  sigma_centre: { label: 'sigma centre', unit: 'mm', scale: 1e3 },
  sigma_normal: { label: 'sigma normal', unit: '\u00b0', scale: kDegree },
  area: { label: 'area', unit: 'cm\u00b2', scale: 1e4 },
  radius: { label: 'radius', unit: 'mm', scale: 1e3 },
  coverage: { label: 'coverage', unit: '%', scale: 100 },
  residual_rms: { label: 'residual rms', unit: 'mm', scale: 1e3 },
  residual_largest: { label: 'residual largest', unit: 'mm', scale: 1e3 },
  residual_unexplained: { label: 'residual unexplained', unit: 'mm', scale: 1e3 },
  extent: { label: 'extent', unit: 'mm', scale: 1e3 },
  sagitta: { label: 'sagitta', unit: 'mm', scale: 1e3 },
  noise: { label: 'noise', unit: 'mm', scale: 1e3 },
  curvature: { label: 'curvature', unit: '1/m' },
  view_angle: { label: 'view angle', unit: '\u00b0', scale: kDegree },
  stray: { label: 'stray', unit: '%', scale: 100 },
  roughness: { label: 'roughness', unit: 'mm', scale: 1e3 },
  risk: { label: 'risk', unit: '%', scale: 100 },
  second_attempt: { label: 'second attempt', digits: 0 },
};

// In this order in the table; the rest is shown beside a selected patch.
const kTable = [
  'points', 'chi2_per_dof', 'sigma_centre', 'sigma_normal', 'risk', 'area', 'radius',
  'coverage', 'residual_rms', 'curvature', 'views', 'independent_views', 'conflicts',
];

// Those that colours can show, and histograms.
export const kColoring = ['sigma_centre', 'sigma_normal', 'chi2_per_dof', 'risk'];

// Of footholds, in this order in their table.
const kFootholds = {
  total: { label: 'total', unit: '%', scale: 100 },
  joint: { label: 'joint', unit: '%', scale: 100 },
  slip: { label: 'slip', unit: '%', scale: 100 },
  height: { label: 'height', unit: '%', scale: 100 },
  tilt: { label: 'tilt', unit: '%', scale: 100 },
  gap: { label: 'gap', unit: '%', scale: 100 },
  support: { label: 'support', unit: '%', scale: 100 },
  cvar_gap: { label: 'worst gaps', unit: 'mm', scale: 1e3 },
  contact_area: { label: 'contact', unit: 'cm\u00b2', scale: 1e4 },
  support_share: { label: 'sole on seen', unit: '%', scale: 100 },
  yaw: { label: 'yaw', unit: '\u00b0', scale: kDegree },
  views: { label: 'views', digits: 0 },
};

export function format(value, digits) {
  if (!Number.isFinite(value)) return '\u2013';
  if (digits !== undefined) return value.toFixed(digits);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(2);
  return Number(value.toPrecision(size >= 1e3 ? 6 : 4)).toString();
}

// Probabilities so small are nobody's to know.
const kLeastPercent = 1e-3;

function textOf(value, unit, digits) {
  return unit === '%' && value > 0 && value < kLeastPercent
    ? `< ${kLeastPercent}` : format(value, digits);
}

// { name, label, unit, heading, value(i), text(i) }, value in the unit.
function measureOf(columns, name, known) {
  const label = known.label ?? name.replaceAll('_', ' ');
  const scale = known.scale ?? 1;
  const whole = columns[name].every((x) => !Number.isFinite(x) || Number.isInteger(x));
  const digits = known.digits ?? (whole && scale === 1 ? 0 : undefined);
  const unit = known.unit ?? '';
  const value = (i) => columns[name][i] * scale;
  return {
    name,
    label,
    unit,
    heading: unit ? `${label} (${unit})` : label,
    value,
    text: (i) => textOf(value(i), unit, digits),
  };
}

const measure = (result, name) => measureOf(result.columns, name, kKnown[name] ?? {});

export const footholdMeasures = ({ columns }) =>
  Object.entries(kFootholds).map(([name, known]) => measureOf(columns, name, known));

export const tableMeasures = (result) =>
  kTable.filter((name) => name in result.columns).map((name) => measure(result, name));

export const allMeasures = (result) =>
  Object.keys(result.columns).map((name) => measure(result, name));

export const coloringMeasures = (result) =>
  kColoring.filter((name) => name in result.columns).map((name) => measure(result, name));

// [reason, number] of the patches that are no footholds.
export const leftOutOf = (risk) => Object.entries(risk?.head.ranking ?? {}).filter(([name, n]) =>
  !['candidates', 'footholds', 'widest_support_m'].includes(name) && n > 0);

export const spaced = (name) => name.replaceAll('_', ' ');
