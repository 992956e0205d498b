// Everything about one patch: numbers, covariance as a matrix and as principal sigmas.
import { el, swatch } from './dom.js';
import { block, eigen, isFinite2 } from './linear.js';
import { allMeasures, format, spaced } from './measures.js';

const kDegree = 180 / Math.PI;

// Of a parameter or a coordinate of the state, by its name.
function unitOf(name) {
  if (name.startsWith('M')) return 'm\u00b2';
  if (/^(k|kappa)(_|$)/.test(name)) return '1/m';
  if (/^(nu|r|gamma)(_|$)/.test(name)) return 'rad';
  return 'm';
}

// Groups of the state's coordinates, each with one unit.
function groupsOf(type) {
  const { k, nu, c } = type.layout;
  return [
    { title: 'centre', first: c, count: 3, scale: 1e3, unit: 'mm' },
    { title: 'normal', first: nu, count: 2, scale: kDegree, unit: '\u00b0' },
    { title: 'curvature', first: k, count: nu - k, scale: 1, unit: '1/m' },
    { title: 'moments', first: 0, count: k, scale: 1e4, unit: 'cm\u00b2' },
  ].filter((group) => group.count > 0);
}

// "0.94 c_z - 0.33 c_x": what a principal direction is made of.
function direction(vector, names) {
  const sign = vector.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a)) < 0 ? -1 : 1;
  return vector
    .map((x, i) => ({ x: sign * x, name: names[i] }))
    .filter(({ x }) => Math.abs(x) >= 0.05)
    .sort((a, b) => Math.abs(b.x) - Math.abs(a.x))
    .map(({ x, name }, i) => {
      const size = Math.abs(x) > 0.995 ? '' : `${Math.abs(x).toFixed(2)} `;
      return (x < 0 ? (i ? ' \u2212 ' : '\u2212') : i ? ' + ' : '') + size + name;
    })
    .join('');
}

export function principalSigmas(result, i) {
  const type = result.typeOf(i);
  const covariance = result.stateCovarianceOf(i);
  return groupsOf(type).flatMap(({ title, first, count, scale, unit }) => {
    const part = block(covariance, first, count);
    if (!isFinite2(part)) return [];
    const names = type.state.slice(first, first + count);
    return eigen(part).map(({ value, vector }) => ({
      group: title,
      sigma: Math.sqrt(Math.max(0, value)) * scale,
      unit,
      direction: direction(vector, names),
    }));
  });
}

function valueTable(caption, names, values, covariance, add) {
  const rows = names.map((name, k) => el('tr', {},
    el('th', { class: 'word', scope: 'row' }, name),
    el('td', {}, format(values[k] + (add?.(name) ?? 0))),
    el('td', {}, format(Math.sqrt(covariance[k][k]))),
    el('td', { class: 'word' }, unitOf(name))));
  const heads = [['', 'word'], ['value', ''], ['sigma', ''], ['', 'word']];
  return [el('h3', {}, caption), el('table', {},
    el('thead', {}, el('tr', {}, heads.map(([text, cls]) => el('th', { scope: 'col', class: cls }, text)))),
    el('tbody', {}, rows))];
}

function sigmaTable(result, i) {
  const sigmas = principalSigmas(result, i);
  if (sigmas.length === 0) return [];
  const rows = sigmas.map((s, k) => el('tr', {},
    el('th', { class: 'word', scope: 'row' }, sigmas[k - 1]?.group === s.group ? '' : s.group),
    el('td', {}, `${format(s.sigma)} ${s.unit}`),
    el('td', { class: 'word' }, `along ${s.direction}`)));
  return [el('h3', {}, 'Principal sigmas'), el('table', {}, el('tbody', {}, rows))];
}

