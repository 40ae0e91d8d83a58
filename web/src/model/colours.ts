// Which colour a sensor has: by its name, so that it is the same in every browser, however the sensors joined.

/** How many colours sensors share. */
export const SENSOR_COLOURS = 7;

/** The colour that a name has when nobody else is there: numbered names (cam1, cam2 …) get different ones. */
export function usualColour(name: string): number {
  let sum = 0;
  for (const letter of name) sum += letter.codePointAt(0)!;
  return sum % SENSOR_COLOURS;
}

/** Colours 0 to 6 by name; two sensors share one only when there are more than seven. The order does not matter. */
export function assignColours(names: readonly string[]): Map<string, number> {
  const colours = new Map<string, number>();
  const taken = new Set<number>();
  for (const name of [...new Set(names)].sort()) {
    let colour = usualColour(name);
    for (let i = 0; i < SENSOR_COLOURS && taken.has(colour); i++) colour = (colour + 1) % SENSOR_COLOURS;
    taken.add(colour);
    colours.set(name, colour);
  }
  return colours;
}
