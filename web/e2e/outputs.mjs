// Live outputs: the card of the OSC output, switched on and off, and what the page says of it. Timecode runs.

const card = (page, sink) => page.locator(`[data-testid="sink-card"][data-sink="${sink}"]`);

export async function outputs(page, report) {
  await report.step("the timecode runs with the clock", async () => {
    const read = async () => (await page.getByTestId("timecode").textContent()) ?? "";
    const first = await read();
    if (!/^\d\d:\d\d:\d\d[:;]\d\d$/.test(first)) throw new Error(`the timecode is ${JSON.stringify(first)}`);
    const seconds = (text) => text.slice(0, 8).split(":").reduce((sum, part) => 60 * sum + Number(part), 0);
    await page.waitForTimeout(2000);
    const second = await read();
    const passed = (seconds(second) - seconds(first) + 86_400) % 86_400;
    if (passed < 1 || passed > 4) throw new Error(`in 2 s the timecode went from ${first} to ${second}`);
    const now = new Date();
    const off = Math.abs(seconds(await read()) - (now.getUTCHours() * 3600 + now.getUTCMinutes() * 60 + now.getUTCSeconds()));
    if (Math.min(off, 86_400 - off) > 2) throw new Error(`the timecode ${second} is ${off} s off ${now.toISOString()}`);
  });
  const osc = card(page, "osc");
  const is = (state) =>
    report.until(`the osc output to be ${state}`, async () => {
      const found = await osc.getAttribute("data-state");
      return { ok: found === state, found };
    }, 8000);
  const control = osc.getByTestId("sink-switch");
  await report.step("an output is switched on by keyboard, and frames go out", async () => {
    await is("off");
    if ((await control.getAttribute("aria-checked")) !== "false") throw new Error("the switch of an output that is off is checked");
    await control.focus();
    await page.keyboard.press("Space");
    await is("running");
    if ((await control.getAttribute("aria-checked")) !== "true") throw new Error("the switch of an output that runs is not checked");
    await report.until("frames delivered at a rate", async () => {
      const text = (await osc.textContent()) ?? "";
      const rate = parseFloat(/Rate([\d.]+)/.exec(text)?.[1] ?? "");
      return { ok: rate > 5, text };
    });
    await osc.scrollIntoViewIfNeeded();
    await report.shot("outputs dark");
    await page.getByTestId("theme").click();
    await page.waitForTimeout(500);
    await report.shot("outputs light");
    await page.getByTestId("theme").click();
  });
  await report.step("and off again: nothing more goes out", async () => {
    await control.click();
    await is("off");
    const delivered = () => osc.getAttribute("data-delivered");
    await page.waitForTimeout(600);
    const before = await delivered();
    await page.waitForTimeout(1200);
    const after = await delivered();
    if (!(Number(before) > 0) || before !== after) throw new Error(`delivered went on from ${before} to ${after}`);
  });
}
