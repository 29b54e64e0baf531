// The form that shows how each column of a log is interpreted, with open questions and corrections.
import { $, S, act, el, fillSelect, numberText, request, svg, unbroken } from "./core.js";

const ROLES = { sensor: "Sensor", time: "Clock", temperature: "Temperature", other: "Other" };
let found = null;

// True if the log could not be read, or a sensor has no unit.
export const hasDoubts = () => Boolean(S.state.problem || S.state.reading.unitless.length);
// Opens the form, and fills it with how the reader interprets the log.
export async function openReadingForm() {
  const state = S.state;
  if (!state.log || state.fixed) return;
  $("form-log").textContent = state.log;
  $("form-problem").textContent = unbroken(state.problem || "");
  $("form-rate").value = state.reading.rate ? Number(state.reading.rate.toPrecision(8)) : "";
  $("form-quantity").value = state.reading.quantity || "";
  $("form-columns").replaceChildren(el("p", { class: "faint" }, "Reading the columns …"));
  $("form-offers").replaceChildren();
  $("form-kinds").replaceChildren();
  fillSelect($("form-time"), [["", "As found"]], "");
  if (!$("form").open) $("form").showModal();
  found = null;
  try { found = await request(`tabs/${S.tab}/part/inspect`); }
  catch (error) { $("form-columns").replaceChildren(el("p", { class: "bad" }, error.message)); return; }
  fillTimeColumns(); fillOffers(); fillColumns(); fillKinds();
}
function fillTimeColumns() {
  const clocks = found.columns.filter(c => c.role === "time" && c.name !== "(time)");
  fillSelect($("form-time"), [["", "As found"], ["none", "None: use the sampling rate"], ...clocks.map(c => [c.name, c.rate ? `${c.name} (${Number(c.rate.toPrecision(5))} Hz)` : c.name])], S.state.reading.time_column || "");
}
// Findings, and a button that applies the proposed rate.
function fillOffers() {
  const out = [], rate = found.columns.find(c => c.role === "time" && c.rate);
  const now = Number($("form-rate").value);
  if (rate && Math.abs(rate.rate / now - 1) > 1e-3) out.push(el("p", {}, `The time column ${rate.name} gives ${Number(rate.rate.toPrecision(5))} Hz${now ? `, not ${now} Hz` : ""}. `,
    el("button", { type: "button", onclick: () => { $("form-rate").value = Number(rate.rate.toPrecision(8)); } }, `Use ${Number(rate.rate.toPrecision(5))} Hz`)));
  for (const f of found.findings) if (f.kind !== "rate") out.push(el("p", { class: f.severity }, f.message));
  $("form-offers").replaceChildren(...out);
}
function fillColumns() {
  const reading = S.state.reading, chosen = new Set(reading.columns), units = S.state.units;
  const head = el("tr", {}, ...["Use", "Column", "Unit", "", "Interpreted as", "First rows", "Whole record"].map(t => el("th", {}, t)));
  const rows = found.columns.map(c => {
    const sensor = ["sensor", "other"].includes(c.role) && c.first.length > 0, used = chosen.size ? chosen.has(c.name) : c.used && c.role === "sensor";
    const own = reading.column_units[c.name] || c.unit || "";
    const known = units.map(u => [u.value, u.text]);
    const list = own && !units.some(u => u.value === own) ? [[own, own], ...known] : known;
    const unit = sensor ? el("select", { "data-unit": c.name, "data-was": own || "1", "aria-label": `Unit of ${c.name}`, onchange: setUnitOfOtherAxes }, ...list.map(([v, t]) => el("option", { value: v, selected: v === (own || "1") }, t))) : el("span", {}, c.unit || "");
    return el("tr", { class: used ? "" : "unused" },
      el("td", {}, sensor ? el("input", { type: "checkbox", "data-use": c.name, checked: used, "aria-label": `Use ${c.name}`, onchange: event => event.target.closest("tr").classList.toggle("unused", !event.target.checked) }) : null),
      el("th", { scope: "row" }, c.name || "(no name)"), el("td", {}, unit), el("td", { class: "doubt" }, doubtText(c)), el("td", {}, `${ROLES[c.role] || c.role}${c.rate ? `, ${Number(c.rate.toPrecision(5))} Hz` : ""}${c.role === "temperature" && c.used ? ": offered as a possible cause" : ""}`),
      el("td", { class: "first" }, c.first.map(v => Math.abs(v) < 1e6 ? String(Number(v.toPrecision(5))).replace("-", "−") : numberText(v)).join("  ")), el("td", {}, sparkline(c.spark)));
  });
  $("form-columns").replaceChildren(el("table", {}, el("thead", {}, head), el("tbody", {}, ...rows)));
}
// One unit for all gyroscopes, and one for all accelerometers.
const SENSORS = { "angular rate": "All gyroscopes", acceleration: "All accelerometers" };
function fillKinds() {
  const offered = Object.entries(found.kinds).map(([kind, units]) => [kind, units, found.columns.filter(c => c.kind === kind && $("form").querySelector(`[data-unit="${CSS.escape(c.name)}"]`))]).filter(([, , own]) => own.length > 1);
  const text = u => S.state.units.find(v => v.value === u)?.text || u;
  $("form-kinds").replaceChildren(...offered.map(([kind, units, own]) => el("label", {}, `${SENSORS[kind]}: unit `, el("select", { "data-kind": kind, onchange: event => {
    for (const c of own) if (event.target.value) { const select = $("form").querySelector(`[data-unit="${CSS.escape(c.name)}"]`); if (![...select.options].some(o => o.value === event.target.value)) select.append(el("option", { value: event.target.value }, text(event.target.value))); select.value = event.target.value; }
  } }, el("option", { value: "" }, "As below"), ...units.map(u => el("option", { value: u }, text(u)))))));
}
// The other axes of a sensor get the same unit, unless they had a different one.
function setUnitOfOtherAxes(event) {
  const stem = name => name.replace(/[xyz](?=[^a-z]*$)/i, "·"), { unit, was } = event.target.dataset;
  for (const other of $("form").querySelectorAll("[data-unit]")) if (other.dataset.was === was && stem(other.dataset.unit) === stem(unit)) other.value = event.target.value;
}
// Text of what is doubtful about a column.
function doubtText(c) {
  if (c.role === "time") return "Not analyzed";
  if (c.role === "other" && c.reason) return `Not analyzed: ${c.reason}`;
  return c.doubts.map(d => d.replace(": give the unit", ": choose it")).map(d => d[0].toUpperCase() + d.slice(1)).join(". ");
}
function sparkline(pairs) {
  if (!pairs) return "";
  const x = i => (pairs.length > 1 ? 98 * i / (pairs.length - 1) + 1 : 50).toFixed(1), y = v => (19 - 18 * v).toFixed(1);
  const d = pairs.map(([low, high], i) => low === null ? "" : `M${x(i)},${y(low)}V${Math.abs(y(high) - y(low)) < 0.8 ? y(high) - 0.8 : y(high)}`).join("");
  return svg("0 0 100 20", [{ d }], { class: "spark", preserveAspectRatio: "none" });
}
export function listenReading() {
  $("reading").onclick = openReadingForm;
  $("form").onclose = async () => {
    if ($("form").returnValue !== "yes") return;
    // Do not ask again before the log has been read with the new settings.
    S.asked = true;
    const boxes = [...$("form").querySelectorAll("[data-use]")], use = boxes.filter(b => b.checked).map(b => b.dataset.use);
    const usual = found ? found.columns.filter(c => c.used && c.role === "sensor").map(c => c.name) : [];
    const same = use.length === usual.length && use.every(n => usual.includes(n));
    const units = Object.fromEntries([...$("form").querySelectorAll("[data-unit]")].filter(s => use.includes(s.dataset.unit)).map(s => [s.dataset.unit, s.value]));
    const read = await act({ do: "read", rate: $("form-rate").value.trim(), quantity: $("form-quantity").value, time_column: $("form-time").value, columns: same ? [] : use, units });
    S.asked = read && hasDoubts();
    if (S.asked) openReadingForm();
  };
}
