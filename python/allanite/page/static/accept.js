// Before a file is saved: whether to use it. And the acceptance test: each axis by the figures of a data sheet.
import { $, S, act, capital, el, refill, speak } from "./core.js";
import { done } from "./axes.js";
import { get } from "./views.js";

// The dialog before an export; `after` an improvement of all axes it comes back.
let after = null;
export async function offerExport(name) {
  const title = [...$("target").options].find(o => o.value === name)?.textContent || name;
  $("exporting-title").textContent = `Export: ${title}`;
  refill($("exporting-text"), el("p", { class: "faint" }, "Writing the file …"));
  $("exporting-save").disabled = true;
  $("exporting-improve").hidden = done();
  if (!$("exporting").open) $("exporting").showModal();
  try {
    const found = await speak(`tabs/${S.tab}/part/export?target=${encodeURIComponent(name)}`);
    const open = S.state.axes.filter(a => ["fails", "fitted", "new"].includes(a.state)).map(a => a.name);
    refill($("exporting-text"), found.verdict ? el("p", { class: /^Use: no/.test(found.verdict) ? "bad" : "good" }, el("b", {}, found.verdict)) : null,
      found.missing ? el("p", { class: "bad" }, found.missing) : null,
      open.length ? el("p", {}, `Not adequate yet: ${open.join(", ")}.`) : el("p", { class: "good" }, "Every axis is adequate."));
    $("exporting-save").disabled = false;
  } catch (error) { refill($("exporting-text"), el("p", { class: "bad" }, error.message)); }
  $("exporting-save").onclick = () => { $("exporting").close(); get(name); };
  $("exporting-improve").onclick = () => { $("exporting").close(); after = name; act({ do: "improve", all: true }); };
}
// The work that an export waits for has ended.
export function exportAfter() {
  const name = after;
  after = null;
  if (name && done()) offerExport(name);
}
export function acceptance() {
  const node = el("div", { id: "acceptance" }, el("p", { class: "faint" }, "Comparing with the data sheet …"));
  fetchInto(node);
  return node;
}
async function fetchInto(node) {
  const sheet = el("button", { class: "main", onclick: () => S.hooks.pick("sheet") }, S.state.sheet ? "Another data sheet …" : "Open a data sheet …");
  let found;
  try { found = await speak(`tabs/${S.tab}/part/acceptance`); } catch (error) { node.replaceChildren(el("p", {}, error.message), sheet); return; }
  if (!found) { node.replaceChildren(el("p", {}, "Does each axis meet its data sheet? Open a TOML or JSON file with the printed figures."), sheet); return; }
  const kind = { meets: "adequate", "does not meet": "fails", undecided: "" }, sign = { meets: "✓", "does not meet": "✗", undecided: "?" };
  const word = v => `${sign[v]} ${capital(v)}`;
  node.replaceChildren(el("table", {}, el("caption", {}, `Acceptance by ${found.sheet}`),
    el("thead", {}, el("tr", {}, ...["Axis", "Figure", "Limit", "Measured", "95 % interval", "Verdict", "Remark"].map(t => el("th", {}, t)))),
    el("tbody", {}, ...found.axes.flatMap(a => a.figures.map((f, i) => el("tr", {}, el("th", { scope: "row" }, i ? "" : a.name), el("td", {}, f.name), el("td", {}, f.limit), el("td", {}, f.measured), el("td", {}, f.interval), el("td", { class: kind[f.verdict] }, word(f.verdict)), el("td", { class: "remark" }, f.remark)))))),
    ...found.axes.map(a => el("p", { class: { meets: "good", "does not meet": "bad" }[a.verdict] || "" }, `${a.name}: ${word(a.verdict)}${a.needs ? `; a record of ${a.needs} would probably decide` : ""}`)),
    ...found.remarks.map(t => el("p", { class: "faint" }, capital(t))), sheet);
}
