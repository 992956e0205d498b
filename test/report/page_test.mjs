// The page of `holdfast report` in Chromium: node --test, with
//   HOLDFAST_PROGRAM  the program     HOLDFAST_SOURCE_DIR  the project
//   HOLDFAST_SCRATCH_DIR  a folder to write to; screenshots stay there
import assert from 'node:assert/strict';
import { copyFileSync, mkdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { drawn, launch, open, run } from './browser.mjs';

const { HOLDFAST_PROGRAM: program, HOLDFAST_SOURCE_DIR: source } = process.env;
const folder = join(process.env.HOLDFAST_SCRATCH_DIR, 'report_page');
const inFolder = (name) => join(folder, name);

let browser;
let json;

function report(page, ...args) {
  run(program, 'report', ...args, '-o', inFolder(page), '--quiet');
  return inFolder(page);
}

before(async () => {
  browser = await launch();
  mkdirSync(folder, { recursive: true });
  run(program, 'fit', join(source, 'samples/rocks.pcd'), '-o', folder, '--spacing', '0.08', '--quiet');
  json = JSON.parse(readFileSync(inFolder('rocks.patches.json'), 'utf8'));
  report('rocks.html', inFolder('rocks.patches.json'), '--cloud', join(source, 'samples/rocks.pcd'));
});

after(() => browser?.close());

// The patches of all rows, also of those that are shown on request.
const rows = (page) => page.evaluate(() => {
  const more = document.getElementById('more');
  if (!more.hidden) more.click();
  return [...document.querySelectorAll('#table tbody tr')].map((row) => Number(row.dataset.patch));
});

async function filter(page, text) {
  await page.$eval('#filter', (input, value) => {
    input.value = value;
    input.dispatchEvent(new Event('input'));
  }, text);
  await drawn(page);
}

// Draws, and counts what the graphics card was asked.
const drawCalls = (page) => drawn(page).then(() => page.evaluate(() => {
  const { renderer, scene, camera } = window.holdfastReport.view;
  renderer.render(scene, camera);
  return renderer.info.render.calls;
}));

// How many pixels of the view are not its background.
const inked = (page) => drawn(page).then(() => page.evaluate(() => {
  const { renderer, scene, camera, canvas } = window.holdfastReport.view;
  renderer.render(scene, camera);
  const copy = document.createElement('canvas');
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let count = 0;
  for (let k = 3; k < data.length; k += 4) count += data[k] > 0;
  return count / (copy.width * copy.height);
}));

test('opens without a complaint or a request, and shows what it is about', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  assert.match(await page.title(), /rocks\.pcd/);
  assert.equal((await rows(page)).length, json.patches.length);
  assert.ok((await inked(page)) > 0.4, 'the cloud fills the view');
  const text = await page.$eval('main', (main) => main.innerText);
  for (const word of ['kinect_v1', 'containment'])
    assert.ok(text.includes(word), word);
  for (const reason of Object.keys(json.rejected))
    assert.ok(text.includes(reason.replaceAll('_', ' ')), reason);
  await page.screenshot({ path: inFolder('rocks.png') });
  assert.deepEqual(complaints, []);
  await page.close();
});

test('nothing can be asked for, whoever tries', async () => {
  const { page } = await open(browser, inFolder('rocks.html'));
  const blocked = await page.evaluate(async () => {
    const fetched = await fetch('https://example.org/').then(() => 'fetched', () => 'refused');
    let ran = false;
    window.intruder = () => { ran = true; };
    const script = document.createElement('script');
    script.textContent = 'intruder()';
    document.body.append(script);
    return { fetched, ran };
  });
  assert.deepEqual(blocked, { fetched: 'refused', ran: false });
  await page.close();
});

