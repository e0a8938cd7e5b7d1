// What Python computes for a frame before the GPU begins, again in JavaScript: pure functions that give the bytes
// of buffers. Numbers are doubles until they are stored, as in Python; tests/test_page_uniforms.py compares the bytes.
// Struct offsets, workgroups and constants come from tools/page/page_export.py; names are those of the Python modules.

let shaders, K;     // of the export: its shaders, its constants

/// Takes what tools/page/page_export.py exports; call it before anything else.
export function setExport(exported) {
  shaders = exported.shaders;
  K = exported.constants;
}

const { PI, abs, ceil, cos, exp, floor, max, min, sin, sqrt } = Math;
const TURN = 2 * PI;

// ---- arithmetic as Python has it ---------------------------------------------------------

/// a % b for b > 0: never negative.
function modulo(a, b) {
  const rest = a % b;
  return rest < 0 ? rest + b : rest + 0;    // + 0: -0 becomes 0
}

/// To the nearest integer, halves to the even one.
function rounded(x) {
  const low = floor(x), part = x - low;
  return part < 0.5 || (part === 0.5 && low % 2 === 0) ? low : low + 1;
}

/// steps + 1 numbers from 0 to 1.
function shares(steps) {
  const x = Float64Array.from({ length: steps + 1 }, (_, i) => i * (1 / steps));
  x[steps] = 1;
  return x;
}

/// y of `ys` at `x` of rising `xs`, linear between them, constant beyond them.
function interpolated(x, xs, ys) {
  const last = xs.length - 1;
  if (x < xs[0]) return ys[0];
  if (x >= xs[last]) return ys[last];
  let low = 0, high = last;                 // xs[low] <= x < xs[high]
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] <= x) low = middle; else high = middle;
  }
  return (ys[high] - ys[low]) / (xs[high] - xs[low]) * (x - xs[low]) + ys[low];
}

// ---- structs -----------------------------------------------------------------------------

/// The bytes of struct `name` of a shader file; fields without a value are 0.
export function packed(file, name, values) {
  const layout = shaders[file].structs[name], bytes = new Uint8Array(layout.size);
  fill(new DataView(bytes.buffer), 0, layout, values);
  return bytes;
}

const SETTERS = { f32: 'setFloat32', i32: 'setInt32', u32: 'setUint32' };

function fill(view, at, layout, values) {
  if (layout.fields) {
    for (const [name, value] of Object.entries(values)) {
      const field = layout.fields[name];
      if (!field) throw Error(`no field ${name}`);
      fill(view, at + field.offset, field, value);
    }
  } else if (layout.of) {
    values.forEach((value, i) => fill(view, at + i * layout.of.size, layout.of, value));
  } else {
    const numbers = layout.shape.length ? values : [values];
    numbers.forEach((number, i) => view[SETTERS[layout.type]](at + 4 * i, number, true));
  }
}

function bytesOf(array) {
  return new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
}

// ---- wgmb/shutter.py ---------------------------------------------------------------------

const CURVES = {
  box: () => 1,
  trapezoid: (x) => min(max(min(x, 1 - x) * 3, 0), 1),
  triangle: (x) => 1 - abs(2 * x - 1),
  cosine: (x) => 1 - cos(2 * PI * x),
  gaussian: (x) => exp(-0.5 * ((x - 0.5) * 6) * ((x - 0.5) * 6)),
};

/// A shutter: `span` [opens, closes] in frame intervals, `weight(x)` of its curve for x from 0 (opens) to 1 (closes)
/// at any scale, `integral()` as [times, shares of the exposure by then], `time(share)`, and `strata(samples)`.
/// `phase`: "start", "centre", "end", or the time of the exposure's middle in frame intervals.
export function shutterOf({ curve = 'box', degrees = 180, phase = 'centre' }) {
  const weight = CURVES[curve];
  if (!weight || !K.CURVES.includes(curve)) throw RangeError(`curve must be one of ${K.CURVES.join(', ')}, got ${curve}`);
  if (!(degrees >= 0 && degrees <= 36000)) throw RangeError(`shutter must be 0 to 36000 degrees, got ${degrees}`);
  const length = degrees / 360, middle = typeof phase === 'number' ? phase : K.PHASES[phase] * length;
  if (!Number.isFinite(middle)) throw RangeError(`phase must be start, centre, end or a number, got ${phase}`);
  const span = [middle - length / 2, middle + length / 2];

  function integral(steps = 4096) {
    const x = shares(steps), w = x.map(weight), share = new Float64Array(steps + 1);
    for (let i = 0; i < steps; i++) share[i + 1] = share[i] + (w[i + 1] + w[i]) / 2;
    const whole = share[steps];
    return [x.map((u) => span[0] + (span[1] - span[0]) * u), share.map((s) => s / whole)];
  }

  let rising;       // the integral without stretches of weight 0, which are jumped over
  function time(share) {
    if (!rising) {
      const [times, share_] = integral();
      const used = (_, i) => share_[i + 1] > share_[i] || share_[i] > share_[i - 1];
      rising = [times.filter(used), share_.filter(used)];
    }
    return interpolated(share, rising[1], rising[0]);
  }

  /// Begin, middle and end of each of `samples` equal shares of the exposure [frame intervals].
  function strata(samples) {
    const edge = (i) => time(i / (2 * samples)), rows = new Float32Array(3 * samples);
    for (let i = 0; i < samples; i++) rows.set([edge(2 * i), edge(2 * i + 1), edge(2 * i + 2)], 3 * i);
    return rows;
  }

  return { curve, degrees, phase, span, weight, integral, time, strata };
}

