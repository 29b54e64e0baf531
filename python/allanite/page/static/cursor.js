// The cursors of both figures: averaging time, frequency, and time of the record under the pointer.
import { $, S, el, numberText } from "./core.js";
import { valueAt, effectTraces, shown, timeUnit } from "./draw.js";
import { second } from "./second.js";

// A sine of frequency f raises the Allan deviation most at τ = PEAK / f, where tan(π f τ) = 2 π f τ.
const PEAK = 0.371;
const panes = () => [{ node: $("plot"), view: shown.view }, { node: $("plot2"), view: second.view }];
// Quantity of the x or y axes of a view: "tau", "frequency" or "time"; null for another one, or for several.
function quantity(view, letter) {
  // The map beside a spectrum has a time axis of its own.
  const own = new Set(view.data.filter(trace => trace.type !== "heatmap").map(trace => (trace[`${letter}axis`] || letter).replace(letter, `${letter}axis`)));
  const titles = Object.keys(view.layout).filter(k => k.startsWith(`${letter}axis`) && (!own.size || own.has(k))).map(k => view.layout[k].title?.text).filter(Boolean);
  const found = new Set(titles.map(t => /τ/.test(t) ? "tau" : /^Frequency/.test(t) ? "frequency" : /^Time \(/.test(t) ? "time" : null));
  return found.size === 1 && letter + [...found][0] !== "ytau" ? [...found][0] : null;
}
const unit = (view, name) => name === "time" ? timeUnit(view) : 1;
const ready = ({ node, view }) => Boolean(view && node.data && node._fullLayout && node._fullLayout.xaxis);
const yAxes = axes => Object.keys(axes).filter(k => k.startsWith("yaxis")).map(k => axes[k]);

export function moveCursor(event) {
  const own = panes().find(p => p.node === event.currentTarget);
  if (!ready(own) || shown.held) return;
  const { node, view } = own, axes = node._fullLayout, box = node.getBoundingClientRect();
  const x = event.clientX - box.left - axes.xaxis._offset, y = event.clientY - box.top;
  if (x < 0 || x > axes.xaxis._length) return;
  const q = {}, right = quantity(view, "x"), up = quantity(view, "y"), axis = yAxes(axes).find(a => y >= a._offset && y <= a._offset + a._length);
  if (right) q[right] = axes.xaxis.p2d(x) * unit(view, right);
  if (up && axis) q[up] = axis.p2d(y - axis._offset);
  if (q.tau) q.frequency = PEAK / q.tau; else if (q.frequency) q.tau = PEAK / q.frequency;
  if (q.tau && shown.view?.name === "allan") q.tau = showValuesAt(q.tau) ?? q.tau;
  else if (second.view) $("readout").replaceChildren(...Object.entries(q).map(([name, v]) => el("span", {}, { tau: `τ = ${numberText(v)} s`, frequency: `f = ${numberText(v)} Hz`, time: `${numberText(v)} s` }[name])));
  for (const pane of panes()) drawCursors(pane, q);
}
// Values at the measured point nearest to an averaging time: measured, model and effects, in the chosen unit. Returns its τ.
function showValuesAt(tau) {
  const view = shown.view, measured = view.data.find(t => t.meta === "measured") || view.data.find(t => t.mode === "markers" && t.x.length > 3);
  if (!measured) return null;
  let i = 0;
  measured.x.forEach((v, k) => { if (Math.abs(Math.log10(v / tau)) < Math.abs(Math.log10(measured.x[i] / tau))) i = k; });
  const units = view.units || [{ text: "", factor: 1 }], unit = units[Math.min(S.cursorUnit || 0, units.length - 1)];
  const size = v => numberText(v * unit.factor);
  const x = measured.x[i], model = view.data.find(t => t.meta === "model");
  const parts = effectTraces().filter(({ trace }) => valueAt(trace, x) > 0).map(({ trace }) => {
    const [kind, place] = trace.meta.split("-"), chip = S.state.chips.find(c => String(c.place) === place);
    return el("span", {}, el("i", { style: `border-color:var(--${chip ? chip.color : "c1"})` }), `${chip ? chip.short : ""} ${kind === "limit" ? "< " : ""}${size(valueAt(trace, x))}`);
  });
  const change = el("button", { title: "Another unit", "aria-label": "Unit of the cursor", onclick: () => { S.cursorUnit = ((S.cursorUnit || 0) + 1) % units.length; showValuesAt(x); } }, unit.text || "1");
  $("readout").replaceChildren(el("b", {}, `τ = ${numberText(x)} s`), second.view ? el("span", {}, `f = ${numberText(PEAK / x)} Hz`) : "", el("span", {}, `measured ${size(measured.y[i])}`), ...(model ? [el("span", {}, `model ${size(valueAt(model, x))}`)] : []), ...parts, change);
  return x;
}
// Lines of a figure at the given quantities, as far as its axes show them.
function drawCursors(pane, q) {
  if (!ready(pane)) return;
  const { node, view } = pane, axes = node._fullLayout, lines = [], right = quantity(view, "x"), up = quantity(view, "y");
  const place = (axis, v) => { const p = axis.d2p(v); return p >= 0 && p <= axis._length ? axis._offset + p : null; };
  const x = q[right] === undefined ? null : place(axes.xaxis, q[right] / unit(view, right));
  if (x !== null) lines.push(el("div", { class: "cursor", style: `left:${node.offsetLeft + x}px` }));
  if (up && q[up] !== undefined) for (const axis of yAxes(axes)) {
    const y = place(axis, q[up]);
    if (y !== null) lines.push(el("div", { class: "cursor level", style: `top:${node.offsetTop + y}px` }));
  }
  for (const old of node.parentElement.querySelectorAll(":scope > .cursor")) old.remove();
  node.parentElement.append(...lines);
}
export const removeCursors = () => { for (const line of document.querySelectorAll(".cursor")) line.remove(); };
