import { h } from "./dom.js";
import { saveCsv } from "./download.js";

// columns: [{ title, number, hint, value(row) -> what sorts and goes to CSV, show(row) -> what is seen, className(row) }]
// Sortable by its headings, filterable by words, with its data as CSV.
export function table(name, columns, rows, options = {}) {
  const body = h("tbody");
  const count = h("span", { class: "note", "aria-live": "polite" });
  let order = { column: null, down: false };
  let words = [];

  const text = (column, row) => {
    const value = column.value(row);
    return value === null || value === undefined ? "" : String(value);
  };
  const line = (row) => h("tr", {}, columns.map((column) => h("td", {
    class: [column.number ? "number" : "", column.wrap ? "text" : "", column.className?.(row) ?? ""].join(" ").trim(),
  }, column.show ? column.show(row) : text(column, row))));

  function compare(a, b) {
    const x = order.column.value(a);
    const y = order.column.value(b);
    const missing = (v) => v === null || v === undefined || v === "";
    if (missing(x) || missing(y)) return missing(x) - missing(y);
    const sign = typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y));
    return order.down ? -sign : sign;
  }

  function refresh() {
    let shown = rows.filter((row) => {
      const all = columns.map((column) => `${text(column, row)} ${column.search?.(row) ?? ""}`).join(" ").toLowerCase();
      return words.every((word) => all.includes(word)) && (options.keep?.(row) ?? true);
    });
    if (order.column) shown = shown.slice().sort(compare);
    body.replaceChildren(...shown.map(line));
    count.textContent = `${shown.length} of ${rows.length} rows`;
  }

  const headings = columns.map((column) => h("th", {
    class: column.number ? "number" : undefined, scope: "col", title: column.hint,
  }, h("button", { type: "button", onclick: (event) => {
    order = { column, down: order.column === column ? !order.down : false };
    for (const heading of headings) heading.removeAttribute("aria-sort");
    event.currentTarget.parentElement.setAttribute("aria-sort", order.down ? "descending" : "ascending");
    refresh();
  } }, column.title)));

  const element = h("div", { class: "data-table", "data-name": name },
    h("div", { class: "controls" },
      h("label", {}, "filter", h("input", { type: "search", placeholder: "words", oninput: (event) => {
        words = event.currentTarget.value.toLowerCase().split(/\s+/).filter(Boolean);
        refresh();
      } })),
      options.controls, count,
      h("button", { class: "action csv", type: "button", onclick: () => saveCsv(name, [
        columns.map((column) => column.title), ...rows.map((row) => columns.map((column) => column.value(row))),
      ]) }, "CSV")),
    h("div", { class: "table", tabindex: "0" }, h("table", {}, h("thead", {}, h("tr", {}, headings)), body)));
  refresh();
  return { element, refresh };
}
