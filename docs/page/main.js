// The page's behaviour: controls and address change one state, and what depends on it is drawn again.
import { MEDIA, unpacked } from './packed.js';
import { Gpu, openDevice } from './panel.js';
import { Film, Own, pixelsOf, sizeOf } from './own.js';
import { Sample } from './sample.js';
import { showSource } from './source.js';
import { Stage } from './stage.js';
import { after, clamp, DEFAULTS, parsed, within, written } from './state.js';
import { drawStrip, verdict } from './strip.js';
import { commandLine, setExport, shutterOf } from './uniforms.js';

const $ = (id) => document.getElementById(id);
const root = document.documentElement;
const calm = matchMedia('(prefers-reduced-motion: reduce)');
const LOOP = 50; // seconds
const METHODS = {
  tap: '<b>tap</b> averages along each pixel’s own path. It is the cheapest method. Look at the outlines: the blur ends there, and nothing of the background shows through.',
  tiles: '<b>tiles</b> also follows the fastest motion nearby. Look at the outlines: they are soft now. Where two motions meet, only one of them is followed.',
  gather: '<b>gather</b> asks three frames which surface is at a pixel at each moment. Look behind the crate and the balls: what they hid is there, and every surface keeps its own motion.',
};

// For tests: size=640x360 in the address draws exactly that many pixels, whatever the canvas measures.
const fixed = /(?:^|&)size=(\d+)x(\d+)/.exec(location.hash.slice(1))?.slice(1).map(Number) ?? null;
const state = { ...DEFAULTS, still: calm.matches ? 1 : 0, ...parsed(location.hash) };
const view = { stage: null, sample: null, own: null, given: null, seen: true, seenSample: false, flipped: false, losses: 0, dirty: true };
const errors = [];
window.wgmb = { state, view, errors, settled };

// ---- beginning ---------------------------------------------------------------------------

async function begin() {
  const opened = await openDevice();
  if (!opened) return fallBack();
  const { device, isSlow } = opened;
  device.addEventListener('uncapturederror', (event) => tell(event.error.message));
  device.lost.then(() => lost());
  const [exported, recordings] = await Promise.all([unpacked('exported'), unpacked('recordings')]);
  setExport(exported);
  Object.assign(view, { device, gpu: new Gpu(device, exported), recordings, isSlow, sample: null, own: null, dirty: true });
  root.dataset.mode = 'live';
  for (const id of ['torusphere', 'sample', 'own']) fresh(id);
  view.stage = new Stage(view.gpu, $('torusphere'), { fixed, isSlow });
  if (!$('files').childElementCount) showSource(exported.shaders, $('source-lead'), $('files'));
  listenToCanvas();
  update();
  await view.stage.draw(shown(), true);
  if (view.seenSample) blurSample();
  if (view.given) showOwn().catch(refuse);
  root.dataset.ready = '1';
}

/** A canvas that no lost device has drawn on. */
function fresh(id) {
  const old = $(id), made = old.cloneNode();
  made.classList.remove('drawn');
  old.replaceWith(made);
}

async function lost() {
  if (view.losses++ > 0) return fallBack('The GPU was lost twice, so you see a recording; reload the page to try again.');
  view.stage = view.sample = null;
  await begin().catch(failed);
}

function failed(error) {
  tell(error.message);
  fallBack('The GPU could not draw this page, so you see a recording.');
}

function tell(message) {
  errors.push(message);
  console.error(message);
  $('trouble').hidden = false;
  $('messages').textContent = errors.join('\n\n');
}

/** Without WebGPU: a recording of the torusphere, and the line between two images. */
function fallBack(why = 'This browser does not offer WebGPU, so you see a recording; current versions of Chrome, Edge, Safari and Firefox (on Windows, and on Macs with Apple processors) draw it live.') {
  view.stage = view.sample = null;
  root.dataset.mode = 'recording';
  root.dataset.ready = 'recording';
  $('note').textContent = why;
  $('note').hidden = false;
  for (const id of ['torusphere', 'sample']) fresh(id);
  $('torusphere').hidden = $('sample').hidden = true;
  $('method-tag').textContent = 'With motion blur (gather)';
  if ($('stage').querySelector('video')) return;
  const video = document.createElement('video');
  Object.assign(video, { src: MEDIA.video, muted: true, loop: true, playsInline: true, controls: calm.matches });
  video.setAttribute('aria-label', $('torusphere').getAttribute('aria-label'));
  $('poster').after(video);
  if (!calm.matches) video.play().catch(() => { video.controls = true; });
}

