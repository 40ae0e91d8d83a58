// Colours of the 3D view and the plots. They live in the style sheet (styles/theme.css), so that the theme is one
// thing; here they are only read. All are from the Okabe-Ito palette, darkened or lightened for contrast.

import { Color } from "three";
import { SENSOR_COLOURS } from "../model/colours";
import type { Source } from "../model/frame";

export interface Palette {
  background: Color;
  grid: Color;
  gridStrong: Color;
  text: Color;
  dead: Color;
  axes: [Color, Color, Color];
  sources: Record<Source, Color>;
  sensors: Color[];
  /** Places that none, one, two, three or more sensors see. */
  coverage: Color[];
  /** Where the next sensor would stand. */
  next: Color;
  warn: Color;
  bad: Color;
}

export function cssColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "#888";
}

export function readPalette(): Palette {
  const colour = (name: string) => new Color(cssColour(name));
  return {
    background: colour("--view"),
    grid: colour("--view-grid"),
    gridStrong: colour("--view-grid-strong"),
    text: colour("--text"),
    dead: colour("--muted"),
    axes: [colour("--axis-x"), colour("--axis-y"), colour("--axis-z")],
    sources: { measured: colour("--measured"), inferred: colour("--inferred"), repaired: colour("--repaired") },
    sensors: Array.from({ length: SENSOR_COLOURS }, (_, i) => colour(`--sensor-${i}`)),
    coverage: [0, 1, 2, 3].map((sensors) => colour(`--cover-${sensors}`)),
    next: colour("--accent"),
    warn: colour("--warn"),
    bad: colour("--bad"),
  };
}

/** The style sheet's name for a sensor's colour, 0 to 6. */
export function sensorColourName(colour: number): string {
  return `--sensor-${colour}`;
}
