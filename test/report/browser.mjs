// A page in a real browser, and what it complained about.
import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { pathToFileURL } from 'node:url';

export const kSkip = 77;

const kPatience = 120000; // ms: drawing in software beside other work

export function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(kSkip);
}

const kNames = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

function findBrowser() {
  const asked = process.env.HOLDFAST_CHROMIUM;
  return (asked ? [asked] : kNames).find((path) => existsSync(path));
}

// Software rendering, so that it needs neither a screen nor a graphics card.
const kFlags = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader', '--hide-scrollbars', '--force-device-scale-factor=1'];

export async function launch(...flags) {
  const executablePath = findBrowser();
  if (!executablePath) skip('no chromium (package chromium)');
  const puppeteer = (await import('puppeteer-core')).default;
  return puppeteer.launch({ executablePath, headless: true, args: [...kFlags, ...flags] });
}

// Opens a file. complaints: console errors and warnings, exceptions, and every request
// but that for the file itself.
export async function open(browser, path, { width = 1280, height = 1000, hash = '', ...viewport } = {}) {
  const page = await browser.newPage();
  const complaints = [];
  const url = pathToFileURL(path).href;
  page.on('console', (message) => {
    if (['error', 'warn', 'warning'].includes(message.type()) && !isOfTheDriver(message.text()))
      complaints.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => complaints.push(`exception: ${error.message}`));
  page.on('request', (request) => {
    if (request.url().split('#')[0] !== url) complaints.push(`request: ${request.url().slice(0, 200)}`);
  });
  await page.setViewport({ width, height, ...viewport });
  await page.goto(url + hash, { timeout: kPatience });
  await page.waitForFunction('window.holdfastReport?.isReady', { timeout: kPatience }).catch((error) => {
    throw new Error(`${error.message}\n${complaints.join('\n')}`);
  });
  await drawn(page);
  return { page, complaints };
}

// Software rendering is slow to read back, which Chromium says of our own screenshots.
function isOfTheDriver(text) {
  return text.includes('GPU stall due to ReadPixels');
}

// What was asked for is on the screen.
export async function drawn(page) {
  await page.evaluate(() => new Promise((done) => {
    requestAnimationFrame(() => requestAnimationFrame(done));
  }));
}

export function run(program, ...args) {
  const { status, stderr } = spawnSync(program, args, { encoding: 'utf8' });
  if (status !== 0) throw new Error(`${program} ${args.join(' ')}: ${stderr}`);
  return stderr;
}