// ---- wgmb/gpu_frame/bindings.py --------------------------------------------------------------

/// The buffers of bind group 0, by their names in the shaders. `maxBlur` [px], null: unlimited.
export function groupZero({ width, height, samples = K.SAMPLES, shutter, number = 0, jitter = 0, maxBlur = null }) {
  const [opens, closes] = shutter.span, index = modulo(number, 2 ** 32);
  const file = 'methods/tap.wgsl';      // any that binds all three
  return {
    frame: packed(file, 'Frame', {
      size: [width, height], index, samples, jitter, max_blur: maxBlur ?? Infinity,
      origin: [0, 0], display: [width, height],
    }),
    shutter: packed(file, 'Shutter', { span: shutter.span, rolling: [0, 0], step: (closes - opens) / samples }),
    strata: bytesOf(shutter.strata(samples)),
  };
}

// ---- wgmb/scene/torusphere.py ------------------------------------------------------------

function remapped(time) {
  const a = 0.015 * (time + K.BEGIN), s = 0.5 + 3.4 * PI * a / K.HALF;
  return 1.7 * a + 0.06 * sin(s + 0.75 * sin(s + 0.5 * sin(s + 0.3 * sin(s))));
}

function blend(x) {
  const y = 2 * (abs(modulo(x - K.HALF / 4, K.CYCLE) - K.HALF) / K.HALF - 0.5) + 0.5;
  const v = 2 * min(max(y, 0), 1) - 1;
  return 0.5 + v / (v * v + 1);
}

/// Speed [rad/s] and angle [rad] of a body whose phase is x.
function turning(x) {
  if (modulo(x, K.CYCLE) < K.HALF) return [0, 0];
  const speed = 0.04 * K.WHIRL * (cos(TURN * x / K.CYCLE) + 1);
  return [speed, modulo(K.WHIRL * (sin(TURN * x / K.CYCLE) * K.CYCLE / TURN + x) / K.CYCLE, TURN)];
}

/// Sphere, torus and backdrop at `time` [s].
function instant(time) {
  const x = remapped(time), spherePhase = modulo(x, K.CYCLE), torusPhase = modulo(x + K.HALF, K.CYCLE);
  const [sphereSpeed, sphereAngle] = turning(x), [torusSpeed, torusAngle] = turning(x + K.HALF);
  const major = exp(-torusPhase) / (1 + K.KAPPA), u = min(max(spherePhase - K.HALF, 0), 0.2) - 0.1;
  const torusShare = blend(x), torusFacing = blend(x + 0.06);
  const sphere = {
    orbiting: true,
    small: exp(-spherePhase - K.HALF),
    large: (0.5 + 10 * u / (100 * u * u + 1)) * major,
    speed: sphereSpeed,
    phase: sphereAngle,
    opacity: (1 - torusShare) * (1 + 0.00013 * (sphereSpeed * sphereSpeed)),
    facing: 1 - torusFacing,
  };
  const torus = {
    orbiting: false,
    small: major * K.KAPPA,
    large: major,
    speed: -torusSpeed,
    phase: -torusAngle,
    opacity: torusShare * (1.5 + 0.00015 * (torusSpeed * torusSpeed)),
    facing: torusFacing,
    swell: max(1, 8 * (torusPhase - 0.76)),
  };
  const parts = [0, 1 / 3, 2 / 3];
  return {
    volumes: [sphere, torus],
    cells: parts.map((p) => 7 * exp(-modulo(x + K.ZOOM * p, K.ZOOM))),
    weights: parts.map((p) => (1 - cos(TURN * (p + x / K.ZOOM))) / 6),
    strobe: [modulo(83 * time, TURN), 0.05 * (sin(2.2 + TURN * x / K.HALF) + 1)],
    bound: exp(-min(torusPhase, 5 * (K.CYCLE - modulo(x - K.HALF, K.CYCLE)))),
    grain: modulo(rounded(1e3 * time), 2 ** 32),
  };
}

