// h("td", { class: "number" }, "12") makes an element. Text is never read as HTML.
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(9).filter((child) => child !== null && child !== undefined));
  return element;
}

export function select(label, options, chosen, onchange) {
  const list = h("select", { onchange: () => onchange(list.value) },
    options.map(([value, text]) => h("option", { value, selected: String(value) === String(chosen) }, text)));
  return h("label", {}, label, list);
}

// A section with a heading that the navigation can name. `about` says what to look for.
export function section(id, title, about, ...children) {
  return h("section", { id }, h("h2", {}, title), about ? h("p", { class: "about" }, about) : null, ...children);
}

export function copyButton(text) {
  const button = h("button", { class: "action", type: "button", title: "copy the command", onclick: async () => {
    await navigator.clipboard.writeText(text);
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  } }, "copy");
  return button;
}
