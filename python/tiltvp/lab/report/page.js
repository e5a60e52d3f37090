"use strict";

// Draws the figures that can be touched.
const figures = JSON.parse(document.getElementById("figures").textContent);
for (const place of document.querySelectorAll("[data-figure]")) {
  const figure = figures[place.dataset.figure];
  const layout = { ...figure.layout, font: { size: 14 }, autosize: true };
  Plotly.newPlot(place, figure.data, layout, { displaylogo: false, responsive: true });
}

// Numbers sort as numbers, words as words, empty cells last.
const numberOf = (text) => {
  const start = text.replace("−", "-").match(/^-?\d+(\.\d+)?/);
  return start ? parseFloat(start[0]) : NaN;
};
const textOf = (row, column) => row.cells[column].textContent.trim();

for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const filled = [...body.rows].map((row) => textOf(row, column)).filter((text) => text !== "");
    const words = filled.some((text) => Number.isNaN(numberOf(text)));
    if (words) {
      for (const row of [table.tHead.rows[0], ...body.rows]) row.cells[column].classList.add("words-cell");
    }
    head.querySelector("button").addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const compare = (first, second) => {
        const [a, b] = [textOf(first, column), textOf(second, column)];
        if (a === "" || b === "") return (a === "") - (b === "");
        const order = words ? a.localeCompare(b) : numberOf(a) - numberOf(b);
        return down ? -order : order;
      };
      body.append(...[...body.rows].sort(compare));
    });
  });
}
