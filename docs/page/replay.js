// Repeats the passes that Python recorded (tools/page/page_recording.py): the scene once, then one choice of method,
// curve and samples. Nothing is computed here; the caller fills the buffers of group 0, which the shutter changes.
import { bindGroups, makeKernel } from './gpu.js';

const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

/** Kernels that several recordings share. */
export class Kernels {
  #made = new Map();

  constructor(device, shaders) {
    this.device = device;
    this.shaders = shaders;
  }

  get({ file, texels, constants }) {
    const key = JSON.stringify([file, texels, constants]);
    if (!this.#made.has(key)) this.#made.set(key, makeKernel(this.device, this.shaders[file], texels, constants));
    return this.#made.get(key);
  }
}

export class Replay {
  /** `recording`: recordings.once or one of recordings.choices; `once`: the Replay of recordings.once. */
  static async create(kernels, recording, once = null) {
    const replay = new Replay(kernels.device, recording, once);
    await Promise.all(recording.passes.map((row, i) => replay.#prepare(kernels, row, i)));
    return replay;
  }

  constructor(device, recording, once) {
    Object.assign(this, { device, recording, once, steps: [] });
    this.sampler = once?.sampler ?? device.createSampler({ magFilter: 'linear', minFilter: 'linear' });
    this.buffers = recording.buffers.map((b) => this.#buffer(b));
    this.textures = recording.textures.map((t) => this.#texture(t));
  }

  /** The texture of the result; of the scene, the sharp image. Both are rgba16float. */
  get output() {
    return this.#find('textures', this.recording.output ?? this.recording.input);
  }

  /** Fill a buffer of group 0 by the name of its binding. */
  set(name, bytes) {
    this.device.queue.writeBuffer(this.buffers[this.recording.groupZero[name]], 0, bytes);
  }

  /** Record all passes into a GPUCommandEncoder. */
  encode(encoder) {
    for (const step of this.steps) step(encoder);
  }

  /** Let go of all memory on the GPU. */
  destroy() {
    for (const resource of [...this.buffers, ...this.textures]) resource.destroy();
  }

  #buffer({ label, size, data }) {
    const { UNIFORM, STORAGE, INDIRECT, COPY_DST } = GPUBufferUsage;
    const usage = UNIFORM | STORAGE | INDIRECT | COPY_DST;
    const buffer = this.device.createBuffer({ label, size: Math.ceil(size / 16) * 16, usage });
    if (data) this.device.queue.writeBuffer(buffer, 0, padded(bytesOf(data)));
    return buffer;
  }

  #texture({ label, size, format, data }) {
    const { TEXTURE_BINDING, STORAGE_BINDING, COPY_DST, COPY_SRC } = GPUTextureUsage;
    const usage = TEXTURE_BINDING | STORAGE_BINDING | COPY_DST | COPY_SRC;
    const texture = this.device.createTexture({ label, size, format, usage });
    if (data) {
      const bytes = bytesOf(data);
      this.device.queue.writeTexture({ texture }, bytes, { bytesPerRow: bytes.length / size[1] }, size);
    }
    return texture;
  }

  /** A buffer or texture by its number; "once NUMBER" is one of the scene's. */
  #find(kind, number) {
    if (typeof number === 'number') return this[kind][number];
    return this.once[kind][Number(number.split(' ')[1])];
  }

  #resource(said) {
    if (said.sampler) return this.sampler;
    if ('buffer' in said) return { ...said, buffer: this.#find('buffers', said.buffer) };
    const { dimension, first, count } = said;
    return this.#find('textures', said.texture).createView({
      dimension, baseArrayLayer: first, arrayLayerCount: count ?? (dimension === '2d' ? 1 : undefined),
    });
  }

  async #prepare(kernels, row, i) {
    if ('clear' in row) {
      const buffer = this.#find('buffers', row.clear);
      this.steps[i] = (encoder) => encoder.clearBuffer(buffer, row.offset, row.size ?? undefined);
      return;
    }
    if ('copy' in row) {
      const [source, target] = row.copy.map((end) => ({ ...end, texture: this.#find('textures', end.texture) }));
      this.steps[i] = (encoder) => encoder.copyTextureToTexture(source, target, row.size);
      return;
    }
    const kernel = await kernels.get(row.kernel);
    const said = Object.entries(row.resources).map(([name, one]) => [name, this.#resource(one)]);
    const groups = bindGroups(this.device, kernel, Object.fromEntries(said));
    const indirect = row.indirect && this.#find('buffers', row.indirect.buffer);
    this.steps[i] = (encoder) => {
      const pass = encoder.beginComputePass({ label: `${row.kernel.file}:${row.entry}` });
      pass.setPipeline(kernel.pipelines[row.entry]);
      groups.forEach((group, number) => pass.setBindGroup(number, group));
      if (indirect) pass.dispatchWorkgroupsIndirect(indirect, row.indirect.offset);
      else pass.dispatchWorkgroups(...row.workgroups);
      pass.end();
    };
  }
}

function padded(bytes) {
  if (bytes.length % 4 === 0) return bytes;
  const longer = new Uint8Array(Math.ceil(bytes.length / 4) * 4);
  longer.set(bytes);
  return longer;
}
