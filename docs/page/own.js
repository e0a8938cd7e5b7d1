// Pictures of a visitor's own: motion by blocks that match, then `tap`. Nothing leaves the machine.
import { bindGroups } from './gpu.js';
import { Panel } from './panel.js';
import { groupZero, shutterOf } from './uniforms.js';

const MOST = 960, MOST_SLOW = 320; // pixels of the longer side, with a GPU and without
const COARSEST = 40; // pixels of the longer side
const REACH = 6; // pixels of the coarsest level: a fifth of the picture
const SEARCH = 'hosts/block_search.wgsl';
const TAP = 'methods/tap.wgsl';
const LINEAR = Uint16Array.from({ length: 256 }, (_, n) => half(n <= 10 ? n / 255 / 12.92 : ((n / 255 + 0.055) / 1.055) ** 2.4));

/** The bits of a half float, 0 to 1. */
function half(x) {
  if (x < 2 ** -14) return Math.round(x * 2 ** 24);
  const exponent = Math.floor(Math.log2(x));
  return ((exponent + 15) << 10) + Math.round((x / 2 ** exponent - 1) * 1024);
}

/** The size at which a picture is blurred. */
export function sizeOf(width, height, isSlow) {
  const scale = Math.min(1, (isSlow ? MOST_SLOW : MOST) / Math.max(width, height));
  return [width, height].map((n) => Math.max(2, Math.round(n * scale)));
}

/** The pixels (ImageData) of an image or a video, drawn at a size. */
export function pixelsOf(source, [width, height]) {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(source, 0, 0, width, height);
  return context.getImageData(0, 0, width, height);
}

/** A video of which single pictures are asked for. */
export class Film {
  static async open(file) {
    const video = document.createElement('video');
    Object.assign(video, { muted: true, playsInline: true, preload: 'auto', src: URL.createObjectURL(file) });
    await new Promise((resolve, reject) => {
      video.onloadeddata = resolve;
      video.onerror = () => reject(new Error(`${file.name}: this browser does not play it`));
    });
    return new Film(video);
  }

  constructor(video) {
    this.video = video;
  }

  /** The pixels that are shown at a time [s]. */
  async at(time, size) {
    const { video } = this;
    const wanted = Math.min(Math.max(time, 0), Math.max(video.duration - 1e-3, 0));
    if (Math.abs(video.currentTime - wanted) > 1e-4) {
      await new Promise((resolve) => {
        video.addEventListener('seeked', resolve, { once: true });
        video.currentTime = wanted;
      });
    }
    return pixelsOf(video, size);
  }

  close() {
    URL.revokeObjectURL(this.video.src);
    this.video.removeAttribute('src');
  }
}

export class Own {
  constructor(gpu, canvas, { native = false } = {}) {
    Object.assign(this, { gpu, canvas, native, panel: new Panel(gpu, canvas), made: [], queue: Promise.resolve() });
  }

  /** Find the motion of `here` (ImageData) to `next`, and to `before` if there is one. */
  load(here, next, before = null) {
    this.queue = this.queue.then(() => this.#load(here, next, before));
    return this.queue;
  }

  /** Blur and show it; the sharp picture is left of the line. */
  draw(state) {
    this.queue = this.queue.then(() => (this.size ? this.#draw(state) : null));
    return this.queue;
  }

  #texture(size, format, label) {
    const { TEXTURE_BINDING, STORAGE_BINDING, COPY_DST } = GPUTextureUsage;
    const usage = TEXTURE_BINDING | COPY_DST | (format === 'r32uint' || format === 'rgba8unorm' ? 0 : STORAGE_BINDING);
    const texture = this.gpu.device.createTexture({ label, size, format, usage });
    this.made.push(texture);
    return texture;
  }

  #uploaded(size, format, bytes) {
    const texture = this.#texture(size, format, 'picture');
    this.gpu.device.queue.writeTexture({ texture }, bytes, { bytesPerRow: bytes.byteLength / size[1] }, size);
    return texture;
  }

  /** Run one pass into a new texture, or into `output`. */
  async #run(encoder, { file, texels = {}, constants = {} }, entry, size, zero, resources, output) {
    const kernel = await this.gpu.kernels.get({ file, texels, constants });
    const made = output ?? this.#texture(size, texels.Output ?? 'rgba32float', entry);
    const given = { ...resources, output: made };
    const bound = Object.fromEntries(Object.entries(given).map(([name, one]) => [name, one instanceof GPUTexture ? one.createView() : one]));
    for (const [name, bytes] of Object.entries(zero)) bound[name] = { buffer: this.#buffer(bytes) };
    const [x, y] = this.gpu.shaders[file].workgroup;
    const pass = encoder.beginComputePass({ label: `${file}:${entry}` });
    pass.setPipeline(kernel.pipelines[entry]);
    bindGroups(this.gpu.device, kernel, bound).forEach((group, i) => pass.setBindGroup(i, group));
    pass.dispatchWorkgroups(Math.ceil(size[0] / x), Math.ceil(size[1] / y));
    pass.end();
    return made;
  }

  #buffer(bytes) {
    const { UNIFORM, STORAGE, COPY_DST } = GPUBufferUsage;
    const buffer = this.gpu.device.createBuffer({ size: Math.ceil(bytes.byteLength / 16) * 16, usage: UNIFORM | STORAGE | COPY_DST });
    this.gpu.device.queue.writeBuffer(buffer, 0, bytes);
    this.made.push(buffer);
    return buffer;
  }

