"use strict";
// The figure: drawing, lighting up a component, shading where an effect acts, dragging a component's line.
const Draw = (() => {
  const plot = () => document.getElementById("plot");
  let shown = null, base = [];
  const options = { responsive: true, displaylogo: false, displayModeBar: false, doubleClick: "reset" };

  async function show(view) {
    shown = view;
    const layout = structuredClone(view.layout);
    base = layout.shapes || [];
    await Plotly.react(plot(), view.data, layout, options);
  }

  function light(place) {
    if (!shown || !plot().data) return;
    const meta = place === null ? null : `effect-${place}`;
    const indices = [], widths = [], opacity = [];
    shown.data.forEach((trace, i) => {
      if (!String(trace.meta || "").startsWith("effect-")) return;
      const own = trace.meta === meta;
      indices.push(i);
      widths.push(own ? 3.6 : (trace.line && trace.line.width) || 1.2);
      opacity.push(meta === null || own ? 1 : 0.25);
    });
    if (indices.length) Plotly.restyle(plot(), { "line.width": widths, opacity }, indices);
  }

  function shade(acts, color) {
    if (!shown || !plot().layout) return;
    const range = acts && acts[{ allan: "tau", psd: "frequency", map: "time", samples: "time" }[shown.name]];
    let more = [];
    if (range) {
      const scale = /\((d|h|min)\)/.exec((shown.layout.xaxis.title || {}).text || "");
      const unit = shown.name === "map" || shown.name === "samples" ? { d: 86400, h: 3600, min: 60 }[scale && scale[1]] || 1 : 1;
      more = ["", "2"].filter(s => shown.layout["xaxis" + s]).map(s => ({
        type: "rect", xref: "x" + s, yref: `y${s} domain`, x0: range[0] / unit, x1: range[1] / unit, y0: 0, y1: 1,
        fillcolor: color, opacity: 0.16, line: { width: 1, color }, layer: "below", name: "acts" }));
    }
    Plotly.relayout(plot(), { shapes: [...base, ...more] });
  }

  // A line of the Allan curve or the spectrum is grabbed near the pointer and moved up or down.
  function drag(onDone) {
    let grip = null;
    const place = event => {
      const box = plot().getBoundingClientRect(), axes = plot()._fullLayout;
      return { x: event.clientX - box.left - axes.xaxis._offset, y: event.clientY - box.top - axes.yaxis._offset, axes };
    };
    const nearest = event => {
      if (!shown || !["allan", "psd"].includes(shown.name) || !plot()._fullLayout) return null;
      const { x, y, axes } = place(event);
      let best = null;
      shown.data.forEach((trace, i) => {
        if (!String(trace.meta || "").startsWith("effect-")) return;
        for (let k = 0; k < trace.x.length; k++) {
          if (trace.y[k] === null || trace.y[k] <= 0) continue;
          const far = Math.hypot(axes.xaxis.d2p(trace.x[k]) - x, axes.yaxis.d2p(trace.y[k]) - y);
          if (far < 9 && (!best || far < best.far)) best = { far, i };
        }
      });
      return best && best.i;
    };
    plot().addEventListener("pointermove", event => {
      if (!grip) { plot().classList.toggle("grip", nearest(event) !== null); return; }
      const decades = (grip.y - event.clientY) / plot()._fullLayout.yaxis._length * (plot()._fullLayout.yaxis.range[1] - plot()._fullLayout.yaxis.range[0]);
      grip.factor = 10 ** decades;
      Plotly.restyle(plot(), { y: [shown.data[grip.i].y.map(v => v === null ? null : v * grip.factor)] }, [grip.i]);
      event.preventDefault(); event.stopPropagation();
    }, true);
    plot().addEventListener("mousedown", event => {
      const i = nearest(event);
      if (i === null) return;
      grip = { i, y: event.clientY, factor: 1 };
      event.preventDefault(); event.stopPropagation();
    }, true);
    window.addEventListener("pointerup", () => {
      if (!grip) return;
      const { i, factor } = grip;
      grip = null;
      // The density goes with the square of a coefficient.
      if (Math.abs(factor - 1) > 1e-3) onDone(Number(shown.data[i].meta.slice(7)), shown.name === "psd" ? Math.sqrt(factor) : factor);
    });
  }

  return { show, light, shade, drag, clear: () => { shown = null; if (plot().data) Plotly.purge(plot()); } };
})();
