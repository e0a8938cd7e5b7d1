// Kernels: a shader as tools/page/page_export.py exports it, compiled with its texel formats and constants.

/** The text of a shader with other texel formats, as `{Output: 'rgba16float'}`. */
export function withTexels(text, texels) {
  for (const [alias, texel] of Object.entries(texels)) {
    text = text.replace(new RegExp(`^(alias ${alias} = texture_storage_2d(?:_array)?<)\\w+`, 'm'), `$1${texel}`);
  }
  return text;
}

/** Where a line of the joined text stands: "methods/tap.wgsl:31". */
export function placeOf(shader, line) {
  const [file, first] = shader.files.reduce((best, at) => (at[1] <= line && at[1] >= best[1] ? at : best));
  return `${file}:${line - first + 1}`;
}

/** {layouts, pipelines, entries}; an Error names file and line of what the compiler refuses. */
export async function makeKernel(device, shader, texels = {}, constants = {}) {
  const module = device.createShaderModule({ code: withTexels(shader.text, texels), label: shader.files[0][0] });
  const { messages } = await module.getCompilationInfo();
  const wrong = messages.filter((m) => m.type === 'error');
  if (wrong.length) throw new Error(wrong.map((m) => `${placeOf(shader, m.lineNum)}: ${m.message}`).join('\n'));
  const layouts = shader.groups.map((entries) => device.createBindGroupLayout({
    entries: entries.map(({ name, ...entry }) => {
      const texel = texels[shader.aliases[name]];
      return texel ? { ...entry, storageTexture: { ...entry.storageTexture, format: texel } } : entry;
    }),
  }));
  const layout = device.createPipelineLayout({ bindGroupLayouts: layouts });
  const made = await Promise.all(shader.entryPoints.map((entryPoint) =>
    device.createComputePipelineAsync({ layout, compute: { module, entryPoint, constants } })));
  const pipelines = Object.fromEntries(shader.entryPoints.map((name, i) => [name, made[i]]));
  return { layouts, pipelines, entries: shader.groups };
}

/** The bind groups of a kernel; `resources` by binding name, as GPUBindGroupEntry.resource. */
export function bindGroups(device, kernel, resources) {
  return kernel.layouts.map((layout, group) => device.createBindGroup({
    layout,
    entries: kernel.entries[group].map(({ name, binding }) => ({ binding, resource: resources[name] })),
  }));
}
