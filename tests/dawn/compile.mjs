// Compile kernels with Tint, the compiler of Chrome and Dawn, at the standard's default limits; no driver is needed.
//   node compile.mjs < kernels.json      [{name, text, groups, entryPoints, constants}], as tests/standard.py writes it
// Prints {adapter, modules, pipelines, messages: [{name, line, column, text}]}; line is 0 for those of a pipeline.
import fs from 'node:fs';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
const gpu = create(['backend=null']);       // these three stay referenced: else Dawn's own are collected
const adapter = await gpu.requestAdapter();
const device = await adapter.requestDevice();
const kernels = JSON.parse(fs.readFileSync(0, 'utf8'));
const messages = [];
let pipelines = 0;

for (const { name, text, groups, entryPoints, constants } of kernels) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({ code: text, label: name });
  const { messages: found } = await module.getCompilationInfo();
  for (const m of found) messages.push({ name, line: m.lineNum, column: m.linePos, text: `${m.type}: ${m.message}` });
  const refused = await device.popErrorScope();
  if (refused || groups === null) {
    if (refused && !found.length) messages.push({ name, line: 0, column: 0, text: refused.message });
    continue;
  }
  for (const entryPoint of entryPoints) {
    device.pushErrorScope('validation');
    const bindGroupLayouts = groups.map((entries) => device.createBindGroupLayout({ entries }));
    const layout = device.createPipelineLayout({ bindGroupLayouts });
    device.createComputePipeline({ layout, compute: { module, entryPoint, constants } });
    const error = await device.popErrorScope();
    if (error) messages.push({ name: `${name}:${entryPoint}`, line: 0, column: 0, text: error.message });
    pipelines++;
  }
}
process.stdout.write('\nanswer: ' + JSON.stringify({ adapter: adapter.info.description, modules: kernels.length, pipelines, messages }));
process.exit(0);
