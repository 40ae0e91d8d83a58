// Depth previews: in a card, on the skeleton, enlarged, in the room; and what the page says where there are none.

const attribute = (page, testid, name) => page.getByTestId(testid).first().getAttribute(name);

/** Rooms whose sensors have no depth, as the demo's: the page says so instead of waiting. */
export async function noDepth(page, report) {
  await report.step("a sensor without depth says why", async () => {
    await page.getByTestId("depth-button").first().click();
    const words = (await page.getByTestId("depth").first().textContent()) ?? "";
    if (!words.includes("No depth images")) throw new Error(`the page says ${JSON.stringify(words)}`);
    await page.getByTestId("depth-button").first().click();
    if ((await page.getByTestId("depth").count()) > 0) throw new Error("the preview is still there after a second click");
  });
}

export async function depth(page, report) {
  await report.step("depth opens in a card with the skeleton on it", async () => {
    await page.getByTestId("depth-button").first().click();
    await live(page, report, 1);
    await report.until("a tracked body on the picture", async () => {
      const bodies = Number(await attribute(page, "depth-canvas", "data-bodies"));
      return { ok: bodies >= 1, bodies };
    });
    const canvas = page.getByTestId("depth-canvas").first();
    const bytes = (await canvas.screenshot()).length;
    if (bytes < 3000) throw new Error(`a picture of the preview has only ${bytes} bytes: it seems blank`);
    await report.shot("depth dark");
  });
  await report.step("several come on one stream, and stand in the room as points", async () => {
    await page.getByTestId("depth-button").nth(1).click();
    await live(page, report, 2);
    await report.until("points in the 3D view", async () => {
      const points = Number(await attribute(page, "stage", "data-cloud"));
      return { ok: points > 5000, points };
    });
    await report.shot("depth several dark");
    await page.getByTestId("stage").focus();
    await page.keyboard.press("d");
    await report.until("D to hide them", async () => Number(await attribute(page, "stage", "data-cloud")) === 0, 3000);
    await page.keyboard.press("d");
  });
  await report.step("a preview is enlarged by keyboard, and closes", async () => {
    await page.getByTestId("depth-enlarge").first().focus();
    await page.keyboard.press("Enter");
    const dialog = page.getByTestId("depth-dialog");
    await dialog.waitFor({ state: "visible", timeout: 3000 });
    await report.until("an image in the dialog", async () => (await dialog.getByTestId("depth-canvas").getAttribute("data-live")) === "true");
    await page.waitForTimeout(600);
    await report.shot("depth large dark");
    await page.keyboard.press("Escape");
    await dialog.waitFor({ state: "hidden", timeout: 3000 });
  });
  await report.step("in the light theme", async () => {
    await page.getByTestId("theme").click();
    await page.waitForTimeout(800);
    await report.shot("depth light");
    await page.getByTestId("theme").click();
  });
  await report.step("the stream ends with the last preview", async () => {
    const ended = page.waitForEvent("requestfailed", { predicate: (r) => r.url().endsWith("/WatchDepth"), timeout: 5000 });
    await page.getByTestId("depth-button").first().click();
    await page.getByTestId("depth-button").nth(1).click();
    await ended;
    await report.until("no points in the room", async () => Number(await attribute(page, "stage", "data-cloud")) === 0, 3000);
    report.forgiveNetwork();
  });
}

async function live(page, report, previews) {
  // Trackers and the browser's software rendering share the processor, so that images may come slowly.
  await report.until(`${previews} previews at more than one in 5 s`, async () => {
    const rates = await page.getByTestId("depth-canvas").evaluateAll((all) => all.map((c) => Number(c.dataset.rate)));
    return { ok: rates.filter((rate) => rate > 0.2).length >= previews, rates };
  }, 40_000);
}
