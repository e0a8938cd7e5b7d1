// What a visitor can change, as it stands in the page's address: #t=12&deg=720&curve=cosine...

export const DEFAULTS = {
  t: 17, x: 0.3, y: -0.2, deg: 720, curve: 'cosine', fps: 24, density: 'exact', still: 0,
  method: 'gather', samples: 16, deg2: 360, curve2: 'box', line: 0.5,
};
const CURVES = ['box', 'cosine', 'trapezoid'];
const ONE_OF = {
  curve: CURVES, curve2: CURVES, fps: [24, 30, 60], density: ['exact', 'published'], still: [0, 1],
  method: ['tap', 'tiles', 'gather'], samples: [4, 8, 16, 32],
};
const WITHIN = { t: [0, 50], x: [-1e3, 1e3], y: [-1, 0.75], deg: [0, 1440], deg2: [0, 720], line: [0, 1] };

/** The settings that `text` ("t=12&deg=720") names; what it cannot mean is left out. */
export function parsed(text) {
  const found = {};
  for (const [name, value] of new URLSearchParams(text.replace(/^#/, ''))) {
    const given = typeof DEFAULTS[name] === 'number' ? Number(value) : value;
    if (ONE_OF[name]?.includes(given)) found[name] = given;
    if (name in WITHIN && value !== '' && Number.isFinite(given)) found[name] = clamp(given, ...WITHIN[name]);
  }
  return found;
}

/** The address of a state: what differs from DEFAULTS, and the moment. */
export function written(state) {
  const said = new URLSearchParams();
  for (const [name, plain] of Object.entries(DEFAULTS)) {
    const value = typeof plain === 'number' ? Number(state[name].toFixed(4)) : state[name];
    if (name === 't' || value !== plain) said.set(name, value);
  }
  return `#${said}`;
}

export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/** Within the range that `name` may have. */
export const within = (name, value) => clamp(value, ...WITHIN[name]);

/** The next of the values that `name` may have. */
export const after = (name, value) => ONE_OF[name][(ONE_OF[name].indexOf(value) + 1) % ONE_OF[name].length];