// ---- drawing -----------------------------------------------------------------------------

/** The state with the density that is flipped while E is held. */
function shown() {
  return view.flipped ? { ...state, density: after('density', state.density) } : state;
}

let last = null; // when the present frame began, while playing
let quiet = 0; // when something last changed
let tries = 0; // to draw it finer since then

function tick(now) {
  requestAnimationFrame(tick);
  const { stage } = view;
  if (!stage || document.hidden || !view.seen) { last = null; return; }
  if (!state.still) {
    const length = 1000 / state.fps;
    last ??= now - length;
    const due = Math.floor((now - last) / length + 0.02);
    if (due > 0 && stage.isFree) {
      last += due * length;
      // Frames that came too late are left out, but nobody wants a leap after a pause.
      state.t = (onFrame(state.t) + Math.min(due, state.fps / 2) / state.fps) % LOOP;
      view.dirty = true;
    }
  } else last = null;
  if (view.dirty && stage.isFree) {
    view.dirty = false;
    quiet = now;
    tries = 0;
    showTime();
    stage.draw(shown()).catch(failed);
  } else if (quiet && state.still && !view.dirty && now - quiet > 250 && stage.flying === 0) {
    // Nothing moves: once more, finer; the first frame's time, with its compilation, can mislead.
    quiet = tries++ > 0 && (stage.isFull || tries > 3) ? 0 : now;
    if (quiet) stage.draw(shown(), true).catch(failed);
  }
}

/** The instant of the nearest frame. */
const onFrame = (t) => Math.round(t * state.fps) / state.fps;

function blurSample() {
  if (!view.gpu || root.dataset.mode !== 'live' || !view.seenSample) return;
  view.sample ??= new Sample(view.gpu, $('sample'), view.recordings, { native: fixed !== null });
  return view.sample.draw(state).catch((error) => tell(error.message)); // the images stay
}

/** Take files of a visitor: a video, or pictures, of which the first two or three count. */
async function take(files) {
  const films = files.filter((file) => file.type.startsWith('video/')), images = files.filter((file) => file.type.startsWith('image/'));
  if (!films.length && images.length < 2) throw new Error('Motion needs two pictures that follow one another, or a video.');
  view.given?.film?.close();
  if (films.length) {
    const film = await Film.open(films[0]);
    const { videoWidth, videoHeight, duration } = film.video;
    view.given = { film, size: sizeOf(videoWidth, videoHeight, view.isSlow) };
    $('own-time').max = duration;
    $('own-time').value = duration / 2;
  } else {
    const chosen = images.slice(0, 3).sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
    const maps = await Promise.all(chosen.map((file) => createImageBitmap(file).catch(() => { throw new Error(`${file.name}: this browser cannot read it.`); })));
    const { width, height } = maps[0], other = maps.findIndex((one) => one.width !== width || one.height !== height);
    if (other > 0) throw new Error(`${chosen[other].name} is ${maps[other].width} × ${maps[other].height}, ${chosen[0].name} ${width} × ${height}: pictures that follow one another have one size.`);
    const size = sizeOf(width, height, view.isSlow);
    view.given = { size, pixels: maps.map((one) => pixelsOf(one, size)) };
  }
  await showOwn();
}

/** Find the motion of what was given, at the time that is chosen, and show it blurred. */
async function showOwn() {
  const { film, size, pixels } = view.given;
  $('own-note').hidden = true;
  $('own-wipe').hidden = false;
  $('own-controls').hidden = !film;
  $('own-wipe').style.setProperty('--aspect', `${size[0]} / ${size[1]}`);
  let [before, here, next] = film ? [] : pixels.length > 2 ? pixels : [null, ...pixels];
  if (film) {
    const time = Number($('own-time').value), step = 1 / Math.max(1, Number($('own-fps').value) || 30);
    $('own-time-shown').textContent = `${time.toFixed(2)} s`;
    part($('own-time'));
    before = await film.at(time - step, size);
    here = await film.at(time, size);
    next = await film.at(time + step, size);
  }
  view.own ??= new Own(view.gpu, $('own'), { native: fixed !== null });
  await view.own.load(here, next, before);
  await view.own.draw({ ...state });
}

