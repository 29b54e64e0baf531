// The figure: drawing, lighting up a component, shading where an effect acts, zooming, what the pointer reads.
import { $, S, capital, el, short } from "./core.js";

const plot = () => $("plot"), NARROW = 560, LOW = 320;
const options = { displaylogo: false, displayModeBar: false, doubleClick: false, responsive: false, scrollZoom: false };
let small = null;
export const shown = { view: null, base: [], held: false, later: null };

export async function show(view) {
  if (shown.held) { shown.later = view; return; }  // a line is in the hand
  shown.view = view;
  const layout = structuredClone(view.layout);
  narrow(layout);
  shown.base = layout.shapes || [];
  await Plotly.react(plot(), view.data, layout, options);
  listen();
  // What stands above may have become taller: the observer of sizes would put that right, but only a moment later.
  const { width, height } = plot()._fullLayout;
  if (width !== plot().clientWidth || height !== plot().clientHeight) await Plotly.relayout(plot(), { autosize: true });
}
// On a phone a figure keeps its axes and loses what would not fit.
function narrow(layout) {
  // Beside a table there is no height for two titles, one above the other.
  if (plot().clientHeight < LOW && layout.yaxis2 && layout.yaxis2.domain[1] < layout.yaxis.domain[0]) {
    layout.yaxis2.title.text = "σ";
    layout.yaxis.title.font = { size: 11 };
  }
  small = plot().clientWidth <= NARROW;
  if (!small) return;
  layout.margin = { ...layout.margin, l: 58, r: 8 };
  layout.font = { ...layout.font, size: 11 };
  layout.annotations = (layout.annotations || []).filter(a => !String(a.text).startsWith("×"));
  // Of a reading the letter: its number stands below.
  if (shown.view.name === "allan") for (const a of layout.annotations) if (a.xref === "x") a.text = a.text.split(" ")[0];
  for (const [key, axis] of Object.entries(layout)) if (/^[xy]axis/.test(key) && axis.title) axis.title.standoff = 4;
  const across = Object.keys(layout).filter(k => k.startsWith("xaxis") && layout[k].domain[0] > 0.2);
  if (across.length && shown.view.name === "error") stack(layout);
}
// Of the labels of an axis every second, third …, so that at most `most` are left.
function thin(axis, most) {
  const step = Math.ceil((axis.tickvals || []).length / most), kept = (_, i) => i % step === 0;
  if (step > 1) Object.assign(axis, { tickvals: axis.tickvals.filter(kept), ticktext: axis.ticktext.filter(kept) });
}
// Panels beside each other go below each other: what they say of their height inside, the time once.
function stack(layout) {
  const xs = Object.keys(layout).filter(k => k.startsWith("xaxis")).sort(), n = xs.length;
  layout.annotations = layout.annotations.filter(a => a.xref !== "paper");
  xs.forEach((key, i) => {
    const y = layout[key.replace("x", "y")], top = 1 - i / n, last = i === n - 1;
    const [, name, unit] = /^Error, (.*) \((.*)\)$/.exec(y.title.text);
    layout[key].domain = [0, 1]; y.domain = [top - 1 / n + 0.04, top - 0.03];
    layout[key].showticklabels = last;
    if (!last) layout[key].title.text = "";
    y.title.text = unit; thin(y, 4);
    layout.annotations.push({ text: capital(name), showarrow: false, xref: "paper", x: 0.02, xanchor: "left", yref: "paper", y: top - 0.03, yanchor: "top", font: { size: 11 } });
  });
}
export function clear() { shown.view = null; if (plot().data) Plotly.purge(plot()); plot().dataset.listens = ""; }
export function fit() {
  if (!shown.view || !plot().data) return;
  const now = plot().clientWidth <= NARROW;
  // Drawn from nothing: a legend of two lines would keep its place when it becomes one of one.
  if (small !== null && small !== now) { const view = shown.view; clear(); show(view); } else Plotly.Plots.resize(plot());
  small = now;
}

function listen() {
  if (plot().dataset.listens) return;
  plot().dataset.listens = "yes";
  plot().on("plotly_doubleclick", () => restore());
  plot().on("plotly_relayout", change => zoomed(change));
  plot().on("plotly_selected", event => S.hooks.brushed && S.hooks.brushed(event && event.range ? event.range.x.map(Number) : null));
}
export function restore() {
  if (!shown.view) return;
  if (shown.view.name === "samples" && (S.options.from || S.options.to)) { S.options = {}; S.hooks.redraw(); } else show(shown.view);
}
// Seconds in a unit of the time axis.
export function timeUnit() {
  const text = (shown.view.layout.xaxis.title || {}).text || (shown.view.layout.xaxis2 && shown.view.layout.xaxis2.title.text) || "";
  const found = /\((d|h|min)\)/.exec(text);
  return { d: 86400, h: 3600, min: 60 }[found && found[1]] || 1;
}
function zoomed(change) {
  const keys = Object.keys(change).filter(k => /^[xy]axis\d*\.range/.test(k));
  if (!keys.length || !shown.view) return;
  if (shown.view.name === "samples" && change["xaxis.range[0]"] !== undefined) {
    const unit = timeUnit();
    S.options = { from: String(change["xaxis.range[0]"] * unit), to: String(change["xaxis.range[1]"] * unit) };
    S.hooks.redraw();
    return;
  }
  // Ticks of the whole view would be one or none on a part of it.
  const more = {};
  for (const axis of new Set(keys.map(k => k.split(".")[0]))) if (plot().layout[axis].tickmode !== "auto") Object.assign(more, { [`${axis}.tickmode`]: "auto", [`${axis}.nticks`]: 8, [`${axis}.exponentformat`]: "power" });
  if (Object.keys(more).length) Plotly.relayout(plot(), more);
}

