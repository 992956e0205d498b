// A report of Holdfast: data in the page, a view, a table, plots, and what they share.
import { showAbout } from './about.js';
import { measureColoring, riskColoring, typeColoring } from './colors.js';
import { kDefaults, showControls } from './controls.js';
import { readData } from './data.js';
import { showDetails } from './details.js';
import { byId, el } from './dom.js';
import { showFootholds } from './footholds.js';
import { coloringMeasures } from './measures.js';
import { histogramFigure } from './plots.js';
import { View } from './scene.js';
import { Table } from './table.js';

const data = readData(byId('data').textContent);
let result = null;
let plots = [];
let footholds = null;

function makeView() {
  try {
    return new View(byId('canvas'), { onPick: select });
  } catch {
    // Said on the page.
  }
  byId('no-webgl').hidden = false;
  byId('canvas').hidden = true;
  byId('controls').hidden = true;
  byId('stage').classList.add('flat');
  return null;
}

const view = makeView();
const table = new Table({
  onSelect: select,
  onFilter: (visible) => view?.setVisible(visible),
});

function select(i) {
  table.select(i);
  view?.select(i);
  showDetails(byId('details'), result, i);
  plots.forEach((plot) => plot.mark(i));
  footholds.mark(i);
  window.holdfastReport.selected = i;
}

function coloringOf(name) {
  if (name === 'risk') return riskColoring(result);
  const measure = coloringMeasures(result).find((m) => m.name === name);
  return measure ? measureColoring(result, measure) : typeColoring(result);
}

function color(name) {
  const coloring = coloringOf(name);
  view.setColoring(coloring);
  byId('legend').replaceChildren(coloring.legend());
}

function showView() {
  view.show(result, kDefaults);
  const measures = coloringMeasures(result).map(({ name, label }) => ({ name, label }));
  const first = result.risk ? 'risk' : 'type';
  color(first);
  showControls(view, [{ name: 'type', label: 'type' }, ...measures], first, color);
}

function showPlots() {
  plots = coloringMeasures(result).map((measure) => histogramFigure(result, measure, {
    logarithmic: measure.name.startsWith('sigma') || measure.name === 'risk',
    expected: measure.name === 'chi2_per_dof' ? 1 : null,
  }));
  byId('histograms').replaceChildren(...plots.map(({ figure }) => figure));
}

function showTitle() {
  const sensor = result.head.sensor?.name;
  const patches = result.count === 1 ? '1 patch' : `${result.count} patches`;
  const { foot } = result.risk?.head ?? {};
  const found = result.risk
    ? `${result.risk.count} footholds of ${foot?.name ?? 'a foot'}` : '';
  document.title = `${result.title} \u2013 Holdfast report`;
  byId('title').textContent = result.title;
  byId('subtitle').textContent = [result.isMap ? `map of ${patches}` : patches, found,
    sensor ? `sensor ${sensor}` : '', result.head.holdfast ? `holdfast ${result.head.holdfast}` : '']
    .filter(Boolean).join(' \u00b7 ');
}

function show(which) {
  result = data.results[which];
  showTitle();
  if (view) showView();
  showPlots();
  footholds = showFootholds(byId('footholds'), result, select);
  table.show(result);
  showAbout(byId('about-body'), result, data.version);
  select(null);
}

function offerResults() {
  if (data.results.length < 2) return;
  byId('chooser').hidden = false;
  byId('result').append(...data.results.map(({ title, count, risk }, i) =>
    el('option', { value: i }, `${title} (${risk ? `${risk.count} footholds` : count})`)));
  byId('result').addEventListener('change', (event) => show(Number(event.target.value)));
}

// report.html#patch=12 opens with that patch selected.
function selectLinked() {
  const [, patch] = /^#patch=(\d+)$/.exec(location.hash) ?? [];
  if (patch < result.count) select(Number(patch));
}

window.addEventListener('hashchange', selectLinked);

// For consoles and tests.
window.holdfastReport = { data, view, table, select, selected: null };
byId('made').textContent = `Made by holdfast ${data.version}. Drawn with three.js.`;
offerResults();
show(0);
selectLinked();
window.holdfastReport.isReady = true;
