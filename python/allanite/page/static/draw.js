// The figure: drawing, highlighting an effect, shading where it acts, zooming, and the cursor.
import { $, S, capitalized, numberText } from "./core.js";

const plot = () => $("plot"), NARROW_PX = 560, LOW_PX = 320;
// Height of the figure in px for each color bar, from which on the title of the color bar fits beside it.
const BAR_PX = 260;
// True if there is no space for the titles of the color bars of a view.
const lacksBarSpace = (view, node) => node.clientWidth <= NARROW_PX || node.clientHeight < view.data.filter(trace => trace.colorbar).length * BAR_PX;
const options = { displaylogo: false, displayModeBar: false, doubleClick: false, responsive: false, scrollZoom: false };
let small = null;
export const shown = { view: null, base: [], held: false, later: null };

export async function show(view) {
  if (shown.held) { shown.later = view; return; }  // a line is being dragged
  shown.view = view;
  small = `${plot().clientWidth <= NARROW_PX} ${lacksBarSpace(view, plot())}`;
  shown.base = (await paint(plot(), view)).shapes || [];
  listen();
}
// Draws a view into an element, with fewer words where there is little space. Returns the layout.
export async function paint(node, view) {
  const layout = structuredClone(view.layout);
  adaptToPhone(layout, view, node);
  let data = lacksBarSpace(view, node) ? view.data.map(withoutBarTitle) : view.data;
  if (node.clientWidth <= NARROW_PX && view.name === "psd") data = placeMapBelow(layout, data);
  await Plotly.react(node, data, layout, options);
  // Elements above may have changed their height; correct the size now instead of waiting for the observer.
  const { width, height } = node._fullLayout;
  if (width !== node.clientWidth || height !== node.clientHeight) await Plotly.relayout(node, { autosize: true });
  await keepInside(node);
  return layout;
}
// Shifts labels that reach beyond the left or right edge of the figure into it.
async function keepInside(node) {
  const edge = node.getBoundingClientRect(), change = {};
  for (const label of node.querySelectorAll(".annotation")) {
    const box = label.getBoundingClientRect(), beyond = Math.max(0, box.right - edge.right + 4) || Math.min(0, box.left - edge.left - 4);
    const at = `annotations[${label.dataset.index}]`;
    if (beyond) change[`${at}.xshift`] = (node.layout.annotations[label.dataset.index].xshift || 0) - beyond;
  }
  if (Object.keys(change).length) await Plotly.relayout(node, change);
}
// On a phone the figure keeps its axes and drops elements that do not fit.
function adaptToPhone(layout, view, node) {
  // Next to a table there is not enough height for two axis titles.
  if (node.clientHeight < LOW_PX && layout.yaxis2 && layout.yaxis2.domain[1] < layout.yaxis.domain[0]) {
    layout.yaxis2.title.text = "σ";
    layout.yaxis.title.font = { size: 11 };
  }
  if (node.clientWidth > NARROW_PX) return;
  layout.margin = { ...layout.margin, l: 58, r: 8 };
  layout.font = { ...layout.font, size: 11 };
  // Only a single shaded range has space for its label.
  if (layout.annotations.filter(a => a.name === "span").length > 1) layout.annotations = layout.annotations.filter(a => a.name !== "span");
  // Show only the letter of a reading; its value is listed below.
  if (view.name === "allan") for (const a of layout.annotations) if (a.xref === "x") a.text = a.text.split(" ")[0];
  for (const [key, axis] of Object.entries(layout)) if (/^[xy]axis/.test(key) && axis.title) axis.title.standoff = 4;
  const across = Object.keys(layout).filter(k => k.startsWith("xaxis") && layout[k].domain[0] > 0.2);
  if (across.length && view.name === "error") stackWithSharedAxis(layout);
  if (across.length && view.name === "thermal") stackWithOwnAxes(layout);
}
// Places panels with different x axes below each other.
function stackWithOwnAxes(layout) {
  const xs = Object.keys(layout).filter(k => k.startsWith("xaxis")).sort(), n = xs.length;
  xs.forEach((key, i) => { layout[key].domain = [0, 1]; layout[key.replace("x", "y")].domain = [1 - (i + 1) / n + (i < n - 1 ? 0.2 : 0), 1 - i / n]; });
}
// A trace without the title of its color bar, which the text below the figure names.
const withoutBarTitle = trace => trace.colorbar ? { ...trace, colorbar: { ...trace.colorbar, title: { text: "" } } } : trace;
// Places the map of the failing range over time below the spectrum. Returns the traces with its color bar.
function placeMapBelow(layout, data) {
  if (!layout.yaxis3) return data;
  const domains = { yaxis: [0.58, 1], yaxis2: [0.42, 0.55], yaxis3: [0, 0.24] };
  for (const [key, domain] of Object.entries(domains)) { layout[key].domain = domain; layout[key.replace("y", "x")].domain = [0, 1]; }
  layout.yaxis2.title.text = "σ"; layout.yaxis3.title.text = "Hz"; layout.yaxis.title.font = { size: 11 };
  for (const a of layout.annotations) if (a.yref === "paper") Object.assign(a, { x: 0, y: a.x > 0.2 ? 0.25 : 1 });
  return data.map(trace => trace.colorbar ? { ...trace, colorbar: { ...trace.colorbar, orientation: "h", x: 1, xanchor: "right", y: 0.25, yanchor: "bottom", len: 0.4, thickness: 8 } } : trace);
}
// Keeps every second, third … label of an axis, so that at most `most` remain.
function thinTicks(axis, most) {
  const step = Math.ceil((axis.tickvals || []).length / most), kept = (_, i) => i % step === 0;
  if (step > 1) Object.assign(axis, { tickvals: axis.tickvals.filter(kept), ticktext: axis.ticktext.filter(kept) });
}
// Stacks panels vertically, with the label of the y axis inside each panel and a single time axis.
function stackWithSharedAxis(layout) {
  const xs = Object.keys(layout).filter(k => k.startsWith("xaxis")).sort(), n = xs.length;
  layout.annotations = layout.annotations.filter(a => a.xref !== "paper");
  xs.forEach((key, i) => {
    const y = layout[key.replace("x", "y")], top = 1 - i / n, last = i === n - 1;
    const [, name, unit] = /^Error, (.*) \((.*)\)$/.exec(y.title.text);
    layout[key].domain = [0, 1]; y.domain = [top - 1 / n + 0.04, top - 0.03];
    layout[key].showticklabels = last;
    if (!last) layout[key].title.text = "";
    y.title.text = unit; thinTicks(y, 4);
    layout.annotations.push({ text: capitalized(name), showarrow: false, xref: "paper", x: 0.02, xanchor: "left", yref: "paper", y: top - 0.03, yanchor: "top", font: { size: 11 } });
  });
}
// Removes the figure.
export function clearFigure() {
  shown.view = null;
  if (plot().data) Plotly.purge(plot());
  plot().dataset.listens = "";
  plot().setAttribute("aria-label", "No figure");
}
// Adapts the figure to the size of its element.
export function fitSize() {
  if (!shown.view || !plot().data) return;
  const now = `${plot().clientWidth <= NARROW_PX} ${lacksBarSpace(shown.view, plot())}`;
  // Redraw completely, because a legend would keep its old height, and a color bar its title.
  if (small !== null && small !== now) { const view = shown.view; clearFigure(); show(view); } else Plotly.Plots.resize(plot());
  small = now;
}

