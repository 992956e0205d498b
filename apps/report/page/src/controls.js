// What the view shows, and how large ellipsoids are.
import { byId, el } from './dom.js';
import { radiiOf } from './ellipsoids.js';
import { format } from './measures.js';
import { median } from './linear.js';

export const kDefaults = {
  sigmas: 3, cloud: true, patches: true, soles: true, frames: false, centres: true, normals: false,
};

const kShown = [
  ['cloud', 'cloud'], ['patches', 'patches'], ['soles', 'soles'], ['frames', 'frames'],
  ['centres', 'sigma of centres'], ['normals', 'sigma of normals'],
];

const toSlider = (magnification) => 50 * Math.log10(magnification);
const fromSlider = (value) => Number((10 ** (value / 50)).toPrecision(2));

function magnifiedText(view) {
  const { sigmas, magnification, centres, normals } = view.options;
  if (!centres && !normals) return '';
  const known = view.centres.filter(Boolean);
  if (!view.result.hasFits) return '';
  if (known.length === 0) return 'This result has no covariance to show.';
  const factor = magnification === 1
    ? 'drawn as large as they are'
    : `drawn ${magnification}\u00d7 as large as they are`;
  const size = (scale, values) => {
    const value = scale * sigmas * median(values);
    return value < 1e-3 ? '0' : format(Number(value.toPrecision(2)));
  };
  const radii = known.map(radiiOf);
  const centre = [0, 1, 2].map((k) => size(1e3, radii.map((r) => r[k]))).join(', ');
  const angles = view.result.columns.sigma_normal;
  return [`Ellipsoids of ${sigmas} sigma, ${factor}.`,
    centres ? `The median of a centre truly has semi-axes of ${centre} mm.` : '',
    normals ? `The median of a normal is truly ${size(180 / Math.PI, angles)}\u00b0.` : '',
  ].filter(Boolean).join(' ');
}

// What a result has nothing of is not offered.
function isOffered(name, { risk, hasFits }) {
  if (name === 'soles') return risk !== null;
  return hasFits || !['centres', 'normals'].includes(name);
}

// \param colorings [{ name, label }]; chosen one of their names; onColor(name)
export function showControls(view, colorings, chosen, onColor) {
  const say = () => {
    byId('magnified').textContent = magnifiedText(view);
  };
  const set = (options) => {
    view.set(options);
    say();
  };
  const { result } = view;
  const checks = kShown.filter(([name]) => isOffered(name, result)).map(([name, label]) => el('label', {}, el('input', {
    type: 'checkbox', name, checked: view.options[name],
    disabled: name === 'cloud' && !view.cloud,
    onchange: (event) => set({ [name]: event.target.checked }),
  }), label));
  const color = el('select', { id: 'coloring', onchange: (event) => onColor(event.target.value) },
    colorings.map(({ name, label }) => el('option', { value: name, selected: name === chosen }, label)));
  const sigmas = el('select', {
    id: 'sigmas', onchange: (event) => set({ sigmas: Number(event.target.value) }),
  }, [1, 2, 3].map((k) => el('option', { value: k, selected: k === view.options.sigmas }, String(k))));
  const shown = el('output', { for: 'magnifier' }, `${view.options.magnification}\u00d7`);
  const magnifier = el('input', {
    id: 'magnifier', type: 'range', min: 0, max: 100, step: 1,
    value: toSlider(view.options.magnification),
    oninput: (event) => {
      set({ magnification: fromSlider(Number(event.target.value)) });
      shown.textContent = `${view.options.magnification}\u00d7`;
      magnifier.setAttribute('aria-valuetext', `${view.options.magnification} times`);
    },
  });
  const reset = el('button', { type: 'button', onclick: () => view.resetCamera() }, 'First view');
  byId('controls').replaceChildren(
    el('label', {}, 'Colour', color), ...checks,
    ...(result.hasFits
      ? [el('label', {}, 'sigma', sigmas), el('label', {}, 'magnified', magnifier, shown)] : []),
    reset,
  );
  say();
}
