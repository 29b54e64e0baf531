"use strict";
const $ = id => document.getElementById(id);
const el = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value === true) node.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(key, value);
  }
  node.append(...children.filter(c => c !== null));
  return node;
};
// New content; the focus stays on what is called the same, or in the same part of the page.
function refill(node, ...children) {
  const name = x => x.getAttribute("aria-label") || x.textContent;
  const now = document.activeElement, inside = now !== node && node.contains(now), called = inside ? name(now) : null;
  node.replaceChildren(...children.filter(c => c !== null));
  if (inside) ([...node.querySelectorAll("button, summary, article")].find(x => name(x) === called) || node).focus();
}
let tab = null, state = null, view = "allan", drawn = "", seen = -1, asked = false;

// -- speaking to the server
async function speak(path, options = {}) {
  const answer = await fetch(path, options);
  const text = await answer.text();
  let body;
  try { body = JSON.parse(text); } catch { body = { error: text.trim() }; }
  if (!answer.ok) throw new Error(body.error || `the server answered ${answer.status}`);
  return body;
}
async function act(order) {
  try { take(await speak(`tabs/${tab}/act`, { method: "POST", body: JSON.stringify(order), headers: { "content-type": "application/json" } })); }
  catch (error) { say(error.message); }
}
function say(text) {
  $("message").textContent = text;
  $("message").hidden = !text;
  clearTimeout(say.timer);
  if (text) say.timer = setTimeout(() => { $("message").hidden = true; }, 12000);
}
async function follow() {
  for (;;) {
    const busy = state && state.job && state.job.busy;
    await new Promise(done => setTimeout(done, busy ? 120 : 500));
    if (document.hidden && !busy) continue;
    try { take(await speak(`tabs/${tab}?seen=${seen}`)); }
    catch (error) { say(error instanceof TypeError ? "the server has ended: start allanite explore again" : error.message); return; }
  }
}

