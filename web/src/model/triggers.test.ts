import { create } from "@bufbuild/protobuf";
import { expect, it } from "vitest";
import { TriggerStatusSchema } from "../gen/posefuse/v1/room_pb";
import { triggerLines } from "./triggers";

const trigger = (init: Parameters<typeof create<typeof TriggerStatusSchema>>[1]) => create(TriggerStatusSchema, init);

it("has a line for each port, and for HTTP once it was used", () => {
  const now = 1_800_000_000_000;
  const latestUnixNs = BigInt(now - 30_000) * 1_000_000n;
  const lines = triggerLines(
    [
      trigger({ name: "http" }),
      trigger({ name: "osc", place: "udp 127.0.0.1:7402" }),
      trigger({ name: "capture", latest: "refused: no take is being recorded", latestRefused: true, latestUnixNs }),
    ],
    now,
  );
  expect(lines.map((l) => [l.name, l.text, l.alert])).toEqual([
    ["OSC", "waits for an order", false],
    ["CaptureStart", "refused: no take is being recorded, 30 s ago", true],
  ]);
  const [http] = triggerLines([trigger({ name: "http", latest: "started take `walk`", latestUnixNs })], now);
  expect(http?.text).toBe("started take `walk`, 30 s ago");
  const [busy] = triggerLines([trigger({ name: "osc", trouble: "port 7402 is in use", latest: "x", latestUnixNs })], now);
  expect(busy).toMatchObject({ text: "port 7402 is in use", alert: true });
});