/// Eye and axes of the view, as the shader takes them.
function viewOf(time, [camX, camY], width, height) {
  const yaw = 0.05 * time + 0.75 * PI + camX, raised = 0.75 + camY, zoom = 2;
  const x = K.DISTANCE * cos(raised), y = K.DISTANCE * sin(raised);
  const cy = cos(yaw), sy = sin(yaw), cp = cos(-raised), sp = sin(-raised);
  return {
    eye: [x * sy, y, x * cy],
    right: [cy, 0, -sy].map((k) => k * width / height / zoom),
    up: [sy * sp, cp, cy * sp].map((k) => k / zoom),
    forward: [-(sy * cp), sp, -(cy * cp)],
  };
}

// ---- wgmb/scene/density.py ---------------------------------------------------------------

/// Rotation of a volume within the exposure. A torus has twofold symmetry, which "published" ignores.
function rotationOf(volume, shutter, fps, exact) {
  const symmetry = exact && !volume.orbiting ? 2 : 1;
  const angle = abs(volume.speed) * (shutter.span[1] - shutter.span[0]) / fps;
  const turns = symmetry * angle / TURN;
  return { symmetry, angle, turns, many: turns > K.CLOSED_FROM };
}

/// The shutter's integral, and for each fast volume its periodic sum less the mean.
function tables(shutter, rotations) {
  if (K.CLOSED.includes(shutter.curve)) return new Float32Array(1);
  const length = K.SHARES + 1, all = new Float32Array((1 + rotations.length) * length);
  const integral = shutter.integral(K.SHARES)[1];
  all.set(integral);
  rotations.forEach((rotation, i) => {
    if (rotation.many) all.set(periodicSum(integral, rotation.turns), (1 + i) * length);
  });
  return all;
}

function periodicSum(integral, turns) {
  const steps = integral.length - 1, total = new Float64Array(steps + 1);
  if (turns > K.MOST_TURNS) return total;
  const edges = shares(steps), reach = ceil(turns / 2) + 1;
  for (let k = -reach; k <= reach; k++) {
    for (let i = 0; i <= steps; i++) total[i] += interpolated((edges[i] + k) / turns + 0.5, edges, integral);
  }
  return total.map((sum, i) => sum - edges[i] - (reach + 0.5));
}

// ---- wgmb/methods/volume.py --------------------------------------------------------------

/// The overrides of methods/volume.wgsl, the bytes of its buffers, and how many workgroups it takes: `scene`,
/// `tables` and `tiles` by their names in the shader. Every tile is drawn, as if volumes and shadows were anywhere.
/// `time` [s]; `camera` [cam_x, cam_y] of the torusphere [rad]; `density` "exact" or "published"; `fps` frames per
/// second, which define the frame interval; the size in pixels.
export function volumeKernel({ time, camera, shutter, density = 'exact', fps, width, height }) {
  const now = instant(time), exact = density === 'exact';
  const volumes = now.volumes.filter((v) => v.opacity || v.facing);     // spheres before tori already
  const rotations = volumes.map((v) => rotationOf(v, shutter, fps, exact));
  const middleOf = (shutter.span[0] + shutter.span[1]) / 2 / fps;
  const closed = K.CLOSED.indexOf(shutter.curve), view = viewOf(time, camera, width, height);
  const l = sqrt(K.LIGHT[0] * K.LIGHT[0] + K.LIGHT[1] * K.LIGHT[1] + K.LIGHT[2] * K.LIGHT[2]);
  const file = 'methods/volume.wgsl';
  const scene = packed(file, 'Volumes', {
    eye: [...view.eye, now.bound],
    right: view.right,
    up: view.up,
    forward: view.forward,
    backdrop: {
      tint: [...K.TINT, K.GROUND],
      light: K.LIGHT.map((k) => k / l),
      cells: now.cells,
      weights: now.weights,
    },
    strobe: now.strobe,
    grain: now.grain,
    volumes: volumes.map((v, i) => volumeRow(v, rotations[i], middleOf, i)),
  });
  const tiles = allTiles(width, height, shaders[file].workgroup), count = tiles.length / 2;
  return {
    constants: {
      CLOUD: 1,
      SHADOW: 1,
      CURVE: closed < 0 ? K.CLOSED.length : closed,
      MANY: +rotations.some((r) => r.many),
      EXACT: +exact,
      ORBITS: volumes.filter((v) => v.orbiting).length,
      TORI: volumes.filter((v) => !v.orbiting).length,
      ROLLING: 0,
      BLENDED: 1,
    },
    scene,
    tables: bytesOf(tables(shutter, rotations)),
    tiles: bytesOf(tiles),
    groups: [min(count, K.TILES_A_ROW), ceil(count / K.TILES_A_ROW)],
  };
}

