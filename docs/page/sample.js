// A frame that was rendered sharp, and the same frame blurred: the passes that Python recorded.
import { Panel } from './panel.js';
import { Replay } from './replay.js';
import { groupZero, shutterOf } from './uniforms.js';

const KEPT = 3; // choices whose textures stay on the device

export class Sample {
  constructor(gpu, canvas, recordings, { native = false } = {}) {
    Object.assign(this, { gpu, canvas, recordings, native, panel: new Panel(gpu, canvas) });
    this.choices = new Map();
    this.once = Replay.create(gpu.kernels, recordings.once).then((once) => {
      this.#submit((encoder) => once.encode(encoder));
      return once;
    });
  }

  #submit(record) {
    const encoder = this.gpu.device.createCommandEncoder();
    record(encoder);
    this.gpu.device.queue.submit([encoder.finish()]);
  }

  async #choice(name) {
    const once = await this.once;
    const found = this.choices.get(name) ?? Replay.create(this.gpu.kernels, this.recordings.choices[name], once);
    this.choices.delete(name);
    this.choices.set(name, found); // the last one used is the last
    return found;
  }

  #forget() {
    for (const [name, one] of this.choices) {
      if (this.choices.size <= KEPT) return;
      this.choices.delete(name);
      one.then((replay) => replay.destroy());
    }
  }

  /** Blur if anything but the line has changed, and show both sides of it. One at a time, the last wins. */
  async draw(state) {
    this.wanted = { ...state };
    this.running ??= this.#run().finally(() => (this.running = null));
    await this.running;
  }

  async #run() {
    while (this.wanted) {
      const state = this.wanted;
      this.wanted = null;
      await this.#drawn(state);
    }
  }

  async #drawn({ method, samples, curve2, deg2, line }) {
    const [width, height] = this.recordings.size;
    const once = await this.once;
    const shutter = shutterOf({ curve: curve2, degrees: deg2, phase: 'centre' });
    const bytes = groupZero({ width, height, samples, shutter, number: 0, jitter: 0, maxBlur: null });
    const replay = await this.#choice(`${method} ${curve2 === 'box' ? 'box' : 'cosine'} ${samples}`);
    const done = [method, samples, curve2, deg2].join();
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const { clientWidth, clientHeight } = this.canvas;
    const shown = [clientWidth, clientHeight].map((n) => Math.max(2, Math.round(n * ratio)));
    this.panel.resize(this.native ? [width, height] : shown);
    const frame = new Uint8Array(bytes.frame);
    new DataView(frame.buffer).setUint32(0, this.panel.size[0], true);
    new DataView(frame.buffer).setUint32(4, this.panel.size[1], true);
    const show = await this.panel.prepare(frame, once.output, replay.output, line);
    this.#submit((encoder) => {
      if (this.done !== done) {
        for (const name of Object.keys(replay.recording.groupZero)) replay.set(name, bytes[name]);
        replay.encode(encoder);
        this.done = done;
      }
      show(encoder);
    });
    this.#forget();
    await this.gpu.device.queue.onSubmittedWorkDone();
    this.canvas.classList.add('drawn');
  }
}
