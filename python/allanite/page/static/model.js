// The model: its effects and their values, removed effects, the catalog, and the model entry.
import { $, S, act, capitalized, el, fillSelect, icon, hasUserJob, replaceContent, numberText, request, svg } from "./core.js";
import { highlightEffect } from "./draw.js";

// Holds a value fixed in fits, or releases it.
const toggleHold = (c, v) => act({ do: "hold", place: c.place, name: v.name, value: v.held ? null : v.number });

// Shows each effect of the model with its values.
export function updateChips() {
  const state = S.state;
  if ($("chips").querySelector("input")) return;  // do not disturb a value that is being typed
  const units = state.chip_units, at = Math.max(0, units.findIndex(u => u.value === state.chip_unit));
  fillSelect($("unit"), units.map((u, i) => [i, u.text]), at);
  $("unit").hidden = units.length < 2;
  $("add-effect").hidden = !state.chips.length;
  $("model").textContent = state.chips.map(c => c.short).join(" + ");
  replaceContent($("chips"), ...state.chips.map(c => {
    const color = c.color ? `var(--${c.color})` : "var(--line)";
    const values = c.values.filter(v => v.free || c.values.length < 3).slice(0, 4);
    const node = el("div", { class: "chip", style: `--own:${color}`, title: capitalized(c.physics), "data-kind": c.kind,
      onmouseenter: () => highlightChip(node, c.place), onmouseleave: () => highlightChip(null, null), onfocusin: () => highlightChip(node, c.place), onfocusout: () => highlightChip(null, null) },
      el("span", { class: "name" }, capitalized(c.name)),
      el("div", { class: "values" }, ...values.map(v => valueRow(c, v))),
      el("button", { class: "icon remove", title: `Remove ${c.name}`, "aria-label": `Remove ${c.name}`, "data-work": true, onclick: () => act({ do: "remove", place: c.place }) }, icon("close")));
    return node;
  }));
  updateRemoved(); updateTrial();
}
// Element with a value of an effect: symbol, text, interval and lock.
function valueRow(c, v) {
  const row = el("div", { class: "value" }, el("span", { class: "symbol" }, v.symbol));
  if (!v.free) { row.append(el("span", { class: "text" }, v.text), el("span", { class: "spread", title: v.spread }, v.spread)); return row; }
  const what = `${v.name} of ${c.name}`, limits = limitsText(v), spread = v.kept || v.spread;
  row.append(
    el("button", { class: "text", title: `Try another value of ${what}${v.limits ? ", or set limits on it" : ""}`, "aria-label": `${what}: ${v.text}. Try another value`, "data-work": true, onclick: () => editValue(row, c, v) }, v.text),
    el("span", { class: "spread", title: v.kept ? capitalized(v.kept) : `95 % interval ${v.spread}` }, spread, v.over_all ? el("small", { class: "over-all", title: "95 % interval over all models that explain this record equally well" }, v.over_all) : null, limits ? el("small", { class: "limits" }, limits) : null),
    el("button", { class: "icon lock", title: v.held ? `Held fixed: release ${what}` : `Hold ${what} fixed at this value`, "aria-pressed": String(v.held), "data-work": true,
      "aria-label": `Hold ${what}`, onclick: () => toggleHold(c, v) }, icon(v.held ? "locked" : "open")));
  return row;
}
// Text of the limits of a value.
function limitsText(v) {
  const [low, high] = v.limits || [null, null];
  return low === null ? high === null ? "" : `at most ${high}` : high === null ? `at least ${low}` : `within ${low} … ${high}`;
}
// Shows input fields for a trial value and, if allowed, for its limits.
function editValue(row, c, v) {
  const field = (what, value) => el("input", { value: value ?? "", "aria-label": `${what} in ${v.unit || "1"}`, inputmode: "decimal" });
  const input = field(v.name, v.number), ends = v.limits ? v.limits.map((end, i) => field(`${i ? "Highest" : "Lowest"} ${v.name}`, end)) : [];
  const was = row.querySelector(".text").title;
  let open = true;
  const end = keep => {
    if (!open) return;
    open = false;  // set before removing the fields, because removal triggers their blur event
    row.replaceChildren();
    const [low, high] = ends.map(e => e.value.trim());
    if (keep === "value" && input.value.trim() && Number(input.value) !== v.number) act({ do: "what-if", place: c.place, name: v.name, value: input.value });
    if (keep === "limits" && ends.some((e, i) => e.value.trim() !== String(v.limits[i] ?? ""))) act({ do: "limits", place: c.place, name: v.name, low, high });
    updateChips(); S.hooks.updateJob();
    [...document.querySelectorAll(".chip .text")].find(x => x.title === was)?.focus();
  };
  for (const one of [input, ...ends]) {
    one.addEventListener("blur", event => { if (!row.contains(event.relatedTarget)) end(null); });
    one.addEventListener("keydown", event => {
      if (event.key === "Enter") { event.preventDefault(); end(one === input ? "value" : "limits"); }  // otherwise Enter would press the element that receives the focus
      if (event.key === "Escape") { event.stopPropagation(); end(null); }
    });
  }
  row.replaceChildren(el("span", { class: "symbol" }, v.symbol), input, el("span", { class: "spread" }, `${v.unit}  Enter: try the value`));
  if (ends.length) row.append(el("span", { class: "ends" }, ends[0], "…", ends[1], el("small", {}, "Enter: set the limits")));
  input.focus(); input.select();
}
// Highlights an effect among the chips and in the figure; null ends this.
function highlightChip(node, place) {
  for (const chip of document.querySelectorAll(".chip")) chip.classList.toggle("lit", chip === node);
  highlightEffect(place);
}
// Shows buttons that restore removed effects.
function updateRemoved() {
  $("tray").hidden = !S.state.tray.length;
  replaceContent($("tray"), el("span", {}, "Removed:"), ...S.state.tray.map(t => el("button", { title: `Bring back ${t.text}`, "aria-label": `Bring back ${t.name}`, "data-work": true, onclick: () => act({ do: "back", place: t.place }) }, icon("back"), capitalized(t.name))));
}
// Shows the misfit with trial values, and buttons that fit from them or discard them.
function updateTrial() {
  const found = S.state.preview;
  $("tried").hidden = !found;
  if (found) replaceContent($("tried"),
    el("span", {}, `Trial value, not fitted: χ²/dof ${numberText(found.before)} → `, el("b", {}, numberText(found.chi2))),
    el("button", { class: "main", "data-work": true, onclick: () => act({ do: "fit-tried" }) }, "Fit from here"),
    el("button", { onclick: () => act({ do: "drop" }) }, "Discard"));
}