function refuse(error) {
  $('own-note').textContent = error.message;
  $('own-note').hidden = false;
}

let asked = null; // the last wish while another is being shown
/** The same once more, with another time or setting. */
function againOwn(anew) {
  if (!view.given || !view.own) return;
  asked = { anew: anew || asked?.anew };
  view.busyOwn ??= (async () => {
    while (asked) {
      const { anew: whole } = asked;
      asked = null;
      await (whole ? showOwn() : view.own.draw({ ...state }));
    }
  })().catch(refuse).finally(() => (view.busyOwn = null));
}

/** For tests: until everything that was asked for, and is in sight, is on the canvases. */
async function settled() {
  const busy = () => view.stage && (view.stage.flying || view.busyOwn || view.sample?.running || (view.seen && (view.dirty || quiet)));
  do await new Promise(requestAnimationFrame); while (busy());
}

const style = {};
function readStyle() {
  const said = getComputedStyle(root);
  for (const name of ['accent', 'cool', 'rule', 'text', 'soft']) style[name] = said.getPropertyValue(`--${name}`);
  style.font = `11px ${said.getPropertyValue('--mono')}`;
}

/** What follows the time: the clock, both bars, the command. */
function showTime() {
  const frame = Math.round(state.t * state.fps);
  view.unit = drawStrip($('curve'), state, style);
  $('time').value = state.t;
  part($('time'));
  $('clock').textContent = `${state.t.toFixed(2).padStart(5, '\u2007')} s · frame ${String(frame).padStart(4, '\u2007')}`;
  $('strip').setAttribute('aria-valuenow', state.t.toFixed(2));
  $('strip').setAttribute('aria-valuetext', `${state.t.toFixed(2)} seconds, frame ${frame}`);
  if (state.still || performance.now() - (view.commanded ?? -1e3) > 500) command();
}

function command() {
  view.commanded = performance.now();
  const shutter = shutterOf({ curve: state.curve, degrees: state.deg });
  const round = (x) => Number(x.toFixed(4));
  const [width, height] = view.stage?.size() ?? [1280, 720];
  say($('command'), commandLine({
    time: round(state.t), camera: [round(state.x), round(state.y)], shutter, density: state.density, fps: state.fps,
    width, height,
  }));
}

/** Show a command whose options are not broken. */
function say(place, line) {
  const parts = line.split(/ (?=-)/).map((text) => Object.assign(document.createElement('span'), { textContent: text }));
  place.replaceChildren(...parts.flatMap((one, i) => (i ? [' ', one] : [one])));
}

const part = (range) => range.style.setProperty('--part', `${100 * (range.value - range.min) / (range.max - range.min)}%`);

/** Everything that shows the state, after any change of it; `remember` it in the address. */
function update(remember = false) {
  for (const name of ['curve', 'fps', 'density', 'method', 'samples', 'curve2']) {
    for (const input of document.getElementsByName(name)) input.checked = input.value === String(shown()[name]);
  }
  for (const [id, name] of [['degrees', 'deg'], ['degrees2', 'deg2']]) {
    $(id).value = state[name];
    $(`${id}-shown`).textContent = `${Math.round(state[name])}°`;
    part($(id));
  }
  $('play-icon').setAttribute('d', state.still ? 'M8 5v14l11-7z' : 'M7 5h3.5v14H7zM13.5 5H17v14h-3.5z');
  $('play').setAttribute('aria-label', state.still ? 'Play' : 'Pause');
  $('method-text').innerHTML = METHODS[state.method];
  $('method-tag').textContent = `${state.method}, ${Math.round(state.deg2)}°`;
  showLine();
  if (view.gpu) {
    $('verdict').innerHTML = verdict(shutterOf({ curve: state.curve, degrees: state.deg }), state.deg);
    const { recordings } = view;
    say($('command2'), commandLine({
      scene: recordings.scene, time: recordings.time, width: recordings.size[0], height: recordings.size[1],
      antialias: recordings.antialias, fps: 24, method: state.method, samples: state.samples,
      shutter: shutterOf({ curve: state.curve2, degrees: state.deg2 }),
    }));
    showTime();
    command();
  }
  view.dirty = true;
  if (remember) address();
}

