// `holdfast report --glb` before Khronos' validator: node --test, environment as for
// page_test.mjs.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import validator from 'gltf-validator';
import { run } from './browser.mjs';

const { HOLDFAST_PROGRAM: program, HOLDFAST_SOURCE_DIR: source } = process.env;
const folder = join(process.env.HOLDFAST_SCRATCH_DIR, 'report_glb');

mkdirSync(folder, { recursive: true });

test('glTF of all types of patches and of their ellipsoids is valid', async () => {
  run(program, 'fit', join(source, 'samples/rocks.pcd'), '-o', folder, '--spacing', '0.1', '--quiet');
  const glb = join(folder, 'rocks.glb');
  run(program, 'report', join(folder, 'rocks.patches.json'), '--glb', glb, '--magnification', '20',
    '--cloud', join(source, 'samples/rocks.pcd'));
  const bytes = readFileSync(glb);
  const report = await validator.validateBytes(new Uint8Array(bytes));
  const { numErrors, numWarnings, messages } = report.issues;
  assert.equal(numErrors, 0, JSON.stringify(messages.slice(0, 5)));
  assert.equal(numWarnings, 0, JSON.stringify(messages.slice(0, 5)));
  const gltf = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  const { patches } = JSON.parse(readFileSync(join(folder, 'rocks.patches.json'), 'utf8'));
  const surfaces = new Set(patches.map((patch) => patch.surface));
  assert.equal(gltf.meshes[0].primitives.length, surfaces.size);
  assert.deepEqual(gltf.nodes.map(({ name }) => name), ['rocks.pcd: patches',
    'rocks.pcd: centres at 3 sigma, 20 times as large as they are']);
  // 128 triangles each.
  const [ellipsoids] = gltf.meshes[1].primitives;
  assert.equal(gltf.accessors[ellipsoids.indices].count, 3 * 128 * patches.length);
});

test('glTF of soles is valid', async () => {
  const risk = join(folder, 'risk.json');
  run(program, 'risk', join(source, 'samples/rocks.pcd'), '--foot', 'point_foot', '-o', risk, '--quiet');
  const glb = join(folder, 'risk.glb');
  run(program, 'report', risk, '--glb', glb, '--quiet');
  const bytes = readFileSync(glb);
  const { issues } = await validator.validateBytes(new Uint8Array(bytes));
  assert.equal(issues.numErrors + issues.numWarnings, 0, JSON.stringify(issues.messages.slice(0, 5)));
  const gltf = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  const { footholds, foot } = JSON.parse(readFileSync(risk, 'utf8'));
  const [soles] = gltf.meshes.at(-1).primitives;
  assert.equal(gltf.accessors[soles.indices].count, 3 * foot.sole_m.length * footholds.length);
});
