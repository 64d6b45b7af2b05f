// Numbers, times and sizes as people read them.

export function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value)) return value.toLocaleString("en");
  if (Math.abs(value) < 1e-12) return "0";
  const text = value.toPrecision(digits);
  const [mantissa, exponent] = Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6 ? value.toExponential(digits - 1).split("e") : [text, null];
  return exponent === null ? String(Number(text)) : `${mantissa}e${Number(exponent)}`;
}

export function bytes(count) {
  const units = ["bytes", "kB", "MB", "GB"];
  let size = count;
  let unit = 0;
  while (size >= 1000 && unit < units.length - 1) { size /= 1000; unit += 1; }
  return unit === 0 ? `${count} bytes` : `${size.toPrecision(3)} ${units[unit]}`;
}

export function seconds(value) {
  if (value < 1) return `${Math.round(value * 1000)} ms`;
  if (value < 90) return `${value.toPrecision(3)} s`;
  if (value < 5400) return `${Math.round(value / 60)} min`;
  if (value < 129600) return `${Math.round(value / 3600)} h`;
  return `${Math.round(value / 86400)} d`;
}

export function age(time, now = Date.now()) {
  const passed = Math.max(0, (now - new Date(time).getTime()) / 1000);
  return passed < 5 ? "now" : passed < 60 ? `${Math.floor(passed)} s` : seconds(Math.max(passed, 90));
}

export const dateTime = (time) => new Date(time).toLocaleString();

export function words(text) {
  return text.replaceAll("_", " ");
}

/** How a value compares with what it was: "48 times closer". */
export function times(before, after) {
  const ratio = before / after;
  return ratio >= 10 ? Math.round(ratio).toString() : ratio.toPrecision(2);
}
