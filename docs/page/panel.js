// The device, the kernels and buffers made on it, and the way of a texture to a canvas.
import { bindGroups } from './gpu.js';
import { Kernels } from './replay.js';
import { packed } from './uniforms.js';

export const TEXEL = 'rgba16float'; // needs no feature that a device may lack

/** A device, or null where there is none. */
export async function openDevice() {
  const adapter = await navigator.gpu?.requestAdapter().catch(() => null);
  const device = await adapter?.requestDevice().catch(() => null);
  if (!device) return null;
  const { architecture = '', vendor = '', isFallbackAdapter = false } = adapter.info ?? {};
  return { device, isSlow: isFallbackAdapter || /swiftshader|llvmpipe|software/i.test(architecture + vendor) };
}

export class Gpu {
  constructor(device, exported) {
    Object.assign(this, { device, shaders: exported.shaders });
    this.kernels = new Kernels(device, exported.shaders);
    this.format = navigator.gpu.getPreferredCanvasFormat();
    const blit = exported.shaders['viewer/draw/blit.wgsl'];
    const module = device.createShaderModule({ code: blit.text, label: 'viewer/draw/blit.wgsl' });
    this.blit = device.createRenderPipelineAsync({
      layout: 'auto',
      vertex: { module, entryPoint: 'corner' },
      fragment: { module, entryPoint: 'texel', targets: [{ format: this.format }] },
    });
  }

  texture([width, height]) {
    const { TEXTURE_BINDING, STORAGE_BINDING } = GPUTextureUsage;
    return this.device.createTexture({ size: [width, height], format: TEXEL, usage: TEXTURE_BINDING | STORAGE_BINDING });
  }
}

/** Buffers by the names of their bindings: written every frame, made anew only to grow. */
export class Buffers {
  #made = new Map();
  #device;

  constructor(device) {
    this.#device = device;
    this.version = 0; // changes when a buffer is another, and bind groups must be too
  }

  write(name, bytes, usage) {
    const size = Math.ceil(bytes.byteLength / 16) * 16;
    let one = this.#made.get(name);
    if (!one || one.size !== size) {
      one?.destroy();
      one = this.#device.createBuffer({ label: name, size, usage: usage | GPUBufferUsage.COPY_DST });
      this.#made.set(name, one);
      this.version++;
    }
    this.#device.queue.writeBuffer(one, 0, bytes);
  }

  resources() {
    return Object.fromEntries([...this.#made].map(([name, buffer]) => [name, { buffer }]));
  }
}

/** A canvas that shows one texture, or two on either side of a line. */
export class Panel {
  constructor(gpu, canvas) {
    Object.assign(this, { gpu, canvas, buffers: new Buffers(gpu.device), size: [0, 0] });
    this.context = canvas.getContext('webgpu');
    this.context.configure({ device: gpu.device, format: gpu.format, alphaMode: 'opaque' });
  }

  /** Whether that was another size. */
  resize([width, height]) {
    if (this.size[0] === width && this.size[1] === height) return false;
    this.size = [width, height];
    [this.canvas.width, this.canvas.height] = this.size;
    this.shown?.destroy();
    this.shown = this.gpu.texture(this.size);
    return true;
  }

  /** Record what brings `first`, and right of `line` [0..1] `second`, to the canvas. */
  async prepare(frame, first, second, line) {
    const [width, height] = this.size;
    const same = first.width === width && first.height === height;
    const taps = same ? 0 : Math.ceil(first.width / width);
    const kernel = await this.gpu.kernels.get({
      file: 'viewer/draw/compose.wgsl', texels: {}, constants: { COMPARE: second ? 1 : 0, TAPS: taps },
    });
    const blit = await this.gpu.blit;
    return (encoder) => {
      const nowhere = [-9, -9, 0, 0];
      this.buffers.write('frame', frame, GPUBufferUsage.UNIFORM);
      this.buffers.write('view', packed('viewer/draw/compose.wgsl', 'View', {
        area: [0, 0, width, height], place: [0, 0, width, height], key: nowhere, wheel: [-9, -9, 1, 1],
        line: line * width, thick: 0, exposure: 1, gain: 1, middle: 1, fastest: 1,
      }), GPUBufferUsage.UNIFORM);
      const key = [kernel, first, second, this.shown, this.buffers.version];
      if (!this.key || key.some((part, i) => part !== this.key[i])) {
        this.key = key;
        this.groups = bindGroups(this.gpu.device, kernel, {
          ...this.buffers.resources(),
          first: first.createView(), second: (second ?? first).createView(), picture: this.shown.createView(),
        });
        this.picture = this.gpu.device.createBindGroup({
          layout: blit.getBindGroupLayout(0), entries: [{ binding: 0, resource: this.shown.createView() }],
        });
      }
      const [x, y] = this.gpu.shaders['viewer/draw/compose.wgsl'].workgroup;
      const compose = encoder.beginComputePass();
      compose.setPipeline(kernel.pipelines.main);
      this.groups.forEach((group, i) => compose.setBindGroup(i, group));
      compose.dispatchWorkgroups(Math.ceil(width / x), Math.ceil(height / y));
      compose.end();
      const view = this.context.getCurrentTexture().createView();
      const pass = encoder.beginRenderPass({ colorAttachments: [{ view, loadOp: 'clear', storeOp: 'store' }] });
      pass.setPipeline(blit);
      pass.setBindGroup(0, this.picture);
      pass.draw(3);
      pass.end();
    };
  }
}
