// Shared by all parts of the page: state, DOM elements, and requests to the server.
export const S = { tab: null, state: null, view: "allan", seen: -1, answered: 0, options: {}, hooks: {} };
export const $ = id => document.getElementById(id);
// New DOM element. Attributes that begin with "on" are event listeners.
export const el = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value === true) node.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(key, value);
  }
  node.append(...children.filter(c => c !== null && c !== undefined).map(c => typeof c === "string" ? unbroken(c) : c));
  return node;
};
// Begin of a unit, as in report/html.py.
const UNITS = String.raw`[°µ%σ√]|\(°|(?:s|ms|ns|min|h|d|Hz|kHz|MHz|rad|mrad|g|mg|m|K|ppm|nats|dB|MB|GB)\b`;
const GAP = new RegExp(`([0-9⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=${UNITS})`, "g");
// The text with a no-break space between each number and its unit.
export const unbroken = text => text.replace(GAP, "$1\u00a0");
const SVG = "http://www.w3.org/2000/svg";
// New SVG element with one path per entry of `paths`.
export function svg(box, paths, attributes = {}) {
  const node = document.createElementNS(SVG, "svg");
  for (const [key, value] of Object.entries({ viewBox: box, "aria-hidden": "true", ...attributes })) node.setAttribute(key, value);
  for (const path of paths) {
    const line = document.createElementNS(SVG, "path");
    for (const [key, value] of Object.entries(path)) line.setAttribute(key, value);
    node.append(line);
  }
  return node;
}
// Icons of 16 × 16 pixels, drawn in the color of the text.
const ICONS = {
  undo: "M6 3 2.5 6.5 6 10M3 6.5h6.5a4 4 0 0 1 0 8H6", redo: "M10 3l3.5 3.5L10 10M13 6.5H6.5a4 4 0 0 0 0 8H10",
  theme: "M8 2v12M8 2a6 6 0 1 0 0 12M8 2a6 6 0 0 1 0 12M10 5v6M12 6.5v3", full: "M2.5 6V2.5H6M10 2.5h3.5V6M13.5 10v3.5H10M6 13.5H2.5V10",
  locked: "M4.5 7.5V5a3.5 3.5 0 0 1 7 0v2.5M3 7.5h10v6H3zM8 10v1.5", open: "M4.5 7.5V5a3.5 3.5 0 0 1 6.7-1.4M3 7.5h10v6H3z",
  close: "M4 4l8 8M12 4l-8 8", beside: "M2.5 3h4v10h-4zM9.5 3h4v10h-4z", numbers: "M2.5 3h11v10h-11zM2.5 6.5h11M2.5 9.75h11M7 3v10", back: "M8 13V4M4.5 7.5 8 4l3.5 3.5",
};
export const icon = name => svg("0 0 16 16", [{ d: ICONS[name], fill: name === "locked" ? "currentColor" : "none", "fill-opacity": 0.25, stroke: "currentColor", "stroke-width": 1.5, "stroke-linecap": "round", "stroke-linejoin": "round" }], { width: 16, height: 16 });
// Replaces the content. The focus moves to the new element with the same name, or else to the container.
export function replaceContent(node, ...children) {
  const name = x => x.getAttribute("aria-label") || x.textContent;
  const now = document.activeElement, inside = now !== node && node.contains(now), called = inside ? name(now) : null;
  node.replaceChildren(...children.filter(c => c !== null && c !== undefined));
  if (inside) ([...node.querySelectorAll("button, summary, article, select")].find(x => name(x) === called) || node).focus();
}
// Sets the options of a select element to [value, text] pairs, unless they are unchanged.
export function fillSelect(select, items, chosen) {
  const now = JSON.stringify([items, chosen]);
  if (select.dataset.now === now) return;
  select.dataset.now = now;
  select.replaceChildren(...items.map(([value, text]) => el("option", { value, selected: String(value) === String(chosen) }, text)));
}
// JSON document that the server returns for a path; throws its error message.
export async function request(path, options = {}) {
  const answer = await fetch(path, options);
  const text = await answer.text();
  let body;
  try { body = JSON.parse(text); } catch { body = { error: text.trim() }; }
  if (!answer.ok) throw new Error(body.error || `The server answered ${answer.status}`);
  return body;
}
// Sends an action to the server and shows the new state. True if the action was accepted.
export async function act(order) {
  try {
    const next = await request(`tabs/${S.tab}/act`, { method: "POST", body: JSON.stringify(order), headers: { "content-type": "application/json" } });
    S.answered += 1;
    S.hooks.applyState(next);
    return true;
  } catch (error) { showMessage(error.message); return false; }
}
// Shows a message for some seconds; an empty text hides it.
export function showMessage(text, seconds = 10) {
  $("message").textContent = unbroken(text);
  $("message").hidden = !text;
  clearTimeout(showMessage.timer);
  if (text) showMessage.timer = setTimeout(() => { $("message").hidden = true; }, 1000 * seconds);
}
export const busy = () => Boolean(S.state && S.state.job && S.state.job.busy);
// True while a job runs that the user requested; a check that gives way does not count.
export const hasUserJob = () => busy() && !S.state.job.gives_way;
export const numberText = x => x === null || x === undefined ? "–" : Math.abs(x) >= 1e4 || (x !== 0 && Math.abs(x) < 1e-3) ? powerText(x) : String(Number(x.toPrecision(3)));
function powerText(x) {
  const [m, e] = x.toExponential(2).split("e");
  return `${Number(m)}·10${[...String(Number(e))].map(c => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("")}`;
}
export const theme = () => document.documentElement.dataset.theme;
// The text with a capital letter, except for symbols such as τ or σ.
export const capitalized = text => /^[a-z]/.test(text) ? text[0].toUpperCase() + text.slice(1) : text;