function matrixTable(names, matrix, asCorrelation) {
  const sigma = names.map((_, k) => Math.sqrt(matrix[k][k]));
  const entry = (r, c) => (asCorrelation
    ? format(matrix[r][c] / (sigma[r] * sigma[c]), 2)
    : Number.isFinite(matrix[r][c]) ? matrix[r][c].toExponential(1) : '\u2013');
  const head = el('tr', {}, el('td', {}), names.map((name) => el('th', { scope: 'col' }, name)));
  const rows = names.map((name, r) => el('tr', {},
    el('th', { class: 'word', scope: 'row' }, name),
    names.map((_, c) => el('td', {}, entry(r, c)))));
  return el('table', {}, el('thead', {}, head), el('tbody', {}, rows));
}

// Which covariance, and whether as correlations; kept from patch to patch.
const chosen = { of: 'state', as: 'covariance' };

function matrixPart(result, i) {
  const type = result.typeOf(i);
  const holder = el('div', { class: 'matrix', tabIndex: 0, role: 'region', 'aria-label': 'Covariance matrix' });
  const update = () => {
    const isState = chosen.of === 'state';
    holder.replaceChildren(matrixTable(
      isState ? type.state : type.parameters,
      isState ? result.stateCovarianceOf(i) : result.parameterCovarianceOf(i),
      chosen.as === 'correlation',
    ));
  };
  const choice = (key, label, words) => el('select', {
    'aria-label': label,
    onchange: (event) => {
      chosen[key] = event.target.value;
      update();
    },
  }, words.map((word) => el('option', { value: word, selected: chosen[key] === word }, word)));
  update();
  return [el('h3', {}, 'Covariance'), el('p', { class: 'row quiet' },
    choice('as', 'Covariance or correlation', ['covariance', 'correlation']), 'of the',
    choice('of', 'State or parameters', ['state', 'parameters']), 'in m, rad, 1/m'), holder];
}

function contactWords(risk, i) {
  const k = risk.footholdOn(i);
  const foothold = k === null ? 'none' : `number ${k + 1} of ${risk.count}`;
  return [['contact', spaced(risk.statusOf(i))], ['foothold', foothold]];
}

// Tables of numbers with their sigmas; without a fit there are no sigmas, and no state.
function estimates(result, i) {
  const type = result.typeOf(i);
  const axis = { c_x: 0, c_y: 1, c_z: 2 };
  const offset = (name) => (name in axis ? result.offset[axis[name]] : 0);
  const parameters = valueTable('Parameters', type.parameters, result.parametersOf(i),
    result.parameterCovarianceOf(i), offset);
  if (!result.hasFits) return result.hasShape(i) ? parameters : [];
  return [...sigmaTable(result, i), ...parameters,
    ...valueTable('State', type.state, result.stateOf(i), result.stateCovarianceOf(i), offset),
    ...matrixPart(result, i)];
}

function facts(result, i) {
  const words = result.hasFits ? [['status', spaced(result.statusOf(i))]] : [];
  if (result.risk) words.push(...contactWords(result.risk, i));
  if (result.verdictOf(i)) words.push(['verdict', spaced(result.verdictOf(i))]);
  const flags = result.flagsOf(i);
  if (flags.length) words.push(['flags', flags.map(spaced).join(', ')]);
  const numbers = allMeasures(result)
    .filter((m) => Number.isFinite(m.value(i)))
    .map((m) => [m.label, `${m.text(i)}${m.unit ? ` ${m.unit}` : ''}`]);
  return el('dl', { class: 'facts' }, [...words, ...numbers].flatMap(([name, value]) =>
    [el('dt', {}, name), el('dd', {}, value)]));
}

export function showDetails(holder, result, i) {
  if (i === null) {
    holder.replaceChildren(el('h2', {}, 'No patch selected'),
      el('p', { class: 'quiet' }, 'Click on a patch in the view, or on a row of the table: '
        + 'its parameters, state and covariance appear here.'));
    return;
  }
  const type = result.typeOf(i);
  holder.replaceChildren(
    el('h2', {}, swatch(type.color), `Patch ${i}: ${spaced(type.surface)}, ${type.boundary}`),
    ...estimates(result, i),
    el('h3', {}, result.hasFits ? 'Fit' : 'Patch'),
    facts(result, i),
  );
}
