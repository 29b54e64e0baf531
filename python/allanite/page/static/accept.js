// Verdict on an export file before it is saved, and the acceptance test of each axis against a data sheet.
import { $, S, act, capitalized, el, replaceContent, request } from "./core.js";
import { allAxesDone } from "./axes.js";

// The verdict of the chosen file is shown above the export button.
// A data sheet in TOML.
const EXAMPLE = `[gyroscope]
angle_random_walk = "0.3 deg/sqrt(h)"
in_run_bias_stability = "12 deg/h"

[accelerometer]
noise_density = "240 ug/sqrt(Hz)"`;
let requests = 0;
export async function updateExportVerdict() {
  const mine = ++requests, name = $("target").value, there = S.state.recording && S.state.ladder.length;
  $("export").disabled = true;
  $("improve-first").hidden = !there || allAxesDone();
  replaceContent($("export-verdict"), there ? el("p", { class: "faint" }, "Writing the file …") : null);
  if (!there || !name) return;
  try {
    const found = await request(`tabs/${S.tab}/part/export?target=${encodeURIComponent(name)}`);
    if (mine !== requests) return;
    const open = S.state.axes.filter(a => ["fails", "fitted"].includes(a.state)).map(a => a.name);
    replaceContent($("export-verdict"), found.verdict ? el("p", { class: /^Use: no/.test(found.verdict) ? "bad" : "good" }, found.verdict) : null,
      found.missing ? el("p", { class: "bad" }, `${found.missing}.`) : null,
      open.length ? el("p", {}, `Not adequate yet: ${open.join(", ")}.`) : null);
    $("export").disabled = false;
  } catch (error) { if (mine === requests) replaceContent($("export-verdict"), el("p", { class: "bad" }, error.message)); }
}
export function acceptancePanel() {
  const node = el("div", { id: "acceptance" }, el("p", { class: "faint" }, "Comparing with the data sheet …"));
  fetchInto(node);
  return node;
}
async function fetchInto(node) {
  const sheet = el("button", { class: "main", onclick: () => S.hooks.chooseFile("sheet") }, S.state.sheet ? "Another data sheet …" : "Open a data sheet …");
  let found;
  try { found = await request(`tabs/${S.tab}/part/acceptance`); } catch (error) { node.replaceChildren(el("p", {}, error.message), sheet); return; }
  if (!found) { node.replaceChildren(el("p", {}, "Does each axis meet its data sheet? Open a TOML or JSON file with the values of the data sheet, for example:"), el("pre", {}, EXAMPLE), sheet); return; }
  const kind = { meets: "adequate", "does not meet": "fails", undecided: "" }, sign = { meets: "✓", "does not meet": "✗", undecided: "?" };
  const word = v => `${sign[v]} ${capitalized(v)}`;
  node.replaceChildren(el("table", {}, el("caption", {}, `Acceptance test: ${found.sheet}`),
    el("thead", {}, el("tr", {}, ...["Axis", "Figure", "Limit", "Measured", "95 % interval", "Verdict", "Remark"].map(t => el("th", {}, t)))),
    el("tbody", {}, ...found.axes.flatMap(a => a.figures.map((f, i) => el("tr", {}, el("th", { scope: "row" }, i ? "" : a.name), el("td", {}, f.name), el("td", {}, f.limit), el("td", {}, f.measured), el("td", {}, f.interval), el("td", { class: kind[f.verdict] }, word(f.verdict)), el("td", { class: "remark" }, f.remark)))))),
    ...found.axes.map(a => el("p", { class: { meets: "good", "does not meet": "bad" }[a.verdict] || "" }, `${a.name}: ${word(a.verdict)}${a.needs ? `; a record of ${a.needs} would probably settle it` : ""}`)),
    ...found.remarks.map(t => el("p", { class: "faint" }, capitalized(t))), sheet);
}
