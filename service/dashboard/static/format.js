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

/** Three digits of a number of at least one, or as many as it has before the point. */
const digits = (value) => (value >= 999.5 ? Math.round(value).toLocaleString("en") : value.toPrecision(3));

/** Some things with their number: "1 asset", "3 assets". */
export const counted = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;

export function bytes(count) {
  if (count < 1000) return `${count} bytes`;
  const units = ["kB", "MB", "GB", "TB"];
  let size = count / 1000;
  let unit = 0;
  while (size >= 999.5 && unit < units.length - 1) { size /= 1000; unit += 1; }
  return `${digits(size)} ${units[unit]}`;
}

// Minutes, hours and days begin with the second one: rounding half of one up or down would tell little.
const SPANS = [["d", 86400], ["h", 3600], ["min", 60]];

/** How long something took, rounded to the nearest. */
export function seconds(value) {
  if (value < 0.9995) return `${Math.round(value * 1000)} ms`;
  const [unit, length] = SPANS.find(([, span]) => value >= 2 * span) ?? ["s", 1];
  return unit === "s" ? `${digits(value)} s` : `${Math.round(value / length)} ${unit}`;
}

/** How long ago something was, in whole ones that have passed. */
export function age(time, now = Date.now()) {
  const passed = Math.max(0, (now - new Date(time).getTime()) / 1000);
  if (passed < 5) return "now";
  const [unit, length] = SPANS.find(([, span]) => passed >= span) ?? ["s", 1];
  return `${Math.floor(passed / length)} ${unit}`;
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
