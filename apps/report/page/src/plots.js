// Histograms of what tells whether the uncertainty can be believed.
import { el, svg } from './dom.js';
import { format } from './measures.js';
import { median, quantile } from './linear.js';

const kWidth = 360;
const kHeight = 150;
const kFoot = 20; // below the axis
const kBins = 28;

// Bins over the inner 98 %, what is beyond in the outermost; logarithmic where asked.
function histogram(values, logarithmic) {
  const to = logarithmic ? Math.log : (x) => x;
  const back = logarithmic ? Math.exp : (x) => x;
  const finite = values.filter((x) => Number.isFinite(x) && (!logarithmic || x > 0));
  const low = to(quantile(finite, 0.01));
  const high = Math.max(to(quantile(finite, 0.99)), low + 1e-9 + 1e-6 * Math.abs(low));
  const place = (x) => Math.min(1, Math.max(0, (to(x) - low) / (high - low)));
  const counts = new Array(kBins).fill(0);
  for (const x of finite) counts[Math.min(kBins - 1, Math.floor(kBins * place(x)))] += 1;
  return { counts, place, at: (t) => back(low + t * (high - low)), count: finite.length };
}

function bars({ counts, at }) {
  const most = Math.max(...counts);
  const width = kWidth / kBins;
  return counts.map((count, k) => {
    const height = (count / most) * (kHeight - kFoot - 6);
    const range = `${format(at(k / kBins))} to ${format(at((k + 1) / kBins))}: ${count}`;
    return svg('rect', {
      class: 'bar', x: k * width + 0.5, width: width - 1, y: kHeight - kFoot - height, height,
    }, svg('title', {}, range));
  });
}

function ticks({ at }) {
  return [0, 0.25, 0.5, 0.75, 1].map((t) => {
    const anchor = t === 0 ? 'start' : t === 1 ? 'end' : 'middle';
    return svg('text', { x: t * kWidth, y: kHeight - 5, 'text-anchor': anchor },
      format(Number(at(t).toPrecision(2))));
  });
}

const line = (x, cls) =>
  svg('line', { class: cls, x1: x, x2: x, y1: 0, y2: kHeight - kFoot });

// \param expected where the values should lie about, or null.
export function histogramFigure(result, measure, { logarithmic, expected }) {
  const values = Array.from({ length: result.count }, (_, i) => measure.value(i));
  const plot = histogram(values, logarithmic);
  const summary = plot.count === 0
    ? 'no patch has one'
    : `median ${format(median(values))}, 90 % between ${format(quantile(values, 0.05))} `
      + `and ${format(quantile(values, 0.95))}`;
  const caption = el('figcaption', {}, el('strong', {}, measure.heading), ` \u00b7 ${summary}`);
  if (plot.count === 0) return { figure: el('figure', {}, caption), mark: () => {} };
  const mark = line(0, 'mark');
  mark.setAttribute('visibility', 'hidden');
  const picture = svg('svg', {
    viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img', 'aria-label': `Histogram of ${measure.heading}: ${summary}`,
  }, bars(plot), svg('line', { class: 'axis', x1: 0, x2: kWidth, y1: kHeight - kFoot, y2: kHeight - kFoot }),
  ticks(plot), expected === null ? '' : line(plot.place(expected) * kWidth, 'expected'), mark);
  return {
    figure: el('figure', {}, caption, picture),
    mark: (i) => {
      const value = i === null ? NaN : values[i];
      mark.setAttribute('visibility', Number.isFinite(value) ? 'visible' : 'hidden');
      if (!Number.isFinite(value)) return;
      const x = plot.place(value) * kWidth;
      mark.setAttribute('x1', x);
      mark.setAttribute('x2', x);
    },
  };
}
