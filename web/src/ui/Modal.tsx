// A dialog over the page. Its content exists only while it is open.

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { dialog, type DialogName } from "../state/store";

export function Modal(props: { name: DialogName; title: string; wide?: boolean; children: ComponentChildren }) {
  const ref = useRef<HTMLDialogElement>(null);
  const open = dialog.value === props.name;
  useEffect(() => {
    if (open && !ref.current?.open) ref.current?.showModal();
    if (!open && ref.current?.open) ref.current.close();
  }, [open]);
  const close = () => {
    if (dialog.peek() === props.name) dialog.value = "none";
  };
  return (
    <dialog
      ref={ref}
      class={props.wide ? "wide" : ""}
      aria-labelledby={`${props.name}-title`}
      data-testid={`${props.name}-dialog`}
      onClose={close}
      onClick={(e) => e.target === ref.current && close()}
    >
      <div class="dialog-inner">
        <header class="dialog-head">
          <h2 id={`${props.name}-title`}>{props.title}</h2>
          <button type="button" onClick={close}>
            Close
          </button>
        </header>
        {open && props.children}
      </div>
    </dialog>
  );
}
