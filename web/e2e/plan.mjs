// Planning the room: what is seen, the next sensor, planned ones, interference.

const number = async (page, testid) => parseFloat((await page.getByTestId(testid).textContent()) ?? "");
const settled = (page, report) =>
  report.until("an answer", async () => {
    // An edit is asked for after a pause.
    await page.waitForTimeout(250);
    const busy = await page.getByTestId("plan-panel").getAttribute("data-busy");
    const trouble = await page.getByTestId("plan-trouble").allTextContents();
    return { ok: busy === "false" && trouble.length === 0, busy, trouble };
  });

export async function plan(page, report) {
  await report.step("O shows what the room's sensors see", async () => {
    await page.getByTestId("stage").focus();
    await page.keyboard.press("o");
    await page.getByTestId("plan-panel").waitFor({ timeout: 3000 });
    await settled(page, report);
    const drawn = Number(await page.getByTestId("stage").getAttribute("data-plan"));
    if (drawn < 1) throw new Error("no sensor of the plan is drawn");
    const [one, two] = [await number(page, "plan-share-1"), await number(page, "plan-share-2")];
    if (!(one >= two && one > 0)) throw new Error(`one or more see ${one} %, two or more ${two} %`);
    await page.waitForTimeout(500);
    await report.shot("plan dark");
  });
  await report.step("planned sensors raise the share that two see", async () => {
    await page.getByTestId("plan-auto").uncheck();
    await page.getByTestId("plan-sides-0").fill("7");
    await page.getByTestId("plan-sides-0").press("Tab");
    await settled(page, report);
    const before = await number(page, "plan-share-2");
    for (let i = 0; i < 2; i++) {
      await page.getByTestId("plan-add").click();
      await settled(page, report);
    }
    const [after, rows] = [await number(page, "plan-share-2"), await page.getByTestId("plan-row").count()];
    if (rows !== 2 || !(after > before)) throw new Error(`${rows} planned sensors raised the share from ${before} % to ${after} %`);
    await report.shot("plan more dark");
  });
  await report.step("two sensors with structured light are told to disturb each other", async () => {
    for (const row of [0, 1]) await page.getByTestId("plan-row").nth(row).getByRole("combobox").selectOption("Kinect v1");
    await settled(page, report);
    await page.getByTestId("plan-layer-1").click();
    await page.waitForTimeout(400);
    await report.shot("plan interference dark");
    await page.getByTestId("theme").click();
    await page.waitForTimeout(600);
    await report.shot("plan interference light");
    await page.getByTestId("theme").click();
  });
  await fromNothing(page, report);
  await report.step("the plan closes and leaves nothing behind", async () => {
    await page.getByTestId("plan-clear").click();
    if (await page.getByTestId("plan-room").isEnabled()) await page.getByTestId("plan-room").check();
    await page.getByTestId("plan-close").click();
    await page.getByTestId("plan-panel").waitFor({ state: "detached", timeout: 3000 });
    await report.until("nothing of the plan to be drawn", async () => (await page.getByTestId("stage").getAttribute("data-plan")) === "", 3000);
  });
}

/** Also works in a room without sensors. */
export async function fromNothing(page, report) {
  await report.step("a room is planned from nothing", async () => {
    if (await page.getByTestId("plan-clear").count()) await page.getByTestId("plan-clear").click();
    const own = page.getByTestId("plan-room");
    if (await own.isEnabled()) await own.uncheck();
    await page.getByTestId("plan-layer-whole").click();
    await page.getByTestId("plan-auto").check();
    await settled(page, report);
    await page.getByTestId("plan-place").click();
    await report.until("four sensors", async () => {
      const rows = await page.getByTestId("plan-row").count();
      return { ok: rows === 4, rows };
    });
    await settled(page, report);
    const two = await number(page, "plan-share-2");
    if (!(two > 70)) throw new Error(`four sensors see only ${two} % of 4 m by 4 m twice`);
    await page.waitForTimeout(500);
    await report.shot("plan from nothing dark");
  });
}
