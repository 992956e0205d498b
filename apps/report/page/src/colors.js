// Colours of patches, and the legend that explains them.
import { el, svg, swatch } from './dom.js';
import { format, spaced } from './measures.js';
import { quantile } from './linear.js';

// Viridis: the polynomials of degree six that M. Zucker fitted to the map of S. van der
// Walt and N. Smith; lowest order first.
const kViridis = [
  [0.277727, 0.105093, -0.330862, -4.63423, 6.22827, 4.776385, -5.435456],
  [0.005407, 1.404614, 0.214848, -5.799101, 14.179933, -13.745145, 4.645853],
  [0.3341, 1.38459, 0.095095, -19.332441, 56.690553, -65.353033, 26.312435],
];
const kNoNumber = [0.59, 0.59, 0.59];

export function viridis(t) {
  const at = Math.min(1, Math.max(0, t));
  return kViridis.map((c) =>
    Math.min(1, Math.max(0, c.reduceRight((sum, next) => sum * at + next, 0))));
}

export const parseHex = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * x)).join(' ')})`;

function typesIn(result) {
  const seen = new Map();
  for (let i = 0; i < result.count; ++i) {
    const type = result.typeOf(i);
    const entry = seen.get(type.surface) ?? { type, count: 0 };
    entry.count += 1;
    seen.set(type.surface, entry);
  }
  return [...seen.values()].sort((a, b) => b.count - a.count);
}

export function typeColoring(result) {
  const colors = result.names.types.map((type) => parseHex(type.color));
  return {
    color: (i) => colors[result.kinds.types[i]],
    legend: () =>
      el('ul', {}, typesIn(result).map(({ type, count }) =>
        el('li', {}, swatch(type.color), `${spaced(type.surface)} ${count}`))),
  };
}

const kBar = 180; // px

// \param labels [{ at, text }], at 0 to 1.
function scaleBar(colorAt, labels) {
  const bars = Array.from({ length: 60 }, (_, k) =>
    svg('rect', { x: 3 * k, width: 3.2, height: 9, fill: css(colorAt((k + 0.5) / 60)) }));
  const words = labels.map(({ at, text }) => {
    const anchor = at === 0 ? 'start' : at === 1 ? 'end' : 'middle';
    return svg('text', { x: at * kBar, y: 21, 'text-anchor': anchor }, text);
  });
  return svg('svg', { width: kBar, height: 24, 'aria-hidden': 'true' }, bars, words);
}

// As `holdfast render --color risk` has it: logarithmic, the same for all results.
function riskScale({ least, colors }) {
  const stops = colors.map(parseHex);
  const place = (risk) => 1 - Math.log(Math.min(1, Math.max(least, risk))) / Math.log(least);
  const colorAt = (at) => {
    const t = at * (stops.length - 1);
    const first = Math.min(Math.floor(t), stops.length - 2);
    return stops[first].map((x, c) => x + (t - first) * (stops[first + 1][c] - x));
  };
  return { place, colorAt };
}

// The colours of soles.
export function soleColors({ names, risk }) {
  const { place, colorAt } = riskScale(names.riskScale);
  return Array.from(risk.columns.total, (total) => colorAt(place(total)));
}

export function riskColoring(result) {
  const { least, colors, none } = result.names.riskScale;
  const { place, colorAt } = riskScale({ least, colors });
  const gray = parseHex(none);
  const risks = result.columns.risk ?? [];
  const labels = [least, 0.01, 0.1, 1].map((risk) => ({ at: place(risk), text: `${format(100 * risk)} %` }));
  return {
    color: (i) => (Number.isFinite(risks[i]) ? colorAt(place(risks[i])) : gray),
    legend: () => el('div', { class: 'scale' }, 'total risk ', scaleBar(colorAt, labels),
      el('div', {}, swatch(none), 'too little seen')),
  };
}

// Logarithmic; the outer 5 % on each side are as the ends.
export function measureColoring(result, measure) {
  const values = Array.from({ length: result.count }, (_, i) => measure.value(i));
  const positive = values.filter((x) => x > 0);
  const low = quantile(positive, 0.05);
  const high = Math.max(quantile(positive, 0.95), low * 1.01);
  const place = (x) => Math.log(x / low) / Math.log(high / low);
  return {
    color: (i) => (values[i] > 0 ? viridis(place(values[i])) : kNoNumber),
    legend: () => {
      const labels = [low, Math.sqrt(low * high), high].map((value, k) =>
        ({ at: k / 2, text: format(Number(value.toPrecision(2))) }));
      const range = positive.length ? scaleBar(viridis, labels) : ' (no patch has one)';
      return el('div', { class: 'scale' }, measure.heading, range);
    },
  };
}