function listen() {
  if (plot().dataset.listens) return;
  plot().dataset.listens = "yes";
  plot().on("plotly_doubleclick", () => resetZoom());
  plot().on("plotly_relayout", change => onZoom(change));
  plot().on("plotly_selected", event => S.hooks.brushed && S.hooks.brushed(event && event.range ? event.range.x.map(Number) : null));
}
export function resetZoom() {
  if (!shown.view) return;
  if (["samples", "psd"].includes(shown.view.name) && (S.options.from || S.options.to)) { S.options = {}; S.hooks.redrawAll(); } else show(shown.view);
}
// Margin shown on each side of a range, as a multiple of its width and at least in decades.
const MARGIN = 1.5, DECADES = 0.15;
export const rangeWithMargin = ([low, high]) => [Math.max(low - MARGIN * (high - low), low / 10), high + MARGIN * (high - low)];
// Zooms to a range of the view's axis with a margin, or to the requested single frequencies.
export function zoomTo([low, high]) {
  const { name, layout } = shown.view, axis = layout.xaxis, unit = ["map", "samples"].includes(name) ? timeUnit() : 1;
  const log = axis.type === "log", ends = [low, high].map(v => log ? Math.log10(v) : v / unit);
  const room = Math.max(MARGIN * (ends[1] - ends[0]), log ? DECADES : 0), whole = [...axis.range];
  const [first, last] = name === "psd" && S.options.from ? [S.options.from, S.options.to].map(v => Math.log10(Number(v))) : [ends[0] - room, ends[1] + room];
  const range = [Math.max(first, whole[0]), Math.min(last, whole[1])];
  if (!(range[1] > range[0])) return;
  const change = { "xaxis.range[0]": range[0], "xaxis.range[1]": range[1] }, height = heightRange(range);
  if (log && layout.yaxis.type === "log" && height) Object.assign(change, { "yaxis.range[0]": height[0], "yaxis.range[1]": height[1] });
  Plotly.relayout(plot(), change);
}
// Height range of measured points and model, and of the maxima of single frequencies; their minima are too low.
function heightRange([low, high]) {
  let bottom = Infinity, top = -Infinity;
  for (const trace of shown.view.data) {
    const kind = trace.meta === "measured" || trace.meta === "model" ? 2 : trace.meta === "single" ? 1 : 0;
    if (kind) trace.x.forEach((x, i) => {
      const at = Math.log10(x), y = Math.log10(trace.y[i]);
      if (!(at >= low && at <= high) || !Number.isFinite(y)) return;
      top = Math.max(top, y); if (kind === 2) bottom = Math.min(bottom, y);
    });
  }
  return top > bottom ? [bottom - 0.3, top + 0.15] : null;
}
// Number of seconds in the unit of the time axis.
export function timeUnit(view = shown.view) {
  const text = Object.keys(view.layout).filter(k => k.startsWith("xaxis")).map(k => (view.layout[k].title || {}).text || "").join(" ");
  const found = /\((d|h|min)\)/.exec(text);
  return { d: 86400, h: 3600, min: 60 }[found && found[1]] || 1;
}
// After a zoom: requests the samples of the new range, or sets finer ticks.
function onZoom(change) {
  const keys = Object.keys(change).filter(k => /^[xy]axis\d*\.range/.test(k));
  if (!keys.length || !shown.view) return;
  if (shown.view.name === "samples" && change["xaxis.range[0]"] !== undefined) {
    const unit = timeUnit();
    S.options = { from: String(change["xaxis.range[0]"] * unit), to: String(change["xaxis.range[1]"] * unit) };
    S.hooks.redrawAll();
    return;
  }
  // The ticks of the whole view are too few for a part of it. Linked axes get the same ticks.
  const more = {}, layout = plot()._fullLayout, own = new Set(keys.map(k => k.split(".")[0]));
  for (const name of Object.keys(layout).filter(k => /^[xy]axis/.test(k))) {
    const matched = layout[name].matches, leader = matched ? matched.replace(/^[xy]/, "$&axis") : null;
    if (!own.has(name) && !own.has(leader)) continue;
    const { range, type, _length } = layout[name], found = roundTicks(range, type === "log", name[0] === "x" ? _length / 80 : _length / 36);
    Object.assign(more, { [`${name}.tickmode`]: "array", [`${name}.tickvals`]: found, [`${name}.ticktext`]: found.map(v => tickText(v)) });
  }
  Plotly.relayout(plot(), more);
}
// At most `most` round ticks: evenly spaced within a decade, else at 1, 2, 5 or at decades.
function roundTicks([a, b], log, most) {
  const [low, high] = [Math.min(a, b), Math.max(a, b)].map(v => log ? 10 ** v : v);
  if (log && high / low > 10) {
    const out = m => { const all = []; for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++) for (const f of m) if (f * 10 ** k >= low && f * 10 ** k <= high) all.push(Number((f * 10 ** k).toPrecision(3))); return all; };
    return [[1, 2, 5], [1, 3], [1]].map(out).find(v => v.length <= most) || out([1]).filter((_, i, all) => i % Math.ceil(all.length / most) === 0);
  }
  const raw = (high - low) / Math.max(2, most), size = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map(m => m * size).find(s => s >= raw), out = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) out.push(Number((k * step).toPrecision(8)));
  return out;
}
const tickText = v => Math.abs(v) >= 1e4 || (v !== 0 && Math.abs(v) < 1e-3) ? numberText(v) : String(Number(v.toPrecision(6))).replace("-", "−");

export const effectTraces = () => shown.view.data.map((trace, i) => ({ trace, i })).filter(({ trace }) => /^(effect|limit)-/.test(trace.meta || ""));
// Draws one effect with a thick line and the others pale; null resets this.
export function highlightEffect(place) {
  if (!shown.view || !plot().data) return;
  const found = effectTraces(), meta = [`effect-${place}`, `limit-${place}`];
  if (found.length) Plotly.restyle(plot(), {
    "line.width": found.map(({ trace }) => place !== null && meta.includes(trace.meta) ? 3.6 : (trace.line && trace.line.width) || 1.2),
    opacity: found.map(({ trace }) => place === null || meta.includes(trace.meta) ? 1 : 0.25) }, found.map(({ i }) => i));
}
// Shades where an effect acts: a range of the view's axis; on the map, frequencies, times or both.
export function shadeRange(acts) {
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
// Value of a line at one of its points; model and effects have more points than the measured curve.
export const valueAt = (trace, x) => { const k = trace.x.findIndex(v => Math.abs(v / x - 1) < 1e-5); return k < 0 ? null : trace.y[k]; };
