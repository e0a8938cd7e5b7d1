// The frames around this one as a ruler, each with its shutter as a curve: what is exposed when, and by how many.
import { shutterOf } from './uniforms.js';

const POINTS = 96;

/** The shutter's curve: when it opens and closes [frame intervals], and heights from 0 to 1 between. */
export function curveOf({ span: [opens, closes], weight }) {
  const y = Array.from({ length: POINTS }, (_, i) => weight((i + 0.5) / POINTS)), most = Math.max(...y);
  return { opens, closes, y: y.map((value) => value / most) };
}

/** The sum of the curves of all frames at POINTS times of a frame interval, least and most. */
export function coverage({ opens, closes, y }) {
  if (closes - opens < 1e-6) return { least: 0, most: 0, sum: [0, 0] };
  const sum = Array.from({ length: POINTS }, (_, i) => {
    let total = 0;
    for (let n = Math.floor(opens) - 1; n <= closes + 1; n++) {
      const at = ((i + 0.5) / POINTS + n - opens) / (closes - opens);
      if (at >= 0 && at < 1) total += y[Math.floor(at * POINTS)];
    }
    return total;
  });
  return { least: Math.min(...sum), most: Math.max(...sum), sum };
}

/** One sentence on what the shutter does between frames. */
export function verdict(shutter, degrees) {
  if (degrees === 0) return '<b>No exposure.</b> Every frame is an instant, and the motion between two of them is lost.';
  const shape = curveOf(shutter), { least, most } = coverage(shape);
  if (least > 0.97 * most) {
    return degrees === 360
      ? '<b>Frames meet exactly.</b> Every moment is exposed once.'
      : '<b>Frames overlap evenly.</b> Each shares its light with its neighbours, and their sum stays level.';
  }
  if (degrees < 360) {
    return `<b>The shutter is closed for ${Math.round(100 - degrees / 3.6)} % of the time.</b> What happens then is in no frame.`;
  }
  return '<b>Some moments weigh more than others.</b> The sum of all exposures, the thin line, rises and falls.';
}

/** Draw the ruler; `at`: the present moment [frames]. Returns the width of a frame [px]. */
export function drawStrip(canvas, { t, fps, deg, curve }, style) {
  const ratio = Math.min(devicePixelRatio || 1, 3), width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [width * ratio, height * ratio].map(Math.round);
  }
  const ink = canvas.getContext('2d'), at = t * fps, shape = curveOf(shutterOf({ curve, degrees: deg, phase: 'centre' }));
  const unit = Math.max(width / 9, 64), base = height - 26, room = base - 14, { most, sum } = coverage(shape);
  const tall = room / Math.max(most, 1), x = (frame) => width / 2 + (frame - at) * unit;
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
  ink.clearRect(0, 0, width, height);
  const reach = width / 2 / unit + 2.5, first = Math.floor(at - reach), last = Math.ceil(at + reach), own = Math.round(at);
  const trace = (frame) => {
    ink.beginPath();
    ink.moveTo(x(frame + shape.opens), base);
    shape.y.forEach((value, i) => {
      const step = (shape.closes - shape.opens) / POINTS;
      if (curve === 'box' && i === 0) ink.lineTo(x(frame + shape.opens), base - value * tall);
      ink.lineTo(x(frame + shape.opens + (i + (curve === 'box' && i === POINTS - 1 ? 1 : 0.5)) * step), base - value * tall);
    });
    ink.lineTo(x(frame + shape.closes), base);
  };
  ink.lineWidth = 1.2;
  ink.strokeStyle = style.accent;
  for (let frame = first; frame <= last; frame++) {
    if (frame === own) continue;
    trace(frame);
    ink.globalAlpha = 0.06;
    ink.fillStyle = style.accent;
    ink.fill();
    ink.globalAlpha = 0.35;
    ink.stroke();
  }
  trace(own);
  ink.globalAlpha = 0.4;
  ink.fill();
  ink.globalAlpha = 1;
  ink.lineWidth = 2;
  ink.stroke();
  if (deg > 360 && sum.length > 2) { // the sum of all, which should be level
    ink.beginPath();
    for (let frame = first; frame <= last; frame++) {
      sum.forEach((value, i) => ink.lineTo(x(frame + (i + 0.5) / POINTS), base - value * tall));
    }
    ink.setLineDash([2, 4]);
    ink.strokeStyle = style.cool;
    ink.lineWidth = 1.5;
    ink.stroke();
    ink.setLineDash([]);
  }
  ink.strokeStyle = style.rule;
  ink.lineWidth = 1;
  ink.beginPath();
  ink.moveTo(0, base + 0.5);
  ink.lineTo(width, base + 0.5);
  ink.stroke();
  ink.font = style.font;
  ink.textAlign = 'center';
  for (let frame = first; frame <= last; frame++) {
    if (frame < 0) continue;
    ink.fillStyle = frame === own ? style.text : style.soft;
    ink.fillRect(Math.round(x(frame)) - 0.5, base, 1, 5);
    ink.fillText(String(frame), x(frame), height - 7);
  }
  return unit;
}
