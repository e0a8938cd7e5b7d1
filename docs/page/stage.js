// The torusphere: one dispatch of methods/volume.wgsl for every frame.
import { bindGroups } from './gpu.js';
import { Buffers, Panel, TEXEL } from './panel.js';
import { groupZero, shutterOf, volumeKernel } from './uniforms.js';

const SCALES = [1, 3 / 4, 1 / 2, 1 / 3, 1 / 4];
const LIMIT = 1000 / 30; // milliseconds that a frame may take while it moves
const LONGEST = 2000; // and while nothing moves

export class Stage {
  /** `fixed`: [width, height] for tests; without, the resolution follows the canvas and its speed. */
  constructor(gpu, canvas, { fixed = null, isSlow = false } = {}) {
    Object.assign(this, { gpu, canvas, fixed, panel: new Panel(gpu, canvas), buffers: new Buffers(gpu.device) });
    this.step = isSlow ? SCALES.length - 1 : 0;
    this.flying = 0; // frames that the device has not finished
    this.slow = this.fast = 0;
    this.refused = -Infinity; // when a greater resolution was last too slow
    this.cost = 0; // milliseconds of the last frame per pixel
  }

  /** Pixels at a scale of the screen's own. */
  size(scale = 1) {
    if (this.fixed) return this.fixed;
    const ratio = Math.min(devicePixelRatio || 1, 2) * scale;
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth, clientHeight].map((n) => Math.max(2, Math.min(8192, Math.round(n * ratio))));
  }

  /** Whether another frame may be sent now. */
  get isFree() {
    return this.flying < 2;
  }

  /** Draw a state. `still`: at the best resolution that LONGEST allows. */
  async draw(state, still = false) {
    let step = this.step;
    if (still && !this.fixed) {
      const fits = (scale) => this.size(scale).reduce((x, y) => x * y) * this.cost < LONGEST;
      step = Math.min(step, Math.max(0, SCALES.findIndex(fits)));
    }
    this.isFull = step === 0 || this.fixed !== null;
    const size = this.size(SCALES[step]);
    const [width, height] = size;
    const shutter = shutterOf({ curve: state.curve, degrees: state.deg, phase: 'centre' });
    const { constants, scene, tables, tiles, groups } = volumeKernel({
      time: state.t, camera: [state.x, state.y], shutter, density: state.density, fps: state.fps, width, height,
    });
    const { frame } = groupZero({ width, height, samples: 16, shutter, number: 0, jitter: 0, maxBlur: null });
    this.flying++;
    try {
      const kernel = await this.gpu.kernels.get({ file: 'methods/volume.wgsl', texels: { Output: TEXEL }, constants });
      if (this.panel.resize(size)) {
        this.output?.destroy();
        this.output = this.gpu.texture(size);
        this.tiled = false;
      }
      const show = await this.panel.prepare(frame, this.output, null, 0);
      if (this.panel.size[0] !== width || this.panel.size[1] !== height) return; // a later frame was faster
      this.buffers.write('frame', frame, GPUBufferUsage.UNIFORM);
      this.buffers.write('scene', scene, GPUBufferUsage.UNIFORM);
      this.buffers.write('tables', tables, GPUBufferUsage.STORAGE);
      if (!this.tiled) this.buffers.write('tiles', tiles, GPUBufferUsage.STORAGE);
      this.tiled = true;
      const key = [kernel, this.output, this.buffers.version];
      if (!this.key || key.some((part, i) => part !== this.key[i])) {
        this.key = key;
        const output = this.output.createView();
        this.groups = bindGroups(this.gpu.device, kernel, { ...this.buffers.resources(), output });
      }
      const began = performance.now(), alone = this.flying === 1;
      const encoder = this.gpu.device.createCommandEncoder();
      const pass = encoder.beginComputePass({ label: 'torusphere' });
      pass.setPipeline(kernel.pipelines.main);
      this.groups.forEach((group, i) => pass.setBindGroup(i, group));
      pass.dispatchWorkgroups(...groups);
      pass.end();
      show(encoder);
      this.gpu.device.queue.submit([encoder.finish()]);
      await this.gpu.device.queue.onSubmittedWorkDone();
      this.canvas.classList.add('drawn');
      if (alone) this.#timed(performance.now() - began, width * height, still);
    } finally {
      this.flying--;
    }
  }

  /** Take the next resolution when frames are late, and the former when there is time to spare. */
  #timed(took, pixels, still) {
    this.cost = took / pixels;
    if (still || this.fixed) return;
    const now = performance.now();
    this.slow = took > LIMIT ? this.slow + 1 : 0;
    this.fast = took < LIMIT / 4 ? this.fast + 1 : 0;
    if (this.slow >= 4 && this.step < SCALES.length - 1) {
      this.step++;
      this.slow = 0;
      this.refused = now;
    } else if (this.fast >= 60 && this.step > 0 && now - this.refused > 10000) {
      this.step--;
      this.fast = 0;
    }
  }
}
