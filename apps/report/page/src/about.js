// What was left out and why, the options, the sensor, the version.
import { el } from './dom.js';
import { leftOutOf, spaced } from './measures.js';

function list(pairs) {
  return el('dl', { class: 'facts' }, pairs.flatMap(([name, value]) =>
    [el('dt', {}, name), el('dd', {}, value)]));
}

// Numbers with as many digits as people read.
function plain(value) {
  if (typeof value === 'number')
    return String(Number.isInteger(value) ? value : Number(value.toPrecision(7)));
  return value !== null && typeof value === 'object'
    ? flattened(value).map(([name, text]) => (Array.isArray(value) ? text : `${name} ${text}`)).join(', ')
    : String(value);
}

// A tree as pairs of "a, b, c" and a value.
function flattened(tree, before = '') {
  return Object.entries(tree).flatMap(([name, value]) => {
    const path = before ? `${before}, ${spaced(name)}` : spaced(name);
    if (value === null) return [[path, '\u2013']];
    if (Array.isArray(value)) return [[path, value.map(plain).join('; ') || '\u2013']];
    return typeof value === 'object' ? flattened(value, path) : [[path, plain(value)]];
  });
}

const part = (title, ...children) => el('div', {}, el('h3', {}, title), children);

function leftOut(result) {
  const { rejected = {}, cloud_points: points = {} } = result.head;
  const reasons = [...Object.entries(rejected), ...leftOutOf(result.risk)].map(([reason, count]) => [spaced(reason), String(count)]);
  const shapeless = Array.from({ length: result.count }, (_, i) => i).filter((i) => !result.hasShape(i)).length;
  if (shapeless) reasons.push(['in the table, but not drawn: too little is known of them', String(shapeless)]);
  const lost = Object.entries(points)
    .filter(([name, count]) => !['in_file', 'used'].includes(name) && count > 0)
    .map(([name, count]) => [spaced(name), String(count)]);
  return part('Left out, and why',
    el('p', { class: 'quiet' }, reasons.length ? 'Seeds and patches, by reason' : 'No seed and no patch was left out.'),
    list(reasons),
    'in_file' in points
      ? el('p', { class: 'quiet' }, `Points: ${points.used} of ${points.in_file} used`)
      : null,
    list(lost));
}

function cloudText({ cloud, isMap }) {
  if (!cloud.file) return cloud.note;
  const shown = cloud.positions.length / 3;
  return shown < cloud.of
    ? `${cloud.file}: thinned to ${shown} of ${cloud.of} points, to keep this file small. Patches were fitted to all.`
    : `${cloud.file}: all ${shown} points${isMap ? '' : ' with a measurement'}`;
}

// What was asked; what came of it is said elsewhere.
function riskFacts({ foot = {}, load_direction, options = {}, ranking = {} }) {
  const { sole_m: corners = [], ...rest } = foot;
  return flattened({ foot: { ...rest, corners: corners.length }, load_direction, ...options, widest_support_m: ranking.widest_support_m ?? null });
}

export function showAbout(holder, result, made) {
  const { head } = result;
  const notices = head.notices ?? [];
  const origin = [['result', result.source], [result.isMap ? 'made from' : 'cloud', head.cloud ?? result.title],
    ...(result.hasFits ? [['holdfast', head.holdfast ?? 'before it said so']] : []), ['page by holdfast', made]];
  if (head.timestamp_us !== undefined) origin.push(['timestamp', `${head.timestamp_us} \u00b5s`]);
  holder.replaceChildren(
    leftOut(result),
    part('Where it comes from', list(origin), el('p', { class: 'quiet', id: 'cloud-note' }, cloudText(result)),
      notices.length ? el('ul', {}, notices.map((notice) => el('li', {}, notice))) : null),
    part('Sensor', list(flattened(head.sensor ?? {}))),
    ...(result.risk ? [part('Risk', list(riskFacts(result.risk.head)))] : []),
    ...(result.hasFits ? [part('Options', list(flattened(head.options ?? {}))),
      part('Input and timing', list([...flattened(head.input ?? {}), ...flattened(head.timing ?? {})]))] : []),
  );
}