// -- the catalog
export async function openCatalogue() {
  if (!S.state.chips.length) return;
  const found = await request(`tabs/${S.tab}/part/catalogue`);
  const there = new Set(S.state.chips.map(c => c.kind)), columns = S.state.covariates || [];
  const picture = (title, paths) => paths && svg("0 0 100 60", [
    { d: paths[1], class: "base" }, { d: paths[0], class: "own" }], { class: "picture", preserveAspectRatio: "none", role: "img", "aria-label": title, "aria-hidden": "false" });
  const card = e => {
    const has = there.has(e.kind) && e.single, lacks = e.needs.length && !columns.length;
    const drawn = (title, paths, down, across) => paths && el("figure", {}, picture(title, paths), el("figcaption", {}, `${down} over ${across}`));
    return el("article", { "data-kind": e.kind, class: "effect", "data-words": `${e.name} ${e.short} ${e.group} ${e.physics} ${e.looks_like}`.toLowerCase() },
      el("div", { class: "pictures" }, drawn(`${e.name}: Allan curve`, e.pictures.curve, "Allan deviation σ", "τ"), drawn(`${e.name}: spectrum`, e.pictures.spectrum, "Density S", "f")),
      el("div", {}, el("h3", {}, capitalized(e.name), el("code", {}, e.short)), el("p", {}, capitalized(e.physics), "."),
        el("p", { class: "look" }, el("b", {}, "Looks like "), e.looks_like, ".")),
      el("button", { class: "main", disabled: has || Boolean(lacks), title: lacks ? "This effect needs a logged column such as temperature" : null,
        "aria-label": `Add ${e.name}`, onclick: () => { $("catalogue").close(); act({ do: "put", effect: e.needs.length ? `${e.short}(column=${columns[0]})` : e.short }); } }, has ? "In the model" : "Add"));
  };
  // Each group lists its common effects, then the rare ones under "More".
  $("effects").replaceChildren(...[...new Set(found.map(e => e.group))].map(name => {
    const own = found.filter(e => e.group === name), common = own.filter(e => e.common), rare = own.filter(e => !e.common);
    return el("section", { "aria-label": name }, el("h3", {}, name), el("div", { class: "effects" }, ...common.map(card)),
      rare.length ? el("details", { open: !common.length }, el("summary", {}, `More: ${rare.map(e => e.name).join(", ")}`), el("div", { class: "effects" }, ...rare.map(card))) : null);
  }));
  $("catalogue-search").value = "";
  searchCatalogue();
  $("catalogue").showModal();
}
// Shows the effects whose description contains every word, and opens the lists of rare effects that match.
function searchCatalogue() {
  const words = $("catalogue-search").value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const node of document.querySelectorAll("#effects .effect")) node.hidden = !words.every(w => node.dataset.words.includes(w));
  for (const node of document.querySelectorAll("#effects :is(section, details)")) {
    const found = node.querySelectorAll(".effect:not([hidden])").length > 0;
    node.hidden = !found;
    if (node.matches("details") && words.length) node.open = found;
  }
  $("no-effects").hidden = document.querySelectorAll("#effects .effect:not([hidden])").length > 0;
}
export function openModelField() {
  $("catalogue").close();
  $("typed").hidden = false;
  $("typed-model").value = (S.state.model || "").replace(/\(([^)]*)\)/g, (whole, inside) => /[![]/.test(inside) ? whole : "");
  $("typed-model").focus(); $("typed-model").select();
}
export function listenModel() {
  $("add-effect").onclick = openCatalogue;
  $("catalogue-close").onclick = () => $("catalogue").close();
  $("catalogue-type").onclick = openModelField;
  $("catalogue-search").oninput = searchCatalogue;
  $("unit").onchange = event => act({ do: "unit", unit: S.state.chip_units[event.target.value].value });
  $("typed").onsubmit = async event => {
    event.preventDefault();
    if (await act({ do: "model", model: $("typed-model").value })) $("typed").hidden = true;
  };
  $("typed-model").onkeydown = event => { if (event.key === "Escape") { event.stopPropagation(); $("typed").hidden = true; $("add-effect").focus(); } };
}
export const mainValue = chip => chip && (chip.values.find(v => v.free && !["s", "Hz"].includes(v.unit)) || chip.values.find(v => v.free));
export const allowed = () => !hasUserJob();
