/** Numbers as an engineer writes them, with their unit. */

const grouped = new Intl.NumberFormat("en-US", { maximumFractionDigits: 0 });

/** A number to so many significant digits, thousands grouped; "–" for none. */
export function number(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  if (size >= 10 ** (digits - 1) && size < 1e9) return grouped.format(value).replace("-", "−");
  if (size !== 0 && (size < 1e-3 || size >= 1e9)) {
    const [mantissa, power] = value.toExponential(Math.min(digits - 1, 2)).split("e");
    return `${mantissa}·10${superscript(Number(power))}`.replace("-", "−");
  }
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

const superscript = (power) => String(power).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));

export const percent = (share, digits = 3) =>
  share === null || share === undefined || Number.isNaN(share) ? "–" : `${number(100 * share, digits)} %`;

export const stiffness = (ke) => (ke === null || ke === undefined ? "–" : `${number(ke)} N/m`);

/** Rotor speed in the unit the reader chose. */
export class SpeedUnit {
  /** @param {"rpm"|"hz"|"ratio"} name  @param {number} firstHz first frequency at rest, for the ratio */
  constructor(name, firstHz) {
    this.name = name;
    this.factor = name === "rpm" ? 60 : name === "ratio" ? 1 / firstHz : 1;
    this.symbol = name === "rpm" ? "rpm" : name === "ratio" ? "Ω/f₁" : "Hz";
    this.title = name === "ratio" ? "Rotor speed Ω / f₁" : `Rotor speed [${this.symbol}]`;
  }

  of(hz) {
    return hz * this.factor;
  }

  toHz(value) {
    return value / this.factor;
  }

  write(hz) {
    if (hz === null || hz === undefined) return "–";
    return this.name === "ratio" ? `Ω/f₁ = ${number(this.of(hz), 4)}` : `${number(this.of(hz), 4)} ${this.symbol}`;
  }
}
