// The table of footholds, best first: what `holdfast risk` says of each.
import { soleColors } from './colors.js';
import { el, swatch } from './dom.js';
import { footholdMeasures, leftOutOf, spaced } from './measures.js';

const kAtOnce = 100; // rows; more on request

const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * x)).join(' ')})`;

function head(measures) {
  const cell = (text, cls) => el('th', { scope: 'col', class: cls ?? null }, text);
  return el('thead', {}, el('tr', {}, cell('rank'), cell('patch'), measures.map((m) => cell(m.heading))));
}

function row(k, { result, measures, colors, onSelect }) {
  const patch = result.risk.patchOf(k);
  const button = el('button', { type: 'button', 'aria-label': `Foothold ${k + 1}, patch ${patch}` },
    swatch(css(colors[k])), String(k + 1));
  return el('tr', { 'data-patch': patch, onclick: () => onSelect(patch) },
    el('th', { scope: 'row' }, button), el('td', {}, String(patch)),
    measures.map((m) => el('td', {}, m.text(k))));
}

// How many there are, and what became of the other patches.
function summary(risk) {
  const { count, head: { foot, ranking } } = risk;
  const left = leftOutOf(risk).map(([name, n]) => `${n} ${spaced(name)}`);
  return `${count} of ${ranking?.candidates ?? '?'} patches for ${foot?.name ?? 'the foot'}, best first`
    + (left.length ? `; left out: ${left.join(', ')}.` : '.');
}

// { mark(patch or null) }: without a risk the section is hidden.
export function showFootholds(section, result, onSelect) {
  section.hidden = !result.risk;
  if (!result.risk) return { mark: () => {} };
  const { risk } = result;
  const all = footholdMeasures(risk);
  // A compliant ankle has no tilt: a column of zeros says nothing.
  const measures = all.filter((m) => m.name !== 'tilt' || risk.columns.tilt.some((x) => x !== 0));
  const parts = { result, measures, colors: soleColors(result), onSelect };
  const body = el('tbody', {});
  const more = el('button', { type: 'button' }, `Show the other ${risk.count - kAtOnce} footholds`);
  let selected = null;
  const mark = (patch) => {
    selected = patch;
    body.querySelectorAll('[aria-current]').forEach((tr) => tr.removeAttribute('aria-current'));
    if (patch !== null)
      body.querySelector(`[data-patch="${patch}"]`)?.setAttribute('aria-current', 'true');
  };
  const fill = (count) => {
    body.replaceChildren(...Array.from({ length: Math.min(count, risk.count) }, (_, k) => row(k, parts)));
    more.hidden = count >= risk.count;
    mark(selected);
  };
  more.addEventListener('click', () => fill(Infinity));
  fill(kAtOnce);
  section.querySelector('.body').replaceChildren(
    el('p', { class: 'quiet' }, summary(risk)),
    el('div', { class: 'scroller', tabIndex: 0, role: 'region', 'aria-labelledby': 'footholds-title' },
      el('table', {}, head(measures), body)),
    el('p', {}, more),
    el('details', {}, el('summary', {}, 'What these probabilities take for granted'),
      el('ul', { class: 'quiet' }, (risk.head.assumptions ?? []).map((text) => el('li', {}, text)))),
  );
  return { mark };
}