function showLine() {
  for (const id of ['wipe', 'own-wipe']) $(id).style.setProperty('--line', `${100 * state.line}%`);
  $('line').setAttribute('aria-valuenow', Math.round(100 * state.line));
  document.querySelector('.tag.left').classList.toggle('away', state.line < 0.2);
  document.querySelector('.tag.right').classList.toggle('away', state.line > 0.75);
}

let waiting = null;
/** Browsers refuse addresses that change too often. */
function address() {
  waiting ??= setTimeout(() => {
    waiting = null;
    const text = written(state) + (fixed ? `&size=${fixed.join('x')}` : '');
    try { history.replaceState(null, '', text); } catch { /* an address that cannot change is no harm */ }
  }, 300);
}

/** Change the state, and show it. */
function change(changed) {
  Object.assign(state, changed);
  update(true);
  if (['method', 'samples', 'deg2', 'curve2', 'line'].some((name) => name in changed)) {
    blurSample();
    againOwn(false);
  }
}

function step(frames) {
  change({ still: 1, t: ((onFrame(state.t) + frames / state.fps) % LOOP + LOOP) % LOOP });
}

// ---- hands -------------------------------------------------------------------------------

/** Call `moved(dx, dy, event)` while a pointer drags `element`. */
function onDrag(element, moved, began = () => {}) {
  let from = null;
  element.addEventListener('pointerdown', (event) => {
    if (event.button !== 0 || !event.isPrimary) return;
    from = [event.clientX, event.clientY];
    element.setPointerCapture(event.pointerId);
    began(event);
  });
  element.addEventListener('pointermove', (event) => {
    if (!from || !event.isPrimary) return;
    const [x, y] = from;
    from = [event.clientX, event.clientY];
    moved(event.clientX - x, event.clientY - y, event);
  });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(name, () => { from = null; });
}

const wheel = { owner: null, time: -Infinity };
addEventListener('wheel', ({ target, timeStamp }) => {
  if (timeStamp - wheel.time > 300) wheel.owner = target;
  wheel.time = timeStamp;
}, { capture: true, passive: true });

/** Call `turned` for the wheel above `element`, but not where it scrolls past: the wheel must begin there. */
function onWheel(element, turned) {
  element.addEventListener('wheel', (event) => {
    if (element.contains(wheel.owner)) turned(event);
  }, { passive: false });
}

function turn(dx, dy) {
  change({ x: state.x - dx, y: within('y', state.y + dy) });
}

function listenToCanvas() {
  const canvas = $('torusphere');
  onDrag(canvas, (dx, dy) => {
    $('hint').classList.add('gone');
    turn(dx * 3 / canvas.clientWidth, dy * 2 / canvas.clientHeight);
  });
  // Up and down scrolls the page; to the sides, or with Shift, the wheel turns the scene.
  onWheel(canvas, (event) => {
    const dx = event.shiftKey && !event.deltaX ? event.deltaY : event.deltaX;
    if (Math.abs(dx) <= Math.abs(event.shiftKey ? 0 : event.deltaY)) return;
    event.preventDefault();
    turn(-dx / 400, 0);
  });
}

