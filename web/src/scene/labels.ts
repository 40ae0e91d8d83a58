// Names in the 3D view, as elements over the canvas: crisp, themed and readable by assistive technology.

import { Vector3, type Camera } from "three";

export interface Label {
  key: string;
  text: string;
  /** CSS class beside `label`. */
  kind: string;
  at: Vector3;
  /** Makes the label a button. */
  press?: () => void;
}

export class Labels {
  private elements = new Map<string, { element: HTMLElement; label: Label }>();
  private projected = new Vector3();

  constructor(private host: HTMLElement) {}

  set(labels: Label[]): void {
    const keys = new Set(labels.map((l) => l.key));
    for (const [key, { element }] of this.elements) {
      if (keys.has(key)) continue;
      element.remove();
      this.elements.delete(key);
    }
    for (const label of labels) {
      const existing = this.elements.get(label.key);
      const element = existing?.element ?? this.create(label);
      if (element.textContent !== label.text) element.textContent = label.text;
      const className = `label ${label.kind}`;
      if (element.className !== className) element.className = className;
      this.elements.set(label.key, { element, label });
    }
  }

  private create(label: Label): HTMLElement {
    const element = document.createElement(label.press ? "button" : "span");
    if (element instanceof HTMLButtonElement) {
      element.type = "button";
      // The same choice is in the row of people above the view, which the keyboard reaches.
      element.tabIndex = -1;
      element.addEventListener("click", () => this.elements.get(label.key)?.label.press?.());
    }
    this.host.append(element);
    return element;
  }

  place(camera: Camera, width: number, height: number): void {
    for (const { element, label } of this.elements.values()) {
      const p = this.projected.copy(label.at).project(camera);
      const seen = p.z < 1 && Math.abs(p.x) < 1.05 && Math.abs(p.y) < 1.05;
      element.hidden = !seen;
      if (!seen) continue;
      const x = ((p.x + 1) / 2) * width;
      const y = ((1 - p.y) / 2) * height;
      element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
