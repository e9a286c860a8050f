"use strict";
// Unpacks what the page carries, draws it, follows the colours of the medium and keeps time axes together.
(async () => {
  // The page counts as loaded only once its plots are drawn: who prints at "load" prints them. A frame whose
  // document is being written holds that event back.
  const hold = document.createElement("iframe");
  hold.hidden = true;
  document.body.append(hold);
  hold.contentDocument.open();
  const loaded = () => { hold.contentDocument.close(); hold.remove(); };
  const unpacked = async (id) => {
    const packed = Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  };
  if (!("DecompressionStream" in window)) {
    document.getElementById("trouble").hidden = false; // browsers before 2023
    loaded();
    return;
  }
  const library = document.createElement("script");
  library.textContent = await unpacked("plotly");
  document.head.append(library);
  const plots = JSON.parse(await unpacked("plots"));

  // What all plots have in common.
  const axis = {
    gridcolor: "--grid", linecolor: "--rule", zerolinecolor: "--rule", tickcolor: "--rule", automargin: true,
    title: { standoff: 8, font: { size: 12 } }, tickfont: { size: 11 },
  };
  const template = { layout: {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest", dragmode: "zoom",
    font: { family: "system-ui, -apple-system, Segoe UI, Helvetica Neue, Arial, sans-serif", size: 12, color: "--soft" },
    margin: { l: 56, r: 12, t: 34, b: 44 }, xaxis: axis, yaxis: axis,
    legend: {
      orientation: "h", x: 0, y: 1, yanchor: "bottom", itemsizing: "constant", font: { size: 12 }, tracegroupgap: 0,
    },
    hoverlabel: { bgcolor: "--paper", bordercolor: "--rule", font: { color: "--ink" } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: "--muted", activecolor: "--ink" },
    polar: {
      bgcolor: "rgba(0,0,0,0)",
      radialaxis: { gridcolor: "--grid", linecolor: "--rule", tickfont: { size: 10 } },
      angularaxis: { gridcolor: "--grid", linecolor: "--rule", tickfont: { size: 11 } },
    },
  } };

  // A colour is the name of a custom property; nothing else in a figure begins with two dashes.
  const coloured = (value) => {
    const style = getComputedStyle(document.documentElement);
    const put = (v) => {
      if (typeof v === "string") return v.startsWith("--") ? style.getPropertyValue(v).trim() : v;
      if (Array.isArray(v)) return v.map(put);
      if (v && typeof v === "object")
        return "bdata" in v ? { ...v } : Object.fromEntries(Object.entries(v).map(([k, w]) => [k, put(w)]));
      return v;
    };
    return put(value);
  };
  const config = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const draw = (width) => Promise.all(plots.map(({ id, height, figure }) => {
    const { data, layout } = coloured(figure);
    const tall = document.getElementById(id).clientHeight || height; // a round one is as high as it is wide
    const shape = { ...layout, height: tall, width, autosize: !width, template: coloured(template), uirevision: 1 };
    return Plotly.react(id, data, shape, config);
  }));
  try {
    await draw();
  } finally {
    loaded();
  }

  // One craft's plots over time show the same stretch of it.
  let leading = false;
  for (const { id, family } of plots) {
    if (!family) continue;
    document.getElementById(id).on("plotly_relayout", async (change) => {
      const keys = Object.keys(change).filter((k) => k.startsWith("xaxis."));
      if (leading || !keys.length) return;
      leading = true;
      const same = Object.fromEntries(keys.map((k) => [k, change[k]]));
      for (const other of plots)
        if (other.family === family && other.id !== id) await Plotly.relayout(other.id, same);
      leading = false;
    });
  }

  // A table that is wider than its place says so, and can be scrolled by keys.
  const tell = (table) => {
    const cut = table.scrollWidth > table.clientWidth + 1;
    table.toggleAttribute("data-cut", cut);
    cut ? table.setAttribute("tabindex", "0") : table.removeAttribute("tabindex");
  };
  const watch = new ResizeObserver((seen) => requestAnimationFrame(() => seen.forEach((one) => tell(one.target))));
  document.querySelectorAll(".scroll").forEach((table) => watch.observe(table));

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => draw());
  const root = document.documentElement;
  const PAPER_PX = 664; // inside a card on A4 with the margins of page.css, at 96 pixels an inch
  addEventListener("beforeprint", () => { root.dataset.paper = ""; draw(PAPER_PX); }); // draws before it returns
  addEventListener("afterprint", () => { delete root.dataset.paper; draw(); });
  root.dataset.drawn = plots.length;
})();
