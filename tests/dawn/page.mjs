// Visits to the page in Chromium: {page, chromium, visits} as JSON on stdin, what was seen as JSON after "answer: ".
//
// A visit: `hash` of the address, `width` and `height` of the window, `phone`, `webgpu` (with SwiftShader, or the
// null adapter of a Chromium without flags), `script` that runs before the page's own, `media` to emulate, and `steps`:
//   {do: 'shot', file, full}           a screenshot of the window, or of the whole page
//   {do: 'picture', of, file}          a canvas, pixel by pixel, at its own size
//   {do: 'evaluate', script}           its value is the step's result
//   {do: 'drag', of, from, to} {do: 'wheel', of, dx, dy} {do: 'key', name} {do: 'click', of} {do: 'fill', of, value}
import { chromium } from 'playwright-core';

const FLAGS = [
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--use-gl=angle', '--use-angle=swiftshader',
  '--enable-features=Vulkan', '--use-vulkan=swiftshader',
];
const read = async () => {
  const parts = [];
  for await (const part of process.stdin) parts.push(part);
  return JSON.parse(Buffer.concat(parts).toString());
};

async function middle(page, { of, at = [0.5, 0.5] }) {
  const one = page.locator(of);
  await one.scrollIntoViewIfNeeded();
  const box = await one.boundingBox();
  return [box.x + at[0] * box.width, box.y + at[1] * box.height];
}

const DO = {
  async shot(page, { file, full = false }) {
    await page.screenshot({ path: file, fullPage: full });
  },
  async picture(page, { of, file }) {
    const size = await page.evaluate((of_) => {
      const canvas = document.querySelector(of_), { width, height } = canvas;
      canvas.dataset.style = canvas.getAttribute('style') ?? '';
      canvas.style.cssText = `position: fixed; left: 0; top: 0; z-index: 99; width: ${width}px; height: ${height}px`;
      return [width, height];
    }, of);
    await page.evaluate(() => window.wgmb.settled());
    await page.waitForTimeout(200);
    await page.screenshot({ path: file, clip: { x: 0, y: 0, width: size[0], height: size[1] } });
    await page.evaluate((of_) => {
      const canvas = document.querySelector(of_);
      canvas.style.cssText = canvas.dataset.style;
    }, of);
    return size;
  },
  evaluate: (page, { script }) => page.evaluate(script),
  async drag(page, { of, from, to }) {
    await page.mouse.move(...await middle(page, { of, at: from }));
    await page.mouse.down();
    await page.mouse.move(...await middle(page, { of, at: to }), { steps: 4 });
    await page.mouse.up();
  },
  async wheel(page, { of, dx = 0, dy = 0 }) {
    await page.mouse.move(...await middle(page, { of }));
    await page.mouse.wheel(dx, dy);
    await page.waitForTimeout(100);
  },
  key: (page, { name }) => page.keyboard.press(name),
  async click(page, { of }) {
    await page.locator(of).click();
  },
  async fill(page, { of, value }) {
    await page.locator(of).fill(String(value));
  },
};

async function visited(browser, url, visit) {
  const { width = 1280, height = 800, phone = false, hash = '', script, media = {}, steps = [] } = visit;
  const context = await browser.newContext({
    viewport: { width, height }, deviceScaleFactor: phone ? 2 : 1, isMobile: phone, hasTouch: phone, ...media,
  });
  const page = await context.newPage(), said = [], requests = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) said.push(`${message.type()}: ${message.text()}`);
  });
  page.on('pageerror', (error) => said.push(`exception: ${error.stack}`));
  page.on('request', (request) => {
    if (!/^(file|data|blob):/.test(request.url())) requests.push(request.url());
  });
  if (script) await page.addInitScript(script);
  const began = Date.now(), results = [];
  await page.goto(`${url}#${hash}`);
  await page.waitForSelector('html[data-ready]', { timeout: 90000, state: 'attached' });
  const ready = Date.now() - began;
  for (const step of steps) {
    results.push((await DO[step.do](page, step)) ?? null);
    if (step.do !== 'evaluate' && !visit.loose) await page.evaluate(() => window.wgmb.settled());
  }
  const seen = await page.evaluate(() => {
    const root = document.documentElement;
    return {
      mode: root.dataset.mode, errors: window.wgmb.errors, state: window.wgmb.state, address: location.hash,
      wider: root.scrollWidth - root.clientWidth,
    };
  });
  await context.close();
  return { ...seen, said, requests, ready, results };
}

const { page, chromium: executablePath, visits } = await read();
const browsers = new Map(), answer = [];
try {
  for (const visit of visits) {
    const webgpu = visit.webgpu ?? true;
    if (!browsers.has(webgpu)) {
      const args = ['--no-sandbox', '--disable-background-networking', ...(webgpu ? FLAGS : [])];
      browsers.set(webgpu, await chromium.launch({ executablePath, args }));
    }
    answer.push(await visited(browsers.get(webgpu), page, visit));
  }
} finally {
  for (const browser of browsers.values()) await browser.close();
}
console.log(`\nanswer: ${JSON.stringify(answer)}`);
