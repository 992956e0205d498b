// Bundles the page into dist/: report.html, the page without its data, which the program
// embeds, and the licences of what is bundled. The same input gives the same bytes.
//
//   npm ci && npm run build          or: node build.mjs OTHER_FOLDER
import { build } from 'esbuild';
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2] ?? join(here, 'dist');
const bundled = ['three', 'fflate'];

const read = (...path) => readFileSync(join(here, ...path), 'utf8');

async function bundle(entry) {
  const result = await build({
    absWorkingDir: here,
    entryPoints: [entry],
    bundle: true,
    minify: true,
    write: false,
    charset: 'ascii',
    format: 'iife',
    legalComments: 'none',
    logLevel: 'warning',
    target: 'es2021',
  });
  return result.outputFiles[0].text.trim();
}

function version(name) {
  return JSON.parse(read('node_modules', name, 'package.json')).version;
}

// The policy allows this script and this style, and nothing else.
function hashOf(text) {
  return `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
}

function licences() {
  return bundled
    .map((name) => `${name} ${version(name)}\n\n${read('node_modules', name, 'LICENSE').trim()}\n`)
    .join('\n');
}

function fill(template, values) {
  return template.replace(/\{\{(\w+)\}\}/g, (_, name) => {
    if (!(name in values)) throw new Error(`report.html asks for ${name}`);
    return values[name];
  });
}

const script = await bundle('src/main.js');
const style = await bundle('src/style.css');
if (script.includes('</script') || style.includes('</style'))
  throw new Error('the bundle would end its own element');
const page = fill(read('src', 'report.html'), {
  script,
  style,
  scriptHash: hashOf(script),
  styleHash: hashOf(style),
  licences: licences(),
});
mkdirSync(target, { recursive: true });
writeFileSync(join(target, 'report.html'), page);
writeFileSync(join(target, 'LICENSES.txt'), licences());
console.log(`report.html: ${page.length} bytes`);