test('the filter keeps what holds, in the table and in the view', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  const types = json.patches.map((patch) => patch.surface);
  const all = await inked(page);
  await page.$$eval('#controls input[name=cloud]', ([box]) => box.click());
  const withoutCloud = await inked(page);
  assert.ok(withoutCloud < all);
  await filter(page, 'plane');
  const planes = types.flatMap((type, i) => (type === 'plane' ? [i] : []));
  assert.deepEqual(await rows(page), planes);
  assert.ok((await inked(page)) < withoutCloud);
  await filter(page, '-plane chi2/dof<1');
  const few = json.patches.flatMap((p, i) =>
    (p.surface !== 'plane' && p.chi2 / p.chi2_expected < 1 ? [i] : []));
  assert.deepEqual(await rows(page), few);
  assert.equal(await page.$eval('#count', (count) => count.textContent),
    `${few.length} of ${types.length} patches`);
  await filter(page, 'nothing<3');
  assert.equal(await page.$eval('#filter', (input) => input.getAttribute('aria-invalid')), 'true');
  assert.match(await page.$eval('#count', (count) => count.textContent), /nothing/);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a heading sorts up, then down, and says so', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  const heading = '#table th[data-column="chi2_per_dof"]';
  const sorted = async () => {
    await page.click(`${heading} button`);
    const at = await rows(page);
    const values = at.map((i) => json.patches[i].chi2 / json.patches[i].chi2_expected);
    return { values, says: await page.$eval(heading, (th) => th.getAttribute('aria-sort')) };
  };
  const up = await sorted();
  assert.equal(up.says, 'ascending');
  const steps = (values) => values.slice(1).map((x, k) => x - values[k]);
  assert.ok(steps(up.values).every((step) => step > -1e-6), 'ascending');
  const down = await sorted();
  assert.equal(down.says, 'descending');
  assert.ok(steps(down.values).every((step) => step < 1e-6), 'descending');
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a click on a patch in the view selects its row and shows its numbers', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  // The middle of a patch that no other covers, by the page's own projection.
  const [patch, x, y] = await page.evaluate(() => {
    const { view } = window.holdfastReport;
    for (let i = 0; i < view.result.count; ++i) {
      const [px, py] = view.pixelOf(i);
      const box = view.canvas.getBoundingClientRect();
      const inside = px > box.left && px < box.right && py > box.top && py < box.bottom - 40;
      if (inside && view.patchAt(px, py) === i) return [i, px, py];
    }
    return [];
  });
  assert.ok(patch !== undefined);
  await page.mouse.click(x, y);
  await drawn(page);
  const current = await page.$$eval('#table tr[aria-current]', (all) => all.map((row) => Number(row.dataset.patch)));
  assert.deepEqual(current, [patch]);
  const details = await page.$eval('#details', (part) => part.innerText);
  const { surface, names, state_names: states, parameters } = json.patches[patch];
  assert.ok(details.includes(surface.replaceAll('_', ' ')));
  for (const name of [...names, ...states, 'Principal sigmas', 'Covariance', 'State'])
    assert.ok(details.includes(name), name);
  const shown = await page.$$eval('#details table', (tables) =>
    tables.map((table) => [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent))));
  const listed = shown.find((table) => table[1]?.[0] === names[0]);
  parameters.forEach((value, k) => {
    const text = Number(listed[k + 1][1]);
    assert.ok(Math.abs(text - value) <= 1e-3 * Math.abs(value) + 1e-6, `${names[k]}: ${text} for ${value}`);
  });
  await page.screenshot({ path: inFolder('selected.png') });
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a click beside all patches selects nothing', async () => {
  const { page } = await open(browser, inFolder('rocks.html'));
  await page.evaluate(() => window.holdfastReport.select(0));
  const box = await page.$eval('#canvas', (canvas) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [left + 2, top + 2];
  });
  const hit = await page.evaluate(([x, y]) => window.holdfastReport.view.patchAt(x, y), box);
  assert.equal(hit, null);
  await page.mouse.click(...box);
  assert.equal(await page.evaluate(() => window.holdfastReport.selected), null);
  await page.close();
});

test('a link opens with its patch selected', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'), { hash: '#patch=7' });
  assert.equal(await page.evaluate(() => window.holdfastReport.selected), 7);
  assert.match(await page.$eval('#details h2', (title) => title.textContent), /^Patch 7:/);
  assert.deepEqual(complaints, []);
  await page.close();
});

