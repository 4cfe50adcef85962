"use strict";
// Draws the figures that the page carries as data, in the reader's light or dark colours.
const data = JSON.parse(document.getElementById("data").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");

function themed(layout) {
  const colours = { "font.color": dark.matches ? "#e4e7ee" : "#1d2330" };
  if (layout.scene) {
    for (const axis of ["xaxis", "yaxis", "zaxis"]) {
      colours["scene." + axis + ".color"] = dark.matches ? "#aab2c0" : "#5a6272";
      colours["scene." + axis + ".gridcolor"] = dark.matches ? "#363c48" : "#d5d9e2";
    }
  }
  return colours;
}

async function draw() {
  const config = { responsive: true, displaylogo: false, displayModeBar: false };
  for (const [id, figure] of Object.entries(data.figures)) {
    await Plotly.newPlot(id, figure.data, figure.layout, config);
    await Plotly.relayout(id, themed(figure.layout));
  }
}

const drawn = draw();
dark.addEventListener("change", () => {
  for (const [id, figure] of Object.entries(data.figures)) Plotly.relayout(id, themed(figure.layout));
});
