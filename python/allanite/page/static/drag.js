// Dragging the line of an effect: model, residual and misfit are updated immediately.
import { $, S, numberText } from "./core.js";
import { valueAt as height, show, shown } from "./draw.js";

const plot = () => $("plot");
let grip = null;

const pointerPlace = event => {
  const box = plot().getBoundingClientRect(), axes = plot()._fullLayout;
  return { x: event.clientX - box.left - axes.xaxis._offset, y: event.clientY - box.top - axes.yaxis._offset, axes };
};
// Distance in pixels from a point to a line segment.
const distance = (x, y, [ax, ay], [bx, by]) => {
  const length = (bx - ax) ** 2 + (by - ay) ** 2, t = length ? Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length)) : 0;
  return Math.hypot(ax + t * (bx - ax) - x, ay + t * (by - ay) - y);
};
// Index of the trace of an effect within 8 pixels of the pointer; null if there is none.
function nearestEffect(event) {
  if (!shown.view || !["allan", "psd"].includes(shown.view.name) || !plot()._fullLayout || !plot()._fullLayout.xaxis) return null;
  const { x, y, axes } = pointerPlace(event);
  if (x < 0 || y < 0 || x > axes.xaxis._length || y > axes.yaxis._length) return null;
  let best = null;
  shown.view.data.forEach((trace, i) => {
    if (!String(trace.meta || "").startsWith("effect-")) return;
    let last = null;
    for (let k = 0; k < trace.x.length; k++) {
      const here = trace.y[k] > 0 ? [axes.xaxis.d2p(trace.x[k]), axes.yaxis.d2p(trace.y[k])] : null;
      const far = last && here ? distance(x, y, last, here) : Infinity;
      if (far < 8 && (!best || far < best.far)) best = { far, i };
      last = here;
    }
  });
  return best && best.i;
}
// Standard normal score of a ratio of powers with `count` degrees of freedom, as in the library.
export function score(ratio, count) {
  const nu = count / 2, r = Math.max(ratio, 1e-300), w = Math.sign(r - 1) * Math.sqrt(Math.max(2 * nu * (r - 1 - Math.log(r)), 0));
  const u = Math.sqrt(nu) * (r - 1);
  return Math.abs(w) < 1e-3 ? w : w + Math.log(u / w) / w;
}
// χ² per degree of freedom if the power of one effect is multiplied by `factor`.
export function misfit(live, effect, factor) {
  const own = live.own[effect];
  if (!own) return null;
  let chi2 = 0;
  live.groups.forEach((first, g) => {
    const end = g + 1 < live.groups.length ? live.groups[g + 1] : live.count.length;
    let total = 0, sum = 0;
    for (let i = first; i < end; i++) {
      const model = live.spectrum[i] + (factor - 1) * own[i];
      total += live.count[i]; sum += live.count[i] * live.power[i] / Math.max(model, 1e-300);
    }
    chi2 += score(sum / total, total) ** 2;
  });
  return chi2 / live.dof;
}
// Redraws the dragged effect, the model, the residual and the misfit.
function drawDragged() {
  const view = shown.view, { i, factor } = grip, own = view.data[i], power = view.name === "psd" ? factor : factor * factor;
  const square = view.name === "psd" ? 1 : 2, effect = own.meta.slice(7);
  const y = [own.y.map(v => v === null ? null : v * factor)], at = [i];
  const sum = view.data.findIndex(t => t.meta === "model"), rest = view.data.findIndex(t => t.meta === "residual");
  if (sum >= 0 && view.data[sum].x.length === own.x.length) {
    const model = view.data[sum].y.map((v, k) => Math.max(v ** square + (power - 1) * (own.y[k] || 0) ** square, 1e-300) ** (1 / square));
    y.push(model); at.push(sum);
    if (rest >= 0 && view.name === "allan") {
      const live = view.live, places = view.data[rest].x.map(x => live.tau.findIndex(t => Math.abs(t / x - 1) < 1e-5));
      const sumNow = { x: view.data[sum].x, y: model };
      y.push(places.map(k => k < 0 ? null : score((live.measured[k] / height(sumNow, live.tau[k])) ** 2, live.edf[k]))); at.push(rest);
    }
  }
  Plotly.restyle(plot(), { y }, at);
  const now = misfit(view.live, effect, power);
  const chip = S.state.chips.find(c => String(c.place) === effect);
  $("readout").textContent = `${chip ? chip.name : "Effect"} × ${numberText(view.name === "psd" ? Math.sqrt(factor) : factor)}` + (now === null ? "" : ` · χ²/dof ${numberText(view.live.before)} → ${numberText(now)}`);
  $("readout").dataset.misfit = now === null ? "" : now.toPrecision(6);
}
export function listenDrag(onDone) {
  plot().addEventListener("pointermove", event => {
    if (!grip) { if (!event.buttons) plot().classList.toggle("grip", nearestEffect(event) !== null); return; }
    const { _length, range } = plot()._fullLayout.yaxis;
    grip.factor = 10 ** ((grip.y - event.clientY) / _length * (range[1] - range[0]));
    if (!grip.waits) { grip.waits = true; requestAnimationFrame(() => { if (grip) { grip.waits = false; drawDragged(); } }); }
    event.preventDefault(); event.stopPropagation();
  }, true);
  const take = event => {
    const i = nearestEffect(event);
    if (i === null) return;
    grip = { i, y: event.clientY, factor: 1 };
    shown.held = true;
    event.preventDefault(); event.stopPropagation();
  };
  plot().addEventListener("mousedown", take, true);
  plot().addEventListener("pointerdown", event => { if (event.pointerType === "touch") take(event); }, true);
  addEventListener("pointerup", () => {
    if (!grip) return;
    const { i, factor } = grip, view = shown.view, waiting = shown.later;
    const effect = Number(view.data[i].meta.slice(7));
    grip = shown.later = null; shown.held = false;
    if (waiting) show(waiting);
    // The density is proportional to the square of a coefficient.
    if (Math.abs(factor - 1) > 1e-3) onDone(effect, view.name === "psd" ? Math.sqrt(factor) : factor);
  });
}
