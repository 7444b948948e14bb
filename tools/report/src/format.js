// Numbers and names for people.

// Four significant digits of `reference`, which sets the decimals of a whole row.
export function figure(value, reference = value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "";
  const magnitude = reference ? Math.floor(Math.log10(Math.abs(reference))) : 0;
  if (magnitude < -3 || magnitude > 6) return value.toExponential(2);
  const text = value.toFixed(Math.min(6, Math.max(0, 3 - magnitude)));
  return Number(text) === 0 ? text.replace("-", "") : text;
}

export const short = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "");

export function interval(pair, scale, reference) {
  return pair ? `[${figure(pair[0] * scale, reference)}, ${figure(pair[1] * scale, reference)}]` : "";
}

// "td error [us]" -> { name: "td error", unit: "\u00b5s" }
export function splitLabel(label) {
  const match = /^(.*?)(?: \[(.*)\])?$/.exec(label);
  const unit = (match[2] ?? "").replace("us", "\u00b5s").replace("s2", "s\u00b2").replace("deg", "\u00b0");
  return { name: match[1], unit };
}

export function valueText(value) {
  return typeof value === "string" ? value : JSON.stringify(value);
}

// The last word of a key is what people call it.
export const shortKey = (key) => key.split(".").slice(-1)[0];

export function cellLabel(cell, index) {
  const axes = Object.entries(cell.axes);
  if (axes.length === 0) return "all trials";
  const text = axes.map(([key, value]) => `${shortKey(key)} = ${valueText(value)}`).join(", ");
  return text.length > 70 ? `cell ${index}: ${text.slice(0, 60)}\u2026` : text;
}

export function seconds(value) {
  if (value < 120) return `${figure(value)} s`;
  return value < 7200 ? `${(value / 60).toFixed(1)} min` : `${(value / 3600).toFixed(1)} h`;
}
