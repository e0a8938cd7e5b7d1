// The very WGSL that draws the page, to unfold.

const KINDS = /(\/\/.*)|\b(fn|let|var|const|struct|override|alias|return|if|else|for|loop|while|break|continue|switch|case|default|true|false)\b|\b(0x[\da-fA-F]+u?|\d+\.?\d*(?:e-?\d+)?[ufi]?)\b/g;

function coloured(text) {
  const safe = text.replace(/&/g, '&amp;').replace(/</g, '&lt;');
  return safe.replace(KINDS, (all, comment, word) => `<span class="${comment ? 'c' : word ? 'k' : 'n'}">${all}</span>`);
}

/** {file: its own text} of shaders, which hold what they include, in the order they are met. */
export function filesOf(shaders, names) {
  const found = new Map();
  for (const name of names) {
    const { text, files } = shaders[name], lines = text.split('\n');
    files.forEach(([file, first], i) => {
      const end = files[i + 1]?.[1] ?? lines.length;
      if (!found.has(file)) found.set(file, lines.slice(first - 1, end - 1).join('\n').trimEnd());
    });
  }
  return found;
}

const count = (texts) => [...texts].reduce((sum, text) => sum + text.split('\n').length, 0);

const PARTS = [ // what no earlier part has
  ['The torusphere', /./],
  ['tap', /methods\/tap/],
  ['tiles', /methods\/tiles/],
  ['gather', /methods\/gather/],
  ['Motion between pictures', /block_search/],
  ['The frame as rendered, and what methods share', /^(?!viewer)/],
  ['From the result to the screen', /./],
];

/** Fill the section. */
export function showSource(shaders, lead, place) {
  const volume = filesOf(shaders, ['methods/volume.wgsl']), all = filesOf(shaders, Object.keys(shaders));
  const number = (n) => n.toLocaleString('en');
  lead.textContent = `The picture at the top is drawn by ${number(count(volume.values()))} lines of WGSL, the whole page by `
    + `${number(count(all.values()))}, all from the folder wgsl of the project. The renderer runs the same text, byte for byte: nothing was ported for this page.`;
  const left = new Set(all.keys());
  place.replaceChildren(...PARTS.map(([title, pattern], i) => {
    const names = [...(i ? all : volume).keys()].filter((name) => left.has(name) && (!i || pattern.test(name)));
    names.forEach((name) => left.delete(name));
    const lines = count(names.map((name) => all.get(name)));
    const part = folded(title, `${names.length} file${names.length > 1 ? 's' : ''}, ${number(lines)} lines`);
    part.className = 'part';
    part.open = i === 0;
    part.append(...names.map((name) => file(name, all.get(name))));
    return part;
  }));
}

function file(name, text) {
  const details = folded(name, `${text.split('\n').length} lines`), code = document.createElement('pre');
  code.tabIndex = 0;
  details.append(code);
  details.addEventListener('toggle', () => { code.innerHTML ||= coloured(text); }, { once: true });
  return details;
}

function folded(title, note) {
  const details = document.createElement('details'), summary = document.createElement('summary');
  const beside = document.createElement('span');
  beside.textContent = note;
  summary.append(title, beside);
  details.append(summary);
  return details;
}
