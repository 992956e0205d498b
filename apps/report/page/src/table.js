// The table of patches: sorted by a click on a heading, filtered, walked through by keys.
import { byId, el, swatch } from './dom.js';
import { parseFilter } from './filter.js';
import { allMeasures, spaced, tableMeasures } from './measures.js';

const kAtOnce = 300; // rows; more on request

function wordColumns(result) {
  const columns = [
    { name: 'index', label: '#', value: (i) => i },
    { name: 'type', label: 'type', word: true, value: (i) => result.typeOf(i).surface },
    { name: 'boundary', label: 'boundary', word: true, value: (i) => result.typeOf(i).boundary },
  ];
  const states = (i) => result.wordsOf(i).filter((word) => word !== 'accepted').map(spaced).join(', ');
  return { columns, last: { name: 'state', label: 'status', word: true, value: states } };
}

const order = (a, b) => {
  if (typeof a === 'string') return a.localeCompare(b);
  if (Number.isNaN(a) || Number.isNaN(b)) return Number.isNaN(a) - Number.isNaN(b);
  return a - b;
};

export class Table {
  // onSelect(i), onFilter(visible: boolean of each patch)
  constructor({ onSelect, onFilter }) {
    this.onSelect = onSelect;
    this.onFilter = onFilter;
    this.table = byId('table');
    this.input = byId('filter');
    this.input.addEventListener('input', () => this.filter());
    byId('more').addEventListener('click', () => this.showRows(Infinity));
    this.table.addEventListener('keydown', (event) => this.walk(event));
  }

  show(result) {
    this.result = result;
    this.measures = allMeasures(result);
    const { columns, last } = wordColumns(result);
    const numbers = tableMeasures(result).map((m) => ({ ...m, label: m.heading }));
    this.columns = [...columns, ...numbers, last];
    this.sorted = { column: this.columns[0], down: false };
    this.selected = null;
    this.filter();
  }

  filter() {
    const { test, error } = parseFilter(this.input.value, this.result, this.measures);
    this.input.setAttribute('aria-invalid', error ? 'true' : 'false');
    this.visible = Array.from({ length: this.result.count }, (_, i) => test(i));
    this.error = error;
    this.onFilter(this.visible);
    this.arrange();
  }

  sortBy(column) {
    const again = this.sorted.column === column;
    this.sorted = { column, down: again ? !this.sorted.down : false };
    this.arrange();
    this.table.querySelector(`[data-column="${column.name}"] button`).focus();
  }

  arrange() {
    const { column, down } = this.sorted;
    this.rows = this.visible.flatMap((isVisible, i) => (isVisible ? [i] : []));
    const key = this.rows.map((i) => column.value(i));
    const places = this.rows.map((_, k) => k);
    places.sort((a, b) => {
      const missing = Number.isNaN(key[a]) || Number.isNaN(key[b]);
      return order(key[a], key[b]) * (down && !missing ? -1 : 1) || a - b;
    });
    this.rows = places.map((k) => this.rows[k]);
    this.showRows(kAtOnce);
  }

  showRows(count) {
    const shown = this.rows.slice(0, count);
    this.body = el('tbody', {}, shown.map((i) => this.row(i)));
    this.table.replaceChildren(this.head(), this.body);
    this.mark();
    const rest = this.rows.length - shown.length;
    byId('more').hidden = rest === 0;
    byId('more').textContent = `Show the other ${rest} rows`;
    byId('count').textContent = this.error
      || `${this.rows.length} of ${this.result.count} patches`;
  }

  head() {
    const cell = (column) => {
      const { column: by, down } = this.sorted;
      const sign = by === column ? (down ? ' \u2193' : ' \u2191') : '';
      const button = el('button', { type: 'button', onclick: () => this.sortBy(column) },
        column.label + sign);
      const attributes = { scope: 'col', class: column.word ? 'word' : null, 'data-column': column.name };
      if (by === column) attributes['aria-sort'] = down ? 'descending' : 'ascending';
      return el('th', attributes, button);
    };
    return el('thead', {}, el('tr', {}, this.columns.map(cell)));
  }

  row(i) {
    const cells = this.columns.map((column) => {
      if (column.name === 'index') {
        const button = el('button', { type: 'button', 'aria-label': `Patch ${i}` }, String(i));
        return el('th', { scope: 'row' }, button);
      }
      if (column.name === 'type')
        return el('td', { class: 'word' }, swatch(this.result.typeOf(i).color), spaced(column.value(i)));
      return column.word
        ? el('td', { class: 'word' }, column.value(i))
        : el('td', {}, column.text(i));
    });
    return el('tr', { 'data-patch': i, onclick: () => this.onSelect(i) }, cells);
  }

  // Up and down go from row to row, Home and End to the first and last.
  walk(event) {
    const row = event.target.closest('tbody tr');
    const to = {
      ArrowDown: row?.nextElementSibling,
      ArrowUp: row?.previousElementSibling,
      Home: row?.parentElement.firstElementChild,
      End: row?.parentElement.lastElementChild,
    }[event.key];
    if (!to) return;
    event.preventDefault();
    to.querySelector('button').focus();
    this.onSelect(Number(to.dataset.patch));
  }

  select(i) {
    this.selected = i;
    if (i !== null && this.rows.indexOf(i) >= this.body.childElementCount) this.showRows(Infinity);
    this.mark();
  }

  mark() {
    this.body.querySelector('[aria-current]')?.removeAttribute('aria-current');
    const row = this.body.querySelector(`[data-patch="${this.selected}"]`);
    row?.setAttribute('aria-current', 'true');
    if (row) this.reveal(row);
  }

  // Scrolls the table alone: the page stays where it is.
  reveal(row) {
    const scroller = this.table.parentElement;
    const head = this.table.tHead.offsetHeight;
    const top = row.offsetTop - head;
    const bottom = row.offsetTop + row.offsetHeight - scroller.clientHeight;
    if (scroller.scrollTop > top) scroller.scrollTop = top;
    else if (scroller.scrollTop < bottom) scroller.scrollTop = bottom;
  }
}
