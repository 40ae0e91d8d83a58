// Numbers and states as words. Figures keep a fixed number of digits so that columns do not jump.

const DASH = "–";

export function fixed(value: number | undefined, digits: number, unit = ""): string {
  if (value === undefined || !Number.isFinite(value)) return DASH;
  const text = value.toFixed(digits);
  const plain = Number(text) === 0 ? (0).toFixed(digits) : text;
  return plain.replace("-", "−") + (unit ? `\u00a0${unit}` : "");
}

/** `+1.2 ± 0.3 ms`; `−3600.012 s ± 0.3 ms` once the offset passes a second. */
export function offset(ms: number | undefined, error: number | undefined): string {
  if (ms === undefined) return DASH;
  const large = Math.abs(ms) >= 1000;
  const value = (ms > 0 ? "+" : "") + (large ? fixed(ms / 1000, 3, "s") : fixed(ms, 1));
  if (error === undefined) return large ? value : `${value}\u00a0ms`;
  return `${value} ±\u00a0${fixed(error, 1, "ms")}`;
}

/** `0:07.3` for running figures, `1:02:03` past an hour. */
export function duration(seconds: number, tenths = false): string {
  if (!Number.isFinite(seconds) || seconds < 0) return DASH;
  const whole = tenths ? Math.floor(seconds * 10) / 10 : Math.floor(seconds);
  const h = Math.floor(whole / 3600);
  const m = Math.floor((whole % 3600) / 60);
  const s = whole % 60;
  const sText = tenths ? s.toFixed(1).padStart(4, "0") : String(s).padStart(2, "0");
  return h > 0 ? `${h}:${String(m).padStart(2, "0")}:${sText}` : `${m}:${sText}`;
}

export function bytes(count: bigint | number): string {
  let value = Number(count);
  const units = ["B", "kB", "MB", "GB", "TB"];
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) {
    value /= 1000;
    unit += 1;
  }
  return `${value.toFixed(unit === 0 || value >= 100 ? 0 : 1)}\u00a0${units[unit]}`;
}

export function count(value: bigint | number): string {
  return Number(value).toLocaleString("en-GB").replaceAll(",", "\u202f");
}

export function plural(n: number, one: string, many = `${one}s`): string {
  return `${n} ${n === 1 ? one : many}`;
}

/** How long ago, in the coarsest unit that says something. */
export function ago(thenMs: number, nowMs: number): string {
  const seconds = Math.round((nowMs - thenMs) / 1000);
  if (!Number.isFinite(seconds)) return "at an unknown time";
  if (seconds < 10) return "just now";
  if (seconds < 90) return `${seconds} s ago`;
  if (seconds < 90 * 60) return `${Math.round(seconds / 60)} min ago`;
  if (seconds < 36 * 3600) return `${Math.round(seconds / 3600)} h ago`;
  return plural(Math.round(seconds / 86400), "day") + " ago";
}

/** Local date and time to the minute, for takes. */
export function dateTime(rfc3339: string): string {
  const date = new Date(rfc3339);
  if (Number.isNaN(date.getTime())) return rfc3339 || DASH;
  const two = (n: number) => String(n).padStart(2, "0");
  const day = `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`;
  return `${day} ${two(date.getHours())}:${two(date.getMinutes())}`;
}

/** The name offered for the next take: a trailing number counts up, keeping its width. */
export function nextTakeName(name: string): string {
  const match = /^(.*?)(\d+)$/.exec(name);
  if (!match) return name;
  const digits = match[2]!;
  return match[1]! + (BigInt(digits) + 1n).toString().padStart(digits.length, "0");
}

/** The lines that start two simulated sensors against this server: a calibration needs as many. */
export function agentLines(origin: string): string {
  return [1, 2].map((n) => `posefuse agent sim --sensor ${n} --server ${origin} &`).join("\n");
}

/** The line that writes a take's files for a program; names of folders may have spaces. */
export function exportLine(take: string, preset: string, folder: string): string {
  const takes = /^[\w./~:\\-]*$/.test(folder) ? folder : `"${folder}"`;
  return `posefuse export ${take} --preset ${preset}${takes && ` --takes ${takes}`}`;
}

/** Where a calibration comes from, in plain words. */
export function madeFrom(method: string, floor: string): string {
  const walk = method === "svd" || method === "floor";
  const source = walk ? "from a walk" : method === "truth" ? "as simulated" : method ? `method ${method}` : "from an unnamed source";
  const floors: Record<string, string> = { walk: "floor found from the walk", manual: "floor set by hand", assumed: "floor assumed" };
  return floor ? `${source}, ${floors[floor] ?? `floor ${floor}`}` : source;
}
