import { expect, it } from "vitest";
import { dayNs, timecode } from "./timecode";

it("counts whole rates", () => {
  expect(timecode("25", 3661.5e9)).toBe("01:01:01:12");
  expect(timecode("24", 86_399.999e9)).toBe("23:59:59:23");
  expect(timecode("60", 43_200.017e9)).toBe("12:00:00:01");
  expect(timecode("50", 19_990_000)).toBe("00:00:00:00");
  expect(timecode("50", 20_000_000)).toBe("00:00:00:01");
  expect(timecode("30", 33_333_333)).toBe("00:00:00:01");
  expect(timecode("30", 86_400e9 - 1)).toBe("23:59:59:29");
  expect(timecode("23.98", 0)).toBe("");
});

it("skips two labels a minute but every tenth in drop-frame, and ends with the day", () => {
  const numbered = (number: number) => timecode("29.97df", Math.ceil((number * 1001e9) / 30_000));
  for (const [number, label] of [
    [0, "00:00:00;00"], [1799, "00:00:59;29"], [1800, "00:01:00;02"], [3597, "00:01:59;29"], [3598, "00:02:00;02"],
    [17_981, "00:09:59;29"], [17_982, "00:10:00;00"], [19_782, "00:11:00;02"], [107_892, "01:00:00;00"], [2_589_407, "23:59:59;29"],
  ] as const) {
    expect(numbered(number), String(number)).toBe(label);
  }
  expect(timecode("29.97df", 86_400e9 - 1)).toBe("23:59:59;29");
});

it("has the room's own midnight", () => {
  expect(dayNs(0n, 7200)).toBe(7200e9);
  expect(dayNs(-7_200_000_000_001n, 7200)).toBe(86_400e9 - 1);
  expect(dayNs(1_800_000_000_123_456_789n, 0)).toBe(28_800_123_456_789);
});
