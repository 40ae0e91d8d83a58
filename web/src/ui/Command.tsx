// A command for the terminal, and a button that copies it.

import { useState } from "preact/hooks";
import { notify } from "../state/store";

export function Command({ lines, name }: { lines: string; name: string }) {
  const [copied, setCopied] = useState(false);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(lines);
      setCopied(true);
      setTimeout(() => setCopied(false), 2000);
    } catch {
      notify("error", "The browser did not let the page copy. Mark the lines and copy them by hand.");
    }
  };
  return (
    <div class="command">
      <code data-testid={name}>{lines}</code>
      <button type="button" onClick={() => void copy()}>
        {copied ? "Copied" : "Copy"}
      </button>
    </div>
  );
}