// -- showing
function take(next) {
  // Where nothing is new the server only tells how far its work is.
  const fresh = "version" in next && next.version !== seen;
  const before = Boolean(state && state.job && state.job.busy);
  state = { ...state, ...next };
  if (fresh) {
    seen = next.version;
    head(); audit(); chips(); cards(); ladder(); beside();
    figure();
    if (next.job && !next.job.busy && next.job.error) say(next.job.error);
    if (next.problem && !asked) { asked = true; ask(); }
  }
  if (fresh || before !== Boolean(state.job && state.job.busy)) verdict();
  work();
}
function work() {
  const job = state.job, busy = Boolean(job && job.busy), hands_off = busy && !job.gives_way;
  $("work").hidden = !busy;
  document.body.dataset.busy = busy;
  document.body.dataset.adequate = Boolean(state.adequate);
  if (busy) {
    $("work-name").textContent = $("work-name").title = job.name + " …";
    if (job.total) { $("bar").max = job.total; $("bar").value = job.done; } else $("bar").removeAttribute("value");
  }
  // Not `disabled`, which would take the focus away.
  for (const button of document.querySelectorAll("[data-work]")) button.setAttribute("aria-disabled", hands_off);
  $("improve").setAttribute("aria-disabled", hands_off || !state.cards.some(c => c.significant));
  $("undo").disabled = !state.undo; $("redo").disabled = !state.redo;
}
function fill(select, texts, chosen) {
  const now = JSON.stringify([texts, chosen]);
  if (select.dataset.now === now) return;
  select.dataset.now = now;
  select.replaceChildren(...texts.map((text, i) => el("option", { value: i, selected: i === chosen }, text)));
}
function head() {
  const r = state.recording;
  fill($("logs"), state.logs.length ? state.logs : ["none"], state.log_number === null ? 0 : state.log_number);
  $("logs").disabled = state.logs.length < 2;
  fill($("columns"), r ? r.columns.map(c => `${c.name} (${c.unit})`) : ["none"], r ? r.column : 0);
  $("columns").disabled = !r || r.columns.length < 2;
  $("recording").textContent = r ? r.text : "";
  $("recording").title = r ? r.text : "";
  $("reading").disabled = !state.log || state.fixed;
  document.title = state.log ? `${state.log} – allanite` : "allanite";
}
function audit() {
  const findings = state.recording ? state.recording.audit : [];
  $("audit").hidden = !state.recording;
  $("audit").replaceChildren(...(findings.length
    ? findings.map(f => el("p", { class: f.severity }, el("b", {}, f.severity === "warning" ? "⚠ take care" : "note"), f.message))
    : [el("p", { class: "info" }, el("b", {}, "✓ audit"), "nothing odd about the samples: no gaps, no clipping, no outliers")]));
}
function chips() {
  if ($("chips").querySelector("input")) return;  // a value is being typed
  const units = state.chip_units.map(u => u.text), at = state.chip_units.findIndex(u => u.value === state.chip_unit);
  fill($("unit"), units, Math.max(0, at));
  $("unit").parentElement.hidden = units.length < 2;
  $("model").textContent = state.chips.map(c => c.short).join(" + ");
  refill($("chips"), ...state.chips.map(c => {
    const color = c.color ? `var(--${c.color})` : "var(--line)";
    const node = el("div", { class: "chip", style: `border-left-color:${color}`, title: c.physics, "data-kind": c.kind,
      onmouseenter: () => lit(node, c.place), onmouseleave: () => lit(null, null), onfocusin: () => lit(node, c.place), onfocusout: () => lit(null, null) },
      el("span", { class: "name" }, c.name),
      el("button", { class: "icon", title: `Remove ${c.name}`, "aria-label": `remove ${c.name}`, "data-work": true, onclick: () => act({ do: "remove", place: c.place }) }, "×"),
      ...c.values.filter(v => v.free || c.values.length < 3).slice(0, 4).map(v => value(c, v)));
    return node;
  }));
  const tried = state.preview;
  $("tried").hidden = !tried;
  if (tried) $("tried").replaceChildren(
    el("span", {}, `tried, not fitted: χ²/dof ${short(tried.before)} → `, el("b", {}, short(tried.chi2))),
    el("button", { class: "main", "data-work": true, onclick: () => act({ do: "fit-tried" }) }, "fit from here"),
    el("button", { onclick: () => act({ do: "drop" }) }, "forget"));
}
const short = x => x === null ? "–" : x >= 1000 ? x.toPrecision(4).replace(/e\+?/, "·10^") : x.toPrecision(3);
function value(c, v) {
  const row = el("div", { class: "value" }, el("span", { class: "symbol" }, v.symbol));
  if (v.free) {
    row.append(el("button", { class: "text", title: `Try another ${v.name}: see the misfit before fitting`, onclick: () => edit(row, c, v) }, v.text),
      el("span", { class: "spread", title: v.spread }, v.spread),
      el("button", { class: "icon", "aria-pressed": v.held, "data-work": true, title: v.held ? `Let ${v.name} free` : `Hold ${v.name} at ${v.text}`,
        "aria-label": v.held ? `free ${v.name} of ${c.name}` : `hold ${v.name} of ${c.name}`,
        onclick: () => act({ do: "hold", place: c.place, name: v.name, value: v.held ? null : v.number }) }, v.held ? "held" : "hold"));
  } else row.append(el("span", { class: "text" }, v.text), el("span", { class: "spread", title: v.spread }, v.spread));
  return row;
}
function edit(row, c, v) {
  const input = el("input", { value: v.number, "aria-label": `${v.name} in ${v.unit || "1"}`, inputmode: "decimal" });
  let open = true;
  const end = keep => {
    if (!open) return;
    open = false;  // before the input goes, which blurs it
    input.remove();
    if (keep && input.value.trim() && Number(input.value) !== v.number) act({ do: "what-if", place: c.place, name: v.name, value: input.value });
    chips(); work();
    if (was) [...document.querySelectorAll(".chip .text")].find(x => x.title === was)?.focus();
  };
  const was = row.querySelector(".text").title;
  input.addEventListener("blur", () => end(false));
  input.addEventListener("keydown", event => {
    if (event.key === "Enter") { event.preventDefault(); end(true); }  // else it would press what gets the focus
    if (event.key === "Escape") { event.stopPropagation(); end(false); }
  });
  row.replaceChildren(el("span", { class: "symbol" }, v.symbol), input, el("span", { class: "spread" }, `${v.unit}  Enter tries it`));
  input.focus(); input.select();
}
function lit(node, place) {
  for (const chip of document.querySelectorAll(".chip")) chip.classList.toggle("lit", chip === node);
  Draw.light(place);
}
function verdict() {
  const busy = Boolean(state.job && state.job.busy), out = [];
  const line = (kind, bold, text, more = {}) => el("p", { class: kind, ...more }, bold ? el("b", {}, bold + " ") : null, text);
  const offer = (text, doing) => el("button", { onclick: doing }, text);
  if (state.problem) out.push(line("bad", "not read:", state.problem), offer("say how to read it …", ask));
  else if (busy && !state.checked) out.push();
  else if (!state.ladder.length && state.log) out.push(line("", "cancelled:", "nothing is fitted"), offer("read it again", () => act({ do: "open", log: state.log_number })));
  else if (!state.ladder.length) out.push(line("", "", "open a log first"), offer("open a log …", () => pick("log")));
  else if (!state.checked) out.push(line("", "cancelled:", "not looked for what is missing"), offer("look", () => act({ do: "check" })));
  else if (state.adequate) out.push(line("good", "✓ adequate:", "nothing is left that chance does not explain"));
  else out.push(line("bad", "fails", state.where.length ? state.where[0] : "somewhere: the model is not adequate", { title: state.where.join("\n") }));
  refill($("verdict"), ...out);
}
function cards() {
  refill($("cards"), ...(state.adequate ? [] : state.cards).map((c, i) => {
    const percent = x => `width:${Math.max(1, Math.round(100 * x))}%`;
    const shade = on => () => Draw.shade(on ? c.acts : null, getComputedStyle(document.documentElement).getPropertyValue("--accent").trim());
    return el("article", { class: i === 0 && c.significant ? "card first" : "card", "data-kind": c.kind, "aria-label": c.name, tabindex: 0,
      onmouseenter: shade(true), onmouseleave: shade(false), onfocusin: shade(true), onfocusout: shade(false) },
      el("header", {}, el("h3", {}, c.name), c.significant ? null : el("span", { class: "tag" }, "not significant"),
        el("button", { class: i === 0 ? "main add" : "add", "data-work": true, "aria-label": `add ${c.name}`, onclick: () => act({ do: "add", number: c.number }) }, "Add")),
      el("p", {}, c.sentence),
      el("div", { class: "bars" },
        el("span", {}, "evidence"), el("span", { class: "track" }, el("i", { style: percent(c.evidence) })), el("span", {}, c.evidence_text),
        el("span", {}, "size"), el("span", { class: "track" }, el("i", { class: "size", style: percent(c.size) })), el("span", {}, c.size_text)),
      el("details", {}, el("summary", {}, c.rivals.length ? `rivals: ${c.rivals.join(", ")} · how to confirm` : "how to confirm"),
        el("p", {}, c.confirm), el("p", { class: "tag" }, c.physics)));
  }));
}
function ladder() {
  refill($("ladder"), ...state.ladder.map((r, i) => {
    const [what, ...gone] = (r.label === "start" ? r.model : r.label).split(/(?<=.) (?=−)/);
    return el("li", {},
      el("button", { "aria-current": i === state.at ? "step" : null, class: i > state.at ? "later" : "", "data-rung": i, "aria-label": `rung ${i}: ${r.label}`,
        title: `${r.model}\nχ²/dof ${r.chi2_text}, p ${r.p_text}\nlargest error ${r.max_text}; chance alone gives ${r.chance_text} rms`,
        onclick: () => act({ do: "go", rung: i }) },
        el("span", { class: "what" }, `${i}  ${what}`, r.adequate ? el("span", { class: "ok" }, "  ✓") : null),
        gone.length ? el("small", {}, gone.join(" ")) : null,
        el("span", { class: "error" }, r.error_text, el("small", {}, ` rms (chance ${r.chance_text})`)),
        el("small", {}, `χ²/dof ${r.chi2_text} · unseen data ${r.predictive_text}`)));
  }));
  const now = $("ladder").children[state.at];
  if (now) now.scrollIntoView({ block: "nearest", inline: "nearest" });
}
// What the log is compared with: other logs, a data sheet.
function beside() {
  const there = view === "compare" && Boolean(state.recording);
  $("beside").hidden = !there;
  $("sheet").hidden = !there || !state.sheet;
  if (!there) return;
  const logs = state.logs.map((name, i) => ({ name, i })).filter(({ name, i }) => i !== state.log_number && !state.others.some(o => o.startsWith(`${name} `)));
  const gone = (name, order) => el("span", { class: "beside" }, name, el("button", { class: "icon", "aria-label": `no longer compare with ${name}`, onclick: () => act({ do: "alone", ...order }) }, "×"));
  refill($("beside"), el("span", {}, "beside it:"), ...state.others.map(name => gone(name, { name })), state.sheet ? gone(state.sheet.name, {}) : null,
    ...logs.map(({ name, i }) => el("button", { onclick: () => act({ do: "compare", log: i }) }, `+ ${name}`)),
    el("button", { onclick: () => pick("compare") }, "+ a log …"), el("button", { onclick: () => pick("sheet") }, "+ a data sheet …"));
  if (state.sheet) $("sheet").replaceChildren(
    el("table", {}, el("caption", {}, `the model beside the data sheet ${state.sheet.name}`),
      el("tr", {}, ...["", "data sheet", "measured", "measured / sheet (95 %)", ""].map(t => el("th", {}, t))),
      ...state.sheet.rows.map(r => el("tr", {}, el("th", {}, r.figure), el("td", {}, r.sheet), el("td", {}, r.measured), el("td", {}, r.ratio), el("td", { class: "remark" }, r.remark)))),
    ...state.sheet.remarks.map(r => el("p", {}, r)));
}
function theme() { return document.documentElement.dataset.theme; }
async function figure() {
  const want = `${state.version} ${view} ${theme()}`;
  if (want === drawn) return;
  // The measured curve and the samples are there before the first fit.
  if (!state.recording || (!state.ladder.length && !["allan", "samples"].includes(view))) {
    Draw.clear(); drawn = ""; $("key").replaceChildren();
    $("empty").textContent = state.log ? (state.problem ? "" : "reading and fitting …") : "drop a log here: CSV, NPZ, NPY, MATLAB, ROS bag, ULog";
    return;
  }
  drawn = want;
  try {
    const got = await speak(`tabs/${tab}/view/${view}?theme=${theme()}`);
    if (want !== drawn) return;
    $("empty").textContent = "";
    key();
    await Draw.show(got);
    $("plot").setAttribute("aria-label", `${got.title}: ${got.subtitle}`);
    document.body.dataset.drawn = want;
  } catch (error) {
    if (want !== drawn) return;
    Draw.clear(); $("empty").textContent = error.message;
  }
}
function key() {
  const item = (style, text, kind = "", title = null) => el("span", { title }, el("i", { class: kind, style }), text);
  const allan = [item("", "measured, 95 %", "dot"), item("border-color:var(--c-model)", state.preview ? "tried" : "model"), item("background:var(--c-model)", "chance, 95 %", "box", "Where the measured curve lies if the model is true: dark at each place by itself, pale at all together")];
  if (!state.preview && !state.adequate && state.where.length) allan.push(item("background:var(--fail);opacity:.6", "fails here", "box"));
  const samples = [item("border-color:var(--c1)", "mean of a stretch"), item("background:var(--c1)", "its smallest to its largest", "box")];
  $("key").replaceChildren(...({ allan, psd: allan, samples }[view] || []));
}

