import { create } from "@bufbuild/protobuf";
import { expect, it } from "vitest";
import { SinkState, SinkStatusSchema } from "../gen/posefuse/v1/room_pb";
import { canSwitch, CounterRates, sinkFigures, sinkName, sinkState } from "./sinks";

const sink = (init: Parameters<typeof create<typeof SinkStatusSchema>>[1]) => create(SinkStatusSchema, init);

it("says the state in words", () => {
  expect(sinkState(sink({ state: SinkState.OFF }))).toMatchObject({ name: "off", word: "Off", on: false });
  expect(sinkState(sink({ state: SinkState.RUNNING }))).toMatchObject({ name: "running", on: true });
  expect(sinkState(sink({ state: SinkState.FAILING }))).toMatchObject({ name: "failing", kind: "bad", on: true });
  expect(canSwitch(sink({ name: "watch" }))).toBe(false);
  expect(canSwitch(sink({ name: "osc", state: SinkState.OFF }))).toBe(true);
  expect([sinkName(sink({ name: "vmc" })), sinkName(sink({ name: "new-one" }))]).toEqual(["VMC", "new-one"]);
});

it("shows no figures of an output that is off", () => {
  expect(sinkFigures(sink({ state: SinkState.OFF, delivered: 12n, clients: 0 }), 0)).toEqual([]);
  expect(sinkFigures(sink({ state: SinkState.FAILING, dropped: 12n }), undefined)).toHaveLength(4);
});

it("shows what it sends, to how many, and what it lost", () => {
  const init = { state: SinkState.RUNNING, delivered: 1200n, dropped: 3n, rateHz: 60, p50Ms: 0.114, p99Ms: 1.5 };
  const figures = sinkFigures(sink(init), 29.96);
  expect(figures.map((f) => [f.name, f.value, f.alert ?? false])).toEqual([
    ["Rate", "30.0\u00a0fps", false],
    ["Delivered", "1\u202f200", false],
    ["Dropped", "3", true],
    ["Adds p50 / p99", "0.11 / 1.50\u00a0ms", false],
  ]);
  expect(figures[0]!.title).toContain("at most 60");
  const clients = sinkFigures(sink({ ...init, clients: 2 }), undefined).map((f) => `${f.name} ${f.value}`);
  expect([clients[0], clients.at(-1)]).toEqual(["Rate –", "Clients 2"]);
});

it("tells how fast a counter grows, and forgets when it begins anew", () => {
  const rates = new CounterRates(3);
  expect(rates.add("osc", 10, 0n)).toBeUndefined();
  for (let i = 1; i <= 20; i++) expect(rates.add("osc", 10 + i / 4, BigInt(i * 7))).toBeCloseTo(28);
  expect(rates.add("osc", 16, 140n)).toBeLessThan(28);
  expect(rates.add("osc", 16.25, 5n)).toBeUndefined();
  expect(rates.add("osc", 16.5, 10n)).toBeCloseTo(20);
});
