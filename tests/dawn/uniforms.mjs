// The bytes of buffers as docs/page/uniforms.js makes them; no GPU is needed.
//   node uniforms.mjs < {exported, states}      as tests/test_page_uniforms.py writes it
// Prints a list with {constants, groups, line, bytes: {name: base64}} for every state.
import fs from 'node:fs';
import { commandLine, groupZero, setExport, shutterOf, volumeKernel } from '../../docs/page/uniforms.js';

const { exported, states } = JSON.parse(fs.readFileSync(0, 'utf8'));
setExport(exported);
const answers = states.map((state) => {
  const full = { ...state, shutter: shutterOf(state.shutter) };
  const { constants, groups, ...buffers } = volumeKernel(full);
  const bytes = Object.entries({ ...buffers, ...groupZero(full) })
    .map(([name, data]) => [name, Buffer.from(data).toString('base64')]);
  const blur = { ...full, input: 'in.exr', method: 'tap' };
  return { constants, groups, lines: [commandLine(full), commandLine(blur)], bytes: Object.fromEntries(bytes) };
});
process.stdout.write(JSON.stringify(answers));