// Eigenvalues of a symmetric 3 x 3 matrix from its characteristic polynomial, smallest
// first; another way than the page's.
function eigenvalues(m) {
  const q = (m[0][0] + m[1][1] + m[2][2]) / 3;
  const off = m[0][1] ** 2 + m[0][2] ** 2 + m[1][2] ** 2;
  const p = Math.sqrt(((m[0][0] - q) ** 2 + (m[1][1] - q) ** 2 + (m[2][2] - q) ** 2 + 2 * off) / 6);
  const b = m.map((row, i) => row.map((x, j) => (x - (i === j ? q : 0)) / p));
  const det = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1])
    - b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0])
    + b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
  const angle = Math.acos(Math.max(-1, Math.min(1, det / 2))) / 3;
  return [2, 1, 0].map((k) => q + 2 * p * Math.cos(angle + (2 * Math.PI * k) / 3)).sort((x, y) => x - y);
}

test('ellipsoids are as large as the covariance says', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  await page.$$eval('#controls input[name=normals]', ([box]) => box.click());
  for (const sigmas of [1, 2, 3]) {
    await page.select('#sigmas', String(sigmas));
    await drawn(page);
    const { radii, magnification, lengths } = await page.evaluate(() => {
      const { view } = window.holdfastReport;
      const { array } = view.centreMesh.instanceMatrix;
      const size = (at) => Math.hypot(array[at], array[at + 1], array[at + 2]);
      const all = Array.from({ length: view.centreMesh.count }, (_, i) =>
        [0, 1, 2].map((k) => size(16 * i + 4 * k)).sort((a, b) => a - b));
      const normals = view.normalMesh.instanceMatrix.array;
      const long = Array.from({ length: view.normalMesh.count }, (_, i) =>
        Math.hypot(normals[16 * i], normals[16 * i + 1], normals[16 * i + 2])
        / view.result.meshes.reach[i]);
      return { radii: all, magnification: view.options.magnification, lengths: long };
    });
    assert.equal(radii.length, json.patches.length);
    json.patches.forEach((patch, i) => {
      const n = patch.state.length;
      const covariance = patch.state_covariance.slice(n - 3).map((row) => row.slice(n - 3));
      eigenvalues(covariance).forEach((value, k) => {
        const expected = sigmas * magnification * Math.sqrt(Math.max(0, value));
        assert.ok(Math.abs(radii[i][k] - expected) < 1e-3 * expected + 3e-6,
          `patch ${i}, axis ${k}: ${radii[i][k]} for ${expected}`);
      });
      const at = patch.state_names.indexOf('nu_x');
      const [[a, b], [, d]] = patch.state_covariance.slice(at, at + 2).map((row) => row.slice(at, at + 2));
      const largest = (a + d) / 2 + Math.hypot((a - d) / 2, b);
      const angle = sigmas * magnification * Math.sqrt(largest);
      assert.ok(Math.abs(lengths[i] - angle) < 1e-3 * angle, `normal of patch ${i}`);
    });
  }
  assert.deepEqual(complaints, []);
  await page.close();
});

test('the first magnification makes the median visible, and the screen says it', async () => {
  const { page } = await open(browser, inFolder('rocks.html'));
  const said = await page.$eval('#magnified', (text) => text.textContent);
  // By their outlines on the screen, one by one: points of each ellipsoid projected.
  const { magnification, pixels } = await page.evaluate(() => {
    const { view } = window.holdfastReport;
    const { array } = view.centreMesh.instanceMatrix;
    const { sigmas, magnification: factor } = view.options;
    const Point = view.camera.position.constructor;
    const { width, height } = view.canvas.getBoundingClientRect();
    const sizes = view.centres.map((ellipsoid, i) => {
      const screen = (k, s) => {
        const at = [0, 1, 2].map((c) => array[16 * i + 12 + c] + (s * array[16 * i + 4 * k + c]) / factor / sigmas);
        const p = new Point(...at).project(view.camera);
        return [(p.x * width) / 2, (p.y * height) / 2];
      };
      const reach = [0, 1, 2].map((k) => {
        const [a, b] = [screen(k, 1e-2), screen(k, -1e-2)];
        return Math.hypot(a[0] - b[0], a[1] - b[1]) / 2e-2;
      });
      return Math.max(...reach) * sigmas * factor;
    }).sort((a, b) => a - b);
    return { magnification: factor, pixels: sizes[sizes.length >> 1] };
  });
  assert.ok(pixels >= 3 && (pixels < 20 || magnification === 1), `${pixels} px`);
  assert.ok(said.includes('3 sigma') && said.includes(`${magnification}\u00d7`), said);
  await page.$eval('#magnifier', (slider) => {
    slider.value = 100;
    slider.dispatchEvent(new Event('input'));
  });
  assert.match(await page.$eval('#magnified', (text) => text.textContent), /100\u00d7/);
  await page.close();
});