const effects = () => shown.view.data.map((trace, i) => ({ trace, i })).filter(({ trace }) => String(trace.meta || "").startsWith("effect-"));
export function light(place) {
  if (!shown.view || !plot().data) return;
  const found = effects(), meta = `effect-${place}`;
  if (found.length) Plotly.restyle(plot(), {
    "line.width": found.map(({ trace }) => place !== null && trace.meta === meta ? 3.6 : (trace.line && trace.line.width) || 1.2),
    opacity: found.map(({ trace }) => place === null || trace.meta === meta ? 1 : 0.25) }, found.map(({ i }) => i));
}
// Where an effect acts: a range of the view's own axis; on the map the frequencies, the times or both.
export function shade(acts) {
  if (!shown.view || !plot().layout) return;
  const { name, layout } = shown.view, more = [], color = getComputedStyle(document.documentElement).getPropertyValue("--accent").trim();
  if (acts) {
    const unit = ["map", "samples"].includes(name) ? timeUnit() : 1, time = acts.time && acts.time.map(t => t / unit);
    const x = { allan: acts.tau, compare: acts.tau, psd: acts.frequency, map: time, samples: time }[name], y = name === "map" ? acts.frequency : null;
    if (x || y) for (const s of ["", "2"]) if (layout["xaxis" + s]) more.push({
      type: "rect", xref: x ? "x" + s : `x${s} domain`, yref: y ? "y" + s : `y${s} domain`, x0: x ? x[0] : 0, x1: x ? x[1] : 1, y0: y ? y[0] : 0, y1: y ? y[1] : 1,
      fillcolor: color, opacity: name === "map" ? 0.3 : 0.16, line: { width: 1, color }, layer: name === "map" ? "above" : "below", name: "acts" });
  }
  Plotly.relayout(plot(), { shapes: [...shown.base, ...more] });
}

// The cursor: what is measured and modelled at the τ under the pointer, in the unit chosen.
export function cursor(event) {
  const view = shown.view, axes = plot()._fullLayout;
  if (!view || view.name !== "allan" || !axes || !axes.xaxis || !plot().data || shown.held) return;
  const box = plot().getBoundingClientRect(), x = event.clientX - box.left - axes.xaxis._offset;
  if (x < 0 || x > axes.xaxis._length) return point(null);
  const measured = view.data.find(t => t.meta === "measured") || view.data.find(t => t.mode === "markers" && t.x.length > 3);
  if (!measured) return;
  const at = Math.log10(axes.xaxis.p2d(x));
  let best = 0;
  measured.x.forEach((v, i) => { if (Math.abs(Math.log10(v) - at) < Math.abs(Math.log10(measured.x[best]) - at)) best = i; });
  point(best, measured);
}
function point(i, measured) {
  const view = shown.view;
  if (i === null) return;
  const units = view.units || [{ text: "", factor: 1 }], unit = units[Math.min(S.cursorUnit || 0, units.length - 1)];
  const size = v => short(v * unit.factor);
  const model = view.data.find(t => t.meta === "model");
  const parts = effects().filter(({ trace }) => trace.x.length === measured.x.length && trace.y[i] > 0).map(({ trace }) => {
    const chip = S.state.chips.find(c => `effect-${c.place}` === trace.meta);
    return el("span", {}, el("i", { style: `border-color:var(--${chip ? chip.color : "c1"})` }), `${chip ? chip.short : ""} ${size(trace.y[i])}`);
  });
  const change = el("button", { title: "Another unit", "aria-label": "Unit of the cursor", onclick: () => { S.cursorUnit = ((S.cursorUnit || 0) + 1) % units.length; point(i, measured); } }, unit.text || "1");
  $("readout").replaceChildren(el("b", {}, `τ = ${short(measured.x[i])} s`), el("span", {}, `measured ${size(measured.y[i])}`), ...(model ? [el("span", {}, `model ${size(model.y[i])}`)] : []), ...parts, change);
  mark(measured.x[i]);
}
function mark(x) {
  const box = plot().querySelector(".cartesianlayer");
  let line = $("cursor");
  if (!line) { line = el("div", { id: "cursor" }); $("figure").append(line); }
  const axes = plot()._fullLayout;
  line.hidden = !box;
  line.style.left = `${plot().offsetLeft + axes.xaxis._offset + axes.xaxis.d2p(x)}px`;
}
export const away = () => { const line = $("cursor"); if (line) line.hidden = true; };