function listen() {
  $('play').onclick = () => change({ still: 1 - state.still });
  $('back').onclick = () => step(-1);
  $('forward').onclick = () => step(1);
  $('time').oninput = () => change({ still: 1, t: Math.min(onFrame(Number($('time').value)), LOOP - 1 / state.fps) });
  $('degrees').oninput = () => change({ deg: Number($('degrees').value) });
  $('degrees2').oninput = () => change({ deg2: Number($('degrees2').value) });
  for (const [id, name] of [['degrees', 'deg'], ['degrees2', 'deg2']]) {
    onWheel($(id).parentElement, (event) => {
      if (Math.abs(event.deltaY) < Math.abs(event.deltaX)) return;
      event.preventDefault();
      change({ [name]: within(name, state[name] - Math.sign(event.deltaY) * 12) });
    });
  }
  document.addEventListener('change', ({ target }) => {
    if (target.type === 'radio') change(parsed(`${target.name}=${target.value}`));
  });
  let exact = 0; // the strip moves by parts of a frame, the scene by whole ones
  onDrag($('strip'), (dx) => {
    exact = (exact - dx / (view.unit || 80) / state.fps + LOOP) % LOOP;
    if (onFrame(exact) !== state.t) change({ t: onFrame(exact) % LOOP });
  }, () => {
    exact = state.t;
    change({ still: 1 });
  });
  onWheel($('strip'), (event) => {
    event.preventDefault();
    step(Math.sign(event.deltaY + event.deltaX));
  });

  for (const id of ['wipe', 'own-wipe']) {
    const toLine = (event) => {
      const { left, width } = $(id).getBoundingClientRect();
      change({ line: clamp((event.clientX - left) / width, 0, 1) });
    };
    onDrag($(id), (dx, dy, event) => toLine(event), toLine);
  }
  const taken = (list) => { view.busyOwn = take([...list]).catch(refuse).finally(() => (view.busyOwn = null)); };
  $('own-files').onchange = () => taken($('own-files').files);
  for (const name of ['dragover', 'dragleave', 'drop']) {
    $('drop').addEventListener(name, (event) => {
      event.preventDefault();
      $('drop').classList.toggle('over', name === 'dragover');
      if (name === 'drop' && event.dataTransfer.files.length) taken(event.dataTransfer.files);
    });
  }
  for (const id of ['own-time', 'own-fps']) $(id).oninput = () => againOwn(true);
  $('line').addEventListener('keydown', (event) => {
    const by = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    change({ line: clamp(state.line + by, 0, 1) });
  });
  for (const button of $('looks').children) {
    button.onclick = () => {
      change({ ...parsed(button.dataset.look), still: 0 });
      $('stage').scrollIntoView({ behavior: calm.matches ? 'auto' : 'smooth' });
    };
  }
  for (const id of ['copy', 'copy2']) $(id).onclick = () => copy($(id), $(id.replace('copy', 'command')));
  addEventListener('keydown', key);
  addEventListener('keyup', (event) => { if (event.key.toLowerCase() === 'e') flip(false); });
  addEventListener('blur', () => flip(false));
  addEventListener('hashchange', () => change({ ...DEFAULTS, ...parsed(location.hash) }));
  const again = () => {
    readStyle();
    view.dirty = true;
    blurSample();
  };
  addEventListener('resize', again);
  matchMedia('(prefers-color-scheme: light)').addEventListener('change', again);
  new IntersectionObserver(([entry]) => { view.seen = entry.isIntersecting; }).observe($('stage'));
  new IntersectionObserver(([entry]) => {
    view.seenSample = entry.isIntersecting;
    if (view.seenSample) blurSample();
  }, { rootMargin: '300px' }).observe($('wipe'));
}

function flip(on) {
  if (view.flipped === on) return;
  view.flipped = on;
  update();
}

function key(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || root.dataset.mode !== 'live') return;
  const { target } = event, name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const own = { ' ': 'input, summary, button', ArrowLeft: 'input, pre', ArrowRight: 'input, pre' }[name];
  const acts = {
    ' ': () => change({ still: 1 - state.still }),
    ArrowLeft: () => step(-1),
    ArrowRight: () => step(1),
    '[': () => change({ deg: within('deg', state.deg - 30) }),
    ']': () => change({ deg: within('deg', state.deg + 30) }),
    c: () => change({ curve: after('curve', state.curve) }),
    f: () => change({ fps: after('fps', state.fps) }),
    e: () => flip(true),
  };
  if (event.shiftKey) {
    const turns = { ArrowLeft: [0.08, 0], ArrowRight: [-0.08, 0], ArrowUp: [0, -0.05], ArrowDown: [0, 0.05] };
    for (const [way, by] of Object.entries(turns)) acts[way] = () => turn(...by);
  }
  if (!acts[name] || (own && target.matches?.(own))) return;
  event.preventDefault();
  acts[name]();
}

async function copy(button, code) {
  try {
    await navigator.clipboard.writeText(code.textContent);
    button.textContent = 'Copied';
  } catch { // not allowed here: select it instead
    getSelection().selectAllChildren(code);
    button.textContent = 'Selected';
  }
  setTimeout(() => { button.textContent = 'Copy'; }, 1500);
}

readStyle();
listen();
update();
begin().catch(failed);
requestAnimationFrame(tick);
