// What this browser remembers: the theme, whether single keys are shortcuts, and planned sensors; and until it is closed,
// which figures of the joints are shown.

import { effect, signal } from "@preact/signals";

import type { Quantity } from "../model/contribution";

export type Theme = "system" | "light" | "dark";

/** What this browser keeps under a name. */
export function kept(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

/** Keeps something, if the browser does. */
export function keep(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // A browser that keeps nothing still works; it only forgets.
  }
}

const THEME = "posefuse.theme";
const KEYS = "posefuse.keys";

const stored = kept(THEME);
export const theme = signal<Theme>(stored === "light" || stored === "dark" ? stored : "system");
export const singleKeys = signal(kept(KEYS) !== "off");

export const quantity = signal<Quantity>("weight");

const prefersDark = matchMedia("(prefers-color-scheme: dark)");
const systemDark = signal(prefersDark.matches);
prefersDark.addEventListener("change", () => (systemDark.value = prefersDark.matches));

/** The theme in force, "light" or "dark". */
export const resolvedTheme = signal<"light" | "dark">("dark");

export function startPrefs(): void {
  effect(() => {
    const resolved = theme.value === "system" ? (systemDark.value ? "dark" : "light") : theme.value;
    document.documentElement.dataset["theme"] = resolved;
    resolvedTheme.value = resolved;
    keep(THEME, theme.value);
  });
  effect(() => keep(KEYS, singleKeys.value ? "on" : "off"));
}

export function toggleTheme(): void {
  theme.value = resolvedTheme.value === "dark" ? "light" : "dark";
}

const still = matchMedia("(prefers-reduced-motion: reduce)");

export function reducedMotion(): boolean {
  return still.matches;
}