  /** Smaller and smaller copies, the largest first. */
  async #pyramid(encoder, picture, size) {
    const levels = [{ texture: picture, size }];
    while (Math.max(...size) > COARSEST) {
      size = size.map((n) => Math.max(1, n >> 1));
      const first = levels.at(-1).texture;
      const texture = await this.#pass(encoder, 'shrink', size, { first });
      levels.push({ texture, size });
    }
    return levels;
  }

  /** A pass of the block search; what it does not read is anything. */
  #pass(encoder, entry, size, given, reach = 0) {
    const { frame } = groupZero({ width: size[0], height: size[1], shutter: shutterOf({}) });
    const resources = { second: given.first, found: given.first, other: given.first, ...given };
    return this.#run(encoder, { file: SEARCH, constants: { REACH: reach } }, entry, size, { frame }, resources);
  }

  /** Displacements from one pyramid to another, at half the size of the pictures. */
  async #flow(encoder, from, to) {
    let found = null;
    for (let level = from.length - 1; level >= Math.min(1, from.length - 1); level--) {
      const { texture: first, size } = from[level], second = to[level].texture;
      const raw = await this.#pass(encoder, 'search', size, { first, second, found: found ?? first }, found ? 0 : REACH);
      found = await this.#pass(encoder, 'smooth_out', size, { first, found: raw });
    }
    return found;
  }

  async #load(here, next, before) {
    const old = this.made;
    this.made = [];
    const size = [here.width, here.height], encoder = this.gpu.device.createCommandEncoder();
    const pyramids = [];
    for (const picture of [here, next, before]) {
      const texture = picture && this.#uploaded(size, 'rgba8unorm', picture.data);
      pyramids.push(texture && await this.#pyramid(encoder, texture, size));
    }
    const ahead = await this.#flow(encoder, pyramids[0], pyramids[1]);
    const back = before && await this.#flow(encoder, pyramids[0], pyramids[2]);
    const motion = await this.#pass(encoder, back ? 'spread' : 'spread_straight', size, { first: ahead, found: ahead, other: back ?? ahead });
    const light = new Uint16Array(4 * size[0] * size[1]).fill(half(1));
    for (let i = 0; i < light.length; i++) if (i % 4 < 3) light[i] = LINEAR[here.data[i]];
    const color = this.#uploaded(size, 'rgba16float', light);
    const nothing = this.#uploaded([1, 1], 'rgba16float', new Uint16Array(4));
    const bends = this.#uploaded([1, 1], 'r32uint', new Uint32Array(1));
    const output = this.#texture(size, 'rgba16float', 'blurred');
    this.gpu.device.queue.submit([encoder.finish()]);
    Object.assign(this, { size, color, motion, nothing, bends, output });
    await this.gpu.device.queue.onSubmittedWorkDone();
    for (const one of old) one.destroy();
  }

  async #draw({ samples, curve2, deg2, line }) {
    const [width, height] = this.size, { device } = this.gpu;
    const shutter = shutterOf({ curve: curve2, degrees: deg2, phase: 'centre' });
    const bytes = groupZero({ width, height, samples, shutter });
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const shown = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => Math.max(2, Math.round(n * ratio)));
    this.panel.resize(this.native ? this.size : shown);
    const frame = new Uint8Array(bytes.frame);
    new DataView(frame.buffer).setUint32(0, this.panel.size[0], true);
    new DataView(frame.buffer).setUint32(4, this.panel.size[1], true);
    const encoder = device.createCommandEncoder(), kept = this.made.length;
    const how = {
      file: TAP, texels: { Output: 'rgba16float' },
      constants: { ADAPTIVE: 0, BOX_SHUTTER: curve2 === 'box' ? 1 : 0, CURVED: 1, FIVE_POSITIONS: 0, PUBLISHED: 0, WEIGHTED: 0 },
    };
    this.sampler ??= device.createSampler({ magFilter: 'linear', minFilter: 'linear' });
    const { color, motion, nothing: weight, bends, sampler: linear, output } = this;
    await this.#run(encoder, how, 'main', this.size, bytes, { color, motion, weight, bends, linear }, output);
    const show = await this.panel.prepare(frame, color, output, line);
    show(encoder);
    device.queue.submit([encoder.finish()]);
    await device.queue.onSubmittedWorkDone();
    for (const buffer of this.made.splice(kept)) buffer.destroy();
    this.canvas.classList.add('drawn');
  }
}
