// Calibration as an operator does it: start, cancel, walk, verdict, accept; then the kept ones; and muting a sensor.

import { readFile } from "node:fs/promises";

const SIZES = [[1280, 720], [1920, 1080], [800, 900]];
const USUAL_SIZE = { width: 1440, height: 900 };
/** The server gathers for 120 s at most, and solves in a few more. */
const WALK_MS = 140_000;

const panel = (page) => page.getByTestId("calibrate-panel");
const shareOf = async (page) => parseFloat((await page.getByTestId("calibrate-share").textContent()) ?? "");

export async function calibration(page, report, { sensors }) {
  await report.step("calibration starts, tells what to do, and can be cancelled", async () => {
    await begin(page, report);
    await page.getByTestId("calibrate-cancel").click();
    await report.until("the wizard's first page again", async () => (await panel(page).getAttribute("data-state")) === "intro", 5000);
  }, { needed: true });
  await report.step("a walk covers every sensor's view", async () => {
    await page.getByTestId("calibrate-start").click();
    await report.until(`covered cells of ${sensors} sensors`, async () => {
      const cells = await page.getByTestId("calibrate-sensor").evaluateAll((maps) => maps.map((m) => Number(m.dataset.cells)));
      return { ok: cells.length >= sensors && cells.every((n) => n > 0), cells };
    }, 30_000);
    const before = await shareOf(page);
    await report.until("a share that grows", async () => {
      const over = (await panel(page).getAttribute("data-state")) === "done";
      const share = over ? 100 : await shareOf(page);
      return { ok: share > before, before, share };
    }, 20_000);
  }, { needed: true });
  await report.step("the wizard fits every size, and is read across the room", async () => {
    await sizes(page, report).finally(() => page.setViewportSize(USUAL_SIZE));
  });
  await report.step("the walk ends by itself with a verdict", async () => {
    await report.until("a verdict", async () => {
      const state = await panel(page).getAttribute("data-state");
      const trouble = await page.getByTestId("calibrate-trouble").allTextContents();
      return { ok: state === "done", state, trouble };
    }, WALK_MS);
    await report.shot("verdict dark");
    const result = page.getByTestId("calibrate-result");
    const verdict = await result.getAttribute("data-verdict");
    if (!["passed", "weak"].includes(verdict)) throw new Error(`the verdict is ${verdict}: ${await result.textContent()}`);
    await page.getByTestId("calibrate-details").locator("summary").click();
    const rows = await page.getByTestId("calibrate-details").locator("tbody tr").count();
    if (rows < sensors) throw new Error(`the details have ${rows} rows for ${sensors} sensors`);
    await report.shot("verdict details dark");
  }, { needed: true });
  await report.step("the result is in force once it is accepted", async () => {
    if ((await page.getByTestId("calibrate-result").getAttribute("data-decision")) !== "open") throw new Error("it is in force before anybody accepted it");
    await page.getByTestId("calibrate-accept").click();
    await page.getByTestId("calibrate-done").click();
    await panel(page).waitFor({ state: "detached", timeout: 3000 });
    await report.until("a calibration made just now", async () => {
      const text = await page.getByTestId("calibration-state").textContent();
      return { ok: /just now|\d+ s ago/.test(text ?? ""), text };
    }, 5000);
  });
  await kept(page, report);
  await muting(page, report, sensors);
}

async function begin(page, report) {
  await page.getByTestId("stage").focus();
  await page.keyboard.press("k");
  await report.shot("calibrate dark");
  await page.getByTestId("calibrate-start").click();
  await report.until("words for the person in the room", async () => {
    const hint = await page.getByTestId("calibrate-hint").textContent();
    return { ok: (hint ?? "").length > 5 && !hint.startsWith("Waiting"), hint };
  }, 10_000);
}

async function sizes(page, report) {
  for (const [width, height] of SIZES) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(400);
    const { over, letters, cut } = await page.evaluate(() => {
      const hint = document.querySelector('[data-testid="calibrate-hint"]');
      const cancel = document.querySelector('[data-testid="calibrate-cancel"]')?.getBoundingClientRect();
      return {
        over: document.documentElement.scrollWidth - innerWidth,
        letters: hint ? parseFloat(getComputedStyle(hint).fontSize) : 0,
        cut: cancel ? cancel.right > innerWidth || cancel.bottom > innerHeight : false,
      };
    });
    if (over > 0 || cut) throw new Error(`at ${width} x ${height} the wizard is ${over} px too wide, or its cancel button is out of sight`);
    // On a screen of half a metre these are letters of 17 mm and more: three times what good eyes need at 3 m.
    if (letters && letters < 0.035 * Math.min(width, height)) throw new Error(`at ${width} x ${height} the hint has letters of only ${letters} px`);
    await report.shot(`walk dark ${width}`);
  }
  await page.setViewportSize(USUAL_SIZE);
  if ((await panel(page).getAttribute("data-state")) !== "running") return;
  await page.getByTestId("calibrate-large").click();
  await page.waitForTimeout(200);
  if (!(await page.getByTestId("record-button").isVisible())) throw new Error("made small, the wizard still hides the page");
  await report.shot("walk small dark");
  await page.getByTestId("calibrate-large").click();
}