test('every colouring has a legend; frames and normals appear', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  const choices = await page.$$eval('#coloring option', (all) => all.map(({ value }) => value));
  assert.deepEqual(choices, ['type', 'sigma_centre', 'sigma_normal', 'chi2_per_dof']);
  const legends = new Set();
  for (const choice of choices) {
    await page.select('#coloring', choice);
    legends.add(await page.$eval('#legend', (legend) => legend.textContent));
  }
  assert.equal(legends.size, choices.length);
  await page.$$eval('#controls input[name=frames]', ([box]) => box.click());
  await page.$$eval('#controls input[name=normals]', ([box]) => box.click());
  await drawn(page);
  await page.screenshot({ path: inFolder('everything.png') });
  assert.ok((await drawCalls(page)) <= 5);
  assert.equal((await page.$$('#histograms svg')).length, 3);
  assert.deepEqual(complaints, []);
  await page.close();
});

// A result with other names and more patches, made from that of the rocks.
function made(name, change) {
  const copy = structuredClone(json);
  change(copy);
  writeFileSync(inFolder(name), JSON.stringify(copy));
  return inFolder(name);
}

test('5000 patches take five draw calls', async () => {
  const many = made('many.json', (result) => {
    const { patches } = result;
    result.patches = Array.from({ length: 5000 }, (_, i) => patches[i % patches.length]);
  });
  const path = report('many.html', many, '--cloud', join(source, 'samples/rocks.pcd'));
  const { page, complaints } = await open(browser, path);
  for (const name of ['frames', 'normals'])
    await page.$$eval(`#controls input[name=${name}]`, ([box]) => box.click());
  assert.ok((await drawCalls(page)) <= 5);
  assert.equal(await page.evaluate(() => window.holdfastReport.view.result.count), 5000);
  await page.evaluate(() => window.holdfastReport.select(4999));
  assert.deepEqual(await page.$$eval('#table tr[aria-current]', (all) => all.map((row) => row.dataset.patch)), ['4999']);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('50000 points and 1000 patches fit into 2 MB, and the page says what it thinned', async () => {
  const path = inFolder('large.html');
  run(program, 'simulate', 'rocks', '-o', inFolder('large.pcd'), '--stride', '2', '--quiet');
  run(program, 'fit', inFolder('large.pcd'), '-o', folder, '--spacing', '0.03', '--quiet');
  const large = JSON.parse(readFileSync(inFolder('large.patches.json'), 'utf8'));
  assert.ok(large.cloud_points.used > 50000, `${large.cloud_points.used} points`);
  const thousand = large.patches.slice(0, 1000);
  assert.equal(thousand.length, 1000);
  writeFileSync(inFolder('large.json'), JSON.stringify({ ...large, patches: thousand }));
  run(program, 'report', inFolder('large.json'), '-o', path, '--quiet');
  const { size } = statSync(path);
  assert.ok(size <= 2e6, `${size} bytes`);
  const { page, complaints } = await open(browser, path);
  assert.match(await page.$eval('#cloud-note', (note) => note.textContent), /thinned to \d+ of \d+ points/);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('names come out as text, whatever is in them', async () => {
  const names = ['</script><script>document.title="bad"</script>.pcd', '"\'><img src=x onerror=alert(1)>.pcd',
    'S\u00fcdhang \u30ed\u30dc\u30c3\u30c8 \u{1f98e}.pcd', '<!-- <script>.pcd'];
  const files = names.map((name, k) => {
    const short = name.split('/').at(-1);
    copyFileSync(join(source, 'samples/rocks.pcd'), inFolder(short));
    return made(`named${k}.json`, (result) => {
      result.cloud = name;
      result.notices = [name];
      result.sensor.name = name;
    });
  });
  const path = report('named.html', ...files);
  const { page, complaints } = await open(browser, path);
  for (const [k, name] of names.entries()) {
    await page.select('#result', String(k));
    await drawn(page);
    const text = await page.$eval('#about', (about) => about.textContent);
    assert.ok(text.includes(name), name);
    assert.ok((await page.title()).includes(name.split('/').at(-1)));
  }
  assert.equal(await page.$$eval('img', (all) => all.length), 0);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('without WebGL there are table and plots, and a note', async () => {
  const flat = await launch('--disable-3d-apis');
  const { page, complaints } = await open(flat, inFolder('rocks.html'));
  assert.equal(await page.$eval('#no-webgl', (note) => note.hidden), false);
  assert.equal((await rows(page)).length, json.patches.length);
  assert.equal((await page.$$('#histograms svg')).length, 3);
  await page.click('#table tbody tr');
  assert.match(await page.$eval('#details', (part) => part.innerText), /Principal sigmas/);
  await page.screenshot({ path: inFolder('flat.png') });
  assert.deepEqual(complaints.filter((c) => !c.includes('WebGL')), []);
  await flat.close();
});

test('without its cloud the page shows the patches and says what is missing', async () => {
  const lost = made('lost.json', (result) => {
    result.cloud = 'no/such/cloud.pcd';
  });
  const { page, complaints } = await open(browser, report('lost.html', lost));
  assert.match(await page.$eval('#cloud-note', (note) => note.textContent), /no\/such\/cloud\.pcd/);
  assert.ok((await inked(page)) > 0.05);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a phone shows it without scrolling sideways', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'),
    { width: 390, height: 844, isMobile: true, hasTouch: true });
  const { wide, view } = await page.evaluate(() => ({
    wide: document.documentElement.scrollWidth,
    view: document.getElementById('canvas').getBoundingClientRect().width,
  }));
  assert.ok(wide <= 390, `${wide} px`);
  assert.ok(view > 330);
  await page.screenshot({ path: inFolder('phone.png'), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test('the table is walked through by keys, and has names for who does not see it', async () => {
  const { page, complaints } = await open(browser, inFolder('rocks.html'));
  await page.focus('#table tbody tr:first-child button');
  await page.keyboard.press('ArrowDown');
  assert.equal(await page.evaluate(() => window.holdfastReport.selected), 1);
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute('aria-label')), 'Patch 1');
  const shown = await page.$$eval('#table tbody tr', (all) => all.length);
  await page.keyboard.press('End');
  assert.equal(await page.evaluate(() => window.holdfastReport.selected), shown - 1);
  const tree = JSON.stringify(await page.accessibility.snapshot({ interestingOnly: false }));
  for (const name of ['Skip to the table of patches', 'Patch 1', 'What the view shows', 'Colour'])
    assert.ok(tree.includes(name), name);
  const unnamed = await page.$$eval('button, input, select', (all) => all
    .filter((e) => e.offsetParent && !e.textContent.trim() && !e.labels?.length && !e.ariaLabel)
    .map((e) => e.outerHTML));
  assert.deepEqual(unnamed, []);
  assert.deepEqual(complaints, []);
  await page.close();
});

// What 'holdfast risk' finds on the rocks, and its page.
function riskPage(...more) {
  const cloud = join(source, 'samples/rocks.pcd');
  run(program, 'risk', cloud, '--foot', 'point_foot', '--best', '12', '-o', inFolder('risk.json'), '--quiet');
  const found = JSON.parse(readFileSync(inFolder('risk.json'), 'utf8'));
  return { found, path: report('risk.html', inFolder('risk.json'), ...more) };
}

test('a risk is shown by its colours, its soles and a table of its footholds', async () => {
  const { found, path } = riskPage();
  const { page, complaints } = await open(browser, path);
  assert.equal(await page.$eval('#coloring', (select) => select.value), 'risk');
  assert.match(await page.$eval('#legend', (legend) => legend.textContent), /0\.1 %.*100 %.*too little seen/);
  const rows = await page.$$eval('#footholds tbody tr', (all) =>
    all.map((row) => [...row.cells].map((cell) => cell.textContent)));
  assert.equal(rows.length, 12);
  const numbers = new Map(found.patches.map(({ patch }, i) => [patch, i]));
  rows.forEach((row, k) => {
    const { patch, risk } = found.footholds[k];
    assert.equal(row[0], String(k + 1));
    assert.equal(Number(row[1]), numbers.get(patch));
    const percent = 100 * risk.total;
    if (percent < 0.999e-3) assert.equal(row[2], '< 0.001');
    else assert.ok(Math.abs(Number(row[2]) - percent) <= 1e-3 * percent, row[2]);
  });
  const calls = await drawCalls(page);
  assert.ok(calls <= 6, `${calls}`);
  await page.screenshot({ path: inFolder('risk.png') });
  await page.$$eval('#controls input[name=soles]', ([box]) => box.click());
  assert.equal(await drawCalls(page), calls - 1);
  await page.$$eval('#controls input[name=soles]', ([box]) => box.click());
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a foothold selects its patch, and says what it is', async () => {
  const { found, path } = riskPage();
  const { page, complaints } = await open(browser, path);
  await page.click('#footholds tbody tr:nth-child(2) td');
  const patch = found.patches.findIndex(({ patch: id }) => id === found.footholds[1].patch);
  assert.equal(await page.evaluate(() => window.holdfastReport.selected), patch);
  for (const table of ['#table', '#footholds'])
    assert.deepEqual(await page.$$eval(`${table} tr[aria-current]`, (all) =>
      all.map((row) => Number(row.dataset.patch))), [patch], table);
  const details = await page.$eval('#details', (part) => part.innerText);
  assert.match(details, /number 2 of 12/);
  assert.ok(!details.includes('State'), 'no fit, no state');
  const about = await page.$eval('#about', (part) => part.textContent);
  for (const word of ['point_foot', 'load direction']) assert.ok(about.includes(word), word);
  const footholds = await page.$eval('#footholds', (part) => part.textContent);
  for (const assumption of found.assumptions) assert.ok(footholds.includes(assumption), assumption);
  await filter(page, 'insufficient');
  assert.deepEqual((await rows(page)).sort((a, b) => a - b), found.patches.flatMap(({ status }, i) =>
    (status === 'insufficient_support' ? [i] : [])));
  await filter(page, 'risk<1');
  assert.deepEqual((await rows(page)).sort((a, b) => a - b), found.patches.flatMap(({ total }, i) =>
    (total !== null && Math.fround(total) * 100 < 1 ? [i] : [])));
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a phone shows a risk without scrolling sideways', async () => {
  const { path } = riskPage();
  const { page, complaints } = await open(browser, path,
    { width: 390, height: 844, isMobile: true, hasTouch: true });
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
  await page.screenshot({ path: inFolder('risk_phone.png'), fullPage: true });
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a result without a risk has no footholds', async () => {
  const { page } = await open(browser, inFolder('rocks.html'));
  assert.ok(await page.$eval('#footholds', (section) => section.hidden));
  assert.equal((await page.$$('#controls input[name=soles]')).length, 0);
  await page.close();
});

test('dark screens get a dark page', async () => {
  const { page } = await open(browser, inFolder('rocks.html'));
  const paper = () => page.$eval('body', (body) => getComputedStyle(body).backgroundColor);
  const light = await paper();
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
  assert.notEqual(await paper(), light);
  await drawn(page);
  await page.screenshot({ path: inFolder('dark.png') });
  await page.close();
});