// -- doing
function go(name) {
  view = name;
  for (const button of document.querySelectorAll("[role=tab]")) button.setAttribute("aria-selected", button.dataset.tab === name);
  beside(); figure();
}
function pick(role) {
  $("pick").onchange = () => { if ($("pick").files[0]) send($("pick").files[0], role); $("pick").value = ""; };
  $("pick").click();
}
function ask() {
  $("form-log").textContent = state.log || "";
  $("form-problem").textContent = state.problem || "";
  $("form-rate").value = state.reading.rate ? Number(state.reading.rate.toPrecision(8)) : "";
  const values = state.units.map(u => u.value), unit = state.reading.unit;
  const units = unit && !values.includes(unit) ? [{ value: unit, text: unit }, ...state.units] : state.units;
  $("form-unit").replaceChildren(el("option", { value: "" }, "as in the file, or none"), ...units.map(u => el("option", { value: u.value, selected: u.value === unit }, u.text)));
  $("form-columns").value = state.reading.columns;
  $("form-time").value = state.reading.time_column || "";
  $("form-quantity").value = state.reading.quantity || "rate";
  $("form").showModal();
}
async function send(file, role) {
  if (role === "study") {
    try { await act({ do: "study", study: JSON.parse(await file.text()) }); }
    catch { say(`${file.name} is not a study: JSON saved from this page is needed`); }
    return;
  }
  asked = false;
  say(`sending ${file.name} …`);
  try { take(await speak(`tabs/${tab}/upload?name=${encodeURIComponent(file.name)}&as=${role}`, { method: "POST", body: file })); say(""); if (role !== "log") go("compare"); }
  catch (error) { say(error.message); }
}
function listen() {
  for (const button of document.querySelectorAll("[role=tab]")) {
    button.onclick = () => go(button.dataset.tab);
    button.onkeydown = event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const all = [...document.querySelectorAll("[role=tab]")], next = all[(all.indexOf(button) + step + all.length) % all.length];
      next.focus(); go(next.dataset.tab);
    };
  }
  $("undo").onclick = () => act({ do: "undo" });
  $("redo").onclick = () => act({ do: "redo" });
  $("improve").onclick = () => act({ do: "improve" });
  $("cancel").onclick = () => act({ do: "cancel" });
  $("message").onclick = () => say("");
  $("logs").onchange = event => { asked = false; act({ do: "open", log: Number(event.target.value) }); };
  $("columns").onchange = event => act({ do: "column", column: Number(event.target.value) });
  $("reading").onclick = ask;
  $("form").onclose = () => {
    if ($("form").returnValue !== "yes") return;
    asked = false;
    act({ do: "read", rate: $("form-rate").value.trim(), unit: $("form-unit").value, quantity: $("form-quantity").value, columns: $("form-columns").value.trim(), time_column: $("form-time").value.trim() });
  };
  $("theme").onclick = () => paint(theme() === "dark" ? "light" : "dark");
  $("unit").onchange = event => act({ do: "unit", unit: state.chip_units[event.target.value].value });
  for (const button of document.querySelectorAll("[data-pick]")) button.onclick = () => pick(button.dataset.pick);
  document.addEventListener("click", event => {
    if (event.target.closest("[aria-disabled=true]")) { event.stopPropagation(); event.preventDefault(); }
  }, true);
  for (const link of document.querySelectorAll("#files a")) {
    link.tabIndex = 0; link.setAttribute("role", "button");
    const get = async () => {
      const name = link.dataset.file || `${view}.${link.dataset.view}`;
      try {
        const answer = await fetch(`tabs/${tab}/file/${name}?theme=${theme()}`);
        if (!answer.ok) throw new Error((await answer.json()).error);
        const anchor = el("a", { href: URL.createObjectURL(await answer.blob()), download: name });
        anchor.click();
        setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
      } catch (error) { say(error.message); }
    };
    link.onclick = get;
    link.onkeydown = event => { if (event.key === "Enter") get(); };
  }
  $("files").onclick = () => { $("files").parentElement.open = false; };
  document.addEventListener("click", event => { if (!event.target.closest(".menu")) $("files").parentElement.open = false; });
  document.addEventListener("keydown", event => {
    if (event.target.matches("input, select, dialog *")) return;
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") { act({ do: event.shiftKey ? "redo" : "undo" }); event.preventDefault(); }
    else if (event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === "t") $("theme").click();
    else if (event.key === "i") $("improve").click();
    else if (event.key === "Escape") { say(""); $("files").parentElement.open = false; }
  });
  let inside = 0;
  const files = event => [...(event.dataTransfer ? event.dataTransfer.types : [])].includes("Files");
  addEventListener("dragenter", event => { if (files(event)) { inside++; $("drop").hidden = false; } });
  addEventListener("dragleave", () => { if (--inside <= 0) { inside = 0; $("drop").hidden = true; } });
  addEventListener("dragover", event => event.preventDefault());
  addEventListener("drop", event => {
    event.preventDefault(); inside = 0; $("drop").hidden = true;
    const file = event.dataTransfer.files[0];
    if (file) send(file, { json: "study", toml: "sheet" }[file.name.split(".").pop()] || "log");
  });
  Draw.drag((place, factor) => {
    const chip = state.chips.find(c => c.place === place);
    const main = chip && (chip.values.find(v => v.free && !["s", "Hz"].includes(v.unit)) || chip.values.find(v => v.free));
    if (main) act({ do: "what-if", place, name: main.name, value: main.number * factor });
  });
}
function paint(name) {
  document.documentElement.dataset.theme = name;
  if (state) figure();
}
document.addEventListener("DOMContentLoaded", async () => {
  paint(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  new ResizeObserver(Draw.fit).observe($("figure"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", event => paint(event.matches ? "dark" : "light"));
  listen();
  try { tab = (await speak("tabs", { method: "POST" })).tab; take(await speak(`tabs/${tab}`)); }
  catch (error) { say(error.message); return; }
  addEventListener("pagehide", () => navigator.sendBeacon(`tabs/${tab}/close`));
  follow();
});
