// A share as a bar. The figure stands beside it in words wherever it is used.

interface Props {
  /** 0 to 1. */
  share: number;
  /** The style sheet's classes. */
  kind?: string;
  /** What it is the share of; without one it is left to the words beside it. */
  label?: string;
  testid?: string;
}

export function Bar({ share, kind = "", label, testid }: Props) {
  const percent = Math.round(100 * Math.min(Math.max(share, 0), 1));
  const spoken = label ? { role: "progressbar" as const, "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": percent } : { "aria-hidden": true };
  return (
    <span class={`bar ${kind}`} data-testid={testid} {...spoken}>
      <span style={{ width: `${percent}%` }} />
    </span>
  );
}
