// The verdict, the missing effects, and the steps of the model building.
import { $, S, act, busy, capitalized, el, fillSelect, icon, replaceContent, numberText } from "./core.js";
import { shadeRange } from "./draw.js";

// Tolerances at which "improve" stops, in % of model discrepancy.
const TOLERANCES = [["", "Adequate"], ...[1, 2, 5, 10].map(p => [p, `Within ${p} %`])];
export function updateTolerance() {
  fillSelect($("enough"), TOLERANCES, S.state.tolerance ?? "");
  $("enough").onchange = event => act({ do: "tolerance", percent: event.target.value });
  // If all axes are adequate, no tolerance is needed.
  $("until").hidden = !S.state.ladder.length || S.state.axes.every(a => a.state === "adequate");
}
// Shows the verdict on the model, where it fails, and what the user can do.
export function updateVerdict() {
  const state = S.state, out = [];
  const line = (kind, bold, text, more = {}) => el("p", { class: kind, ...more }, bold ? el("b", {}, bold + " ") : null, text);
  const offer = (text, doing) => el("button", { onclick: doing }, text);
  if (state.problem && state.moving) out.push(line("bad", "Not fitted:", state.problem), offer("Use the quiet segment", () => act({ do: "motion", how: "quiet" })), offer("Analyze anyway", () => act({ do: "motion", how: "anyway" })));
  else if (state.problem) out.push(line("bad", "Not read:", state.problem), offer("Set rate and units …", () => S.hooks.openReadingForm()));
  else if (busy() && !state.checked) out.push();
  else if (!state.ladder.length && state.log) out.push(line("", "Canceled:", "nothing is fitted"), offer("Read it again", () => act({ do: "open", log: state.log_number })));
  else if (!state.ladder.length) out.push(line("", "", "Open a log first"), offer("Open a log …", () => S.hooks.chooseFile("log")));
  else if (!state.checked) out.push(line("", "Canceled:", "the search for missing effects is incomplete"), offer("Search", () => act({ do: "check" })));
  else if (state.adequate) out.push(line("good", state.verdict === "adequate" ? "✓ Adequate:" : "≈ Limited by quantization:", `${unexplainedText()} unexplained`));
  else {
    if (state.within) out.push(line("good", "≈ Within tolerance:", `model discrepancy ${numberText(state.discrepancy)} %, below ${state.tolerance} %`));
    else out.push(line("bad", "✗ Fails:", `unexplained misfit ${unexplainedText()}`));
    out.push(el("ul", {}, ...state.where.map(failureItem)));
  }
  replaceContent($("verdict"), ...out);
}
const unexplainedText = () => S.state.ladder[S.state.at].left_text;
// A sentence about a place links to the view of that place.
function failureItem(f) {
  const text = capitalized(f.text);
  return el("li", {}, f.view ? el("button", { class: "link", title: "Show this place", onclick: () => S.hooks.showRange(f.view, f.place) }, text) : text);
}
// Shows a card for each suggested effect, or for the alternatives of an adequate model.
export function updateCards() {
  const { alternatives } = S.state;
  const beside = alternatives ? [el("article", { class: "card", "aria-label": "Alternative explanations" }, el("h3", {}, "Alternative explanations"), el("p", {}, alternatives))] : [];
  replaceContent($("cards"), ...beside, ...(S.state.adequate ? [] : S.state.cards).map((c, i) => {
    const percent = x => `width:${Math.max(1, Math.round(100 * x))}%`;
    const mark = on => () => shadeRange(on ? c.acts : null);
    return el("article", { class: i === 0 && c.significant ? "card first" : "card", "data-kind": c.kind, "aria-label": c.name, tabindex: 0,
      onmouseenter: mark(true), onmouseleave: mark(false), onfocusin: mark(true), onfocusout: mark(false) },
      el("header", {}, el("h3", {}, capitalized(c.name)), c.significant ? null : el("span", { class: "tag" }, "not significant"),
        el("button", { class: i === 0 ? "main add" : "add", "data-work": true, "aria-label": `Add ${c.name}`, onclick: () => act({ do: "add", number: c.number }) }, "Add")),
      c.values ? el("p", { class: "own" }, c.values) : null,
      el("p", { class: "why" }, capitalized(c.sentence)),
      el("div", { class: "measure" }, el("span", { class: "track" }, el("i", { style: percent(c.size) })), el("button", { class: "link", title: "Show this place", onclick: () => S.hooks.showRange(c.view, c.place) }, capitalized(c.size_text))),
      el("details", {}, el("summary", {}, c.rivals.length ? `Alternative explanations: ${c.rivals.join(", ")} · how to confirm` : "How to confirm"),
        el("p", {}, capitalized(c.confirm), "."), el("p", { class: "tag" }, `Evidence: ${c.evidence_text}`), el("p", { class: "tag" }, capitalized(c.physics), ".")));
  }));
}
// Shows the steps of the current axis, each with its misfit and errors.
export function updateSteps() {
  const state = S.state;
  replaceContent($("ladder"), ...state.ladder.map((r, i) => {
    const [what, ...gone] = (r.label === "start" ? r.model : r.label).split(/(?<=.) (?=−)/);
    return el("li", {},
      el("button", { "aria-current": i === state.at ? "step" : null, class: i > state.at ? "later" : "", "data-rung": i, "aria-label": `Step ${i}: ${r.label}`,
        title: `${r.model}\nχ²/dof ${r.chi2_text}, p ${r.p_text}; model discrepancy ${r.discrepancy_text}\nLargest error ${r.max_text}; predictive score (unseen data) ${r.predictive_text}`,
        onclick: () => act({ do: "go", rung: i }) },
        el("span", { class: "what" }, `${i}  ${what}`),
        gone.length ? el("small", {}, gone.join(" ")) : null,
        el("span", { class: "error" }, r.left_text, el("small", {}, " unexplained"), r.adequate ? el("span", { class: "ok" }, " ✓") : null),
        el("small", {}, `Allan error ${r.error_text} rms (expected scatter ${r.chance_text})`)),
      i === state.at ? null : el("button", { class: "icon beside-step", "data-beside": i, "aria-label": `Compare step ${state.at} with step ${i}`, title: `Compare step ${state.at} with step ${i}`,
        onclick: async () => { if (await act({ do: "beside", rung: i })) S.hooks.openView("compare"); } }, icon("beside")));
  }));
  const list = $("ladder"), now = list.children[state.at];
  if (now) list.scrollTo({ left: Math.max(0, now.offsetLeft - list.offsetLeft - 40) });
}