async function kept(page, report) {
  await report.step("calibrations are kept, compared, and one of them is in force", async () => {
    await page.getByTestId("calibrations-button").click();
    const all = page.getByTestId("kept");
    await report.until("a kept calibration that is in force", async () => {
      const trouble = await page.getByTestId("kept-trouble").allTextContents();
      const states = await all.evaluateAll((list) => list.map((one) => `${one.dataset.name}: ${one.dataset.inForce}`));
      return { ok: states.filter((s) => s.endsWith(": true")).length === 1, states, trouble };
    }, 5000);
    if ((await all.count()) > 1) {
      await page.getByTestId("kept-compare").first().click();
      await page.getByTestId("moves").waitFor({ timeout: 5000 });
    }
    await report.shot("calibrations dark");
  });
  await report.step("one is saved to a file, and the file read again", async () => {
    const [file] = await Promise.all([page.waitForEvent("download"), page.locator('[data-testid="kept"][data-in-force="true"]').getByTestId("kept-save-1").click()]);
    const path = await file.path();
    const text = await readFile(path, "utf8");
    const sensor = await page.getByTestId("sensor-card").first().getAttribute("data-sensor");
    if (!text.includes(sensor)) throw new Error(`${file.suggestedFilename()} does not name sensor ${sensor}: ${text.slice(0, 200)}`);
    await page.getByTestId("import-file").setInputFiles({ name: file.suggestedFilename(), mimeType: "text/plain", buffer: Buffer.from(text) });
    await page.getByTestId("import-read").waitFor({ timeout: 5000 });
    await page.getByTestId("import-file").setInputFiles({ name: "notes.toml", mimeType: "text/plain", buffer: Buffer.from("no = 'calibration'\n") });
    await page.getByTestId("import-trouble").waitFor({ timeout: 5000 });
    await report.shot("import refused dark");
  });
  await report.step("Escape closes the list", async () => {
    await page.keyboard.press("Escape");
    await page.getByTestId("calibrations-dialog").waitFor({ state: "hidden", timeout: 3000 });
  });
}

async function muting(page, report, sensors) {
  const card = page.getByTestId("sensor-card").last();
  const name = await card.getAttribute("data-sensor");
  const hollow = async () => Number(await page.getByTestId("stage").getAttribute("data-muted"));
  await report.step("every sensor's weight is shown, joint by joint", async () => {
    await report.until("weights on the cards", async () => {
      const weights = await page.getByTestId("weight").evaluateAll((bars) => bars.map((bar) => bar.dataset.weight ?? ""));
      return { ok: weights.filter((w) => Number(w) > 0).length >= Math.min(2, sensors), weights };
    });
    await page.getByTestId("weights-button").click();
    const columns = await page.getByTestId("matrix").locator("thead th").count();
    if (columns !== (await page.getByTestId("sensor-card").count()) + 1) throw new Error(`the table of joints has ${columns} columns`);
    await report.shot("weights dark");
    await page.keyboard.press("Escape");
    await page.getByTestId("more").first().click();
    await report.shot("joints of a sensor dark");
  });
  await report.step("one sensor is calibrated alone, or the server says why not", async () => {
    await page.getByTestId("recalibrate-button").first().click();
    const dialog = page.getByTestId("recalibrated-dialog");
    await report.until("a verdict or a reason", async () => {
      const words = [...(await dialog.getByTestId("recalibrate-result").allTextContents()), ...(await dialog.getByTestId("recalibrate-trouble").allTextContents())];
      return { ok: words.length === 1 && words[0].length > 5, words };
    }, 60_000);
    await report.shot("recalibrated dark");
    await page.keyboard.press("Escape");
    await page.getByTestId("more").first().click();
  });
  await report.step(`${name} is muted with one click, drawn hollow, and comes back`, async () => {
    const mute = card.getByTestId("mute");
    await mute.click();
    await report.until("a card that says muted, and a hollow sensor", async () => {
      const muted = await card.getAttribute("data-muted");
      return { ok: muted === "true" && (await hollow()) === 1, muted, hollow: await hollow(), notices: await page.getByTestId("notice-error").allTextContents() };
    }, 5000);
    // The server says so too, not only the page.
    await page.waitForTimeout(1500);
    if ((await card.getAttribute("data-muted")) !== "true") throw new Error("the server's next word took the muting back");
    await report.shot("muted dark");
    await mute.click();
    await report.until("the sensor back in fusing", async () => (await card.getAttribute("data-muted")) === "false" && (await hollow()) === 0, 5000);
  });
  await report.step("the second plot shows drift instead of residuals", async () => {
    await page.getByTestId("plot-residual-choice").selectOption("moved");
    await page.waitForTimeout(300);
    await report.shot("drift dark");
    await page.getByTestId("plot-residual-choice").selectOption("residual");
    await page.getByTestId("stage").focus();
  });
}