/// A `Volume` of the shader, in the middle of the exposure.
function volumeRow(v, rotation, middleOf, index) {
  const swept = rotation.angle, angle = (v.phase + v.speed * middleOf) % TURN, c = cos(angle), s = sin(angle);
  const side = v.speed < 0 ? -1 : 1, speed = 30 * swept, half = min(swept / 2, PI / 2), whole = v.large + v.small;
  const row = {
    color: K.COLOR,
    opacity: v.opacity,
    normal_weight: v.facing,
    small: v.small,
    large: v.large,
    turning: {
      rate: 1 / max(rotation.symmetry * swept, K.SLOWEST),
      turns: rotation.turns,
      half: modulo(rotation.turns / 2, 1),
      sum: (index + 1) * (K.SHARES + 1),
    },
  };
  let middle = [0, 0, 0], reach = whole, slab;
  if (v.orbiting) {
    row.turn = [c, -s, -side * s, -side * c];
    const quick = 2 * speed * smoothstep(30, 40, speed);
    row.lead = cos(min(0.004 * (quick + (0.037 * quick) ** 3), PI));
    const far = v.large * cos(half);
    middle = [0 + far * c, 0, 0 + far * -s];
    reach = v.large * sin(half) + v.small;
    slab = [0, 1, 0, v.small];
  } else {
    row.turn = [c, s, -side * s, side * c];
    row.lead = 0.001 * speed;
    row.swell = v.swell;
    slab = [-s, c, 0, v.small + v.large * sin(half)];
  }
  const margin = 1e-5 * whole;
  row.bound = [...middle, v.opacity ? reach + margin : 0];
  row.slab = [slab[0], slab[1], slab[2], slab[3] + margin];
  return row;
}

function smoothstep(a, b, x) {
  const u = min(max((x - a) / (b - a), 0), 1);
  return u * u * (3 - 2 * u);
}

/// Places of all workgroups in the image, in workgroups, row by row.
function allTiles(width, height, [edgeX, edgeY]) {
  const columns = ceil(width / edgeX), rows = ceil(height / edgeY), tiles = new Uint32Array(2 * columns * rows);
  for (let i = 0; i < columns * rows; i++) tiles.set([i % columns, floor(i / columns)], 2 * i);
  return tiles;
}

// ---- wgmb/cli ----------------------------------------------------------------------------

/// The command that makes this very picture, as a line for a shell: `wgmb blur` where the state has an `input`, else
/// `wgmb render` of its `scene`, the torusphere by default. The state's names are those of the functions above; `output` is a file name.
export function commandLine(state) {
  const { shutter: { curve, degrees, phase }, width, height, input, frames, scene = 'torusphere' } = state;
  const words = ['wgmb'], option = (name, value) => words.push(`--${name}`, `${value}`);
  if (input) {
    words.push('blur', input, '-o', state.output ?? 'blurred.png');
    if (frames !== undefined) option('frames', frames);
    option('method', state.method);
    if (state.samples !== undefined) option('samples', state.samples);
    if (state.jitter) option('jitter', state.jitter);
    if (typeof state.maxBlur === 'number') option('max-blur', state.maxBlur);
  } else {
    words.push('render', scene, '-o', state.output ?? `${scene}.png`, `--time=${state.time}`);
    option('size', `${width}x${height}`);
    if (state.antialias) option('antialias', state.antialias);
    option('fps', state.fps);
    if (state.method) option('method', state.method);
    if (state.samples !== undefined) option('samples', state.samples);
    state.camera?.forEach((angle, i) => { if (angle) option('set', `cam_${'xy'[i]}=${angle}`); });
    if (state.density && state.density !== 'exact') option('set', `density=${state.density}`);
  }
  option('shutter', degrees);
  option('curve', curve);
  if (phase !== 'centre') words.push(`--phase=${phase}`);
  return words.map((word) => (/^[\w./:=,@%+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`)).join(' ');
}
