// What is checked on the page, in the order an operator would do it.

import { calibration } from "./calibration.mjs";
import { depth, noDepth } from "./depth.mjs";
import { outputs } from "./outputs.mjs";
import { fromNothing, plan } from "./plan.mjs";

const attribute = (page, testid, name) => page.getByTestId(testid).getAttribute(name);
const pressed = async (page, testid) => (await attribute(page, testid, "aria-pressed")) === "true";
const drawn = async (page, what) => Number((await attribute(page, "stage", `data-${what}`)) ?? 0);

export async function emptyRoom(page, report, { url }) {
  await report.step("it says that there is no sensor, and what to run", async () => {
    await page.getByTestId("empty").waitFor({ timeout: 15_000 });
    const line = (await page.getByTestId("empty-command").textContent()) ?? "";
    if (!line.includes("posefuse agent sim") || !line.includes(url.origin)) throw new Error(`the line to run is ${JSON.stringify(line)}; it must name ${url.origin}`);
    await report.shot("empty dark");
  });
  await report.step("no sensor card is there and calibration is not offered", async () => {
    const cards = await page.getByTestId("sensor-card").count();
    if (cards > 0) throw new Error(`found ${cards} sensor cards; is this server without agents?`);
    if (await page.getByTestId("calibrate-button").isEnabled()) throw new Error("the calibrate button can be pressed");
  });
  await report.step("the light theme", async () => {
    await page.keyboard.press("t");
    await report.shot("empty light");
  });
  await report.step("planning opens from there", async () => {
    await page.getByTestId("empty-plan").click();
    await page.getByTestId("plan-panel").waitFor({ timeout: 3000 });
    if ((await page.getByTestId("empty").count()) > 0) throw new Error("the words about missing sensors cover the plan");
  });
  await fromNothing(page, report);
}

export async function fullRoom(page, report, opts) {
  await room(page, report, opts);
  await view(page, report);
  await noDepth(page, report);
  await outputs(page, report);
  await plan(page, report);
  const take = `e2e_${Date.now() % 1_000_000}`;
  await record(page, report, take);
  await replay(page, report, take);
  await calibration(page, report, opts);
  await keyboard(page, report);
  await appearance(page, report);
  await serverGone(page, report);
}

/** A room whose sensors have depth previews. */
export async function depthRoom(page, report, opts) {
  await room(page, report, opts);
  await depth(page, report);
}

async function room(page, report, { sensors, waitMs }) {
  await report.step(`${sensors} sensors are live`, async () => {
    await report.until(`${sensors} cards in state "live"`, async () => {
      const states = await page.getByTestId("sensor-card").evaluateAll((cards) => cards.map((c) => `${c.dataset.sensor}: ${c.dataset.state}`));
      return { ok: states.filter((s) => s.endsWith(": live")).length >= sensors, states };
    }, waitMs);
  }, { needed: true });
  await report.step("a person is fused and drawn", async () => {
    await report.until("a person in the 3D view (is the room calibrated?)", async () => {
      const people = await drawn(page, "people");
      const calibration = (await page.getByTestId("calibration-state").textContent())?.trim();
      return { ok: people >= 1, people, calibration };
    }, waitMs);
  }, { needed: true });
  await report.step("fused frames come at a steady rate", async () => {
    await report.until("more than 5 fused frames per second", async () => {
      const text = await page.getByTestId("figure-fps").textContent();
      return { ok: parseFloat(text ?? "") > 5, text };
    });
  });
  await report.step("both plots have lines", async () => {
    await report.until("a joint speed and a residual", async () => {
      const lines = [Number(await attribute(page, "plot-speed", "data-lines")), Number(await attribute(page, "plot-residual", "data-lines"))];
      return { ok: lines.every((n) => n > 0), lines };
    }, 30_000);
    await page.waitForTimeout(4000);
    await report.shot("live dark");
  });
}

async function view(page, report) {
  await report.step("the canvas shows something", async () => {
    const canvas = page.getByTestId("stage").locator("canvas");
    const bytes = (await canvas.screenshot()).length;
    if (bytes < 6000) throw new Error(`a picture of the canvas has only ${bytes} bytes: it seems blank`);
  });
  await report.step("raw skeletons come and go with their toggle", async () => {
    await page.getByTestId("toggle-raw").click();
    if (!(await pressed(page, "toggle-raw"))) throw new Error("the toggle is not pressed after a click");
    await report.until("raw skeletons of at least two sensors", async () => {
      const raw = await drawn(page, "raw");
      return { ok: raw >= 2, raw };
    });
    await report.shot("raw dark");
    await page.getByTestId("toggle-raw").click();
    await report.until("no raw skeleton", async () => {
      const raw = await drawn(page, "raw");
      return { ok: raw === 0, raw };
    });
  });
  await report.step("view presets", async () => {
    for (const preset of ["front", "top", "side", "fit"]) {
      await page.getByTestId(`view-${preset}`).click();
      await page.waitForTimeout(500);
      if (preset === "top") await report.shot("top dark");
    }
  });
}

async function record(page, report, take) {
  await report.step("no take is running (one of the demo's own is stopped)", async () => {
    if ((await page.getByTestId("rec-time").count()) === 0) return;
    await report.shot("somebody else records");
    await page.getByTestId("record-button").click();
    await report.until("the end of the running take", async () => (await page.getByTestId("take-name").count()) === 1);
  }, { needed: true });
  await report.step(`a take named ${take} is recorded`, async () => {
    await page.getByTestId("take-name").fill(take);
    await page.getByTestId("take-slate").fill("7B");
    await page.getByTestId("take-notes").fill("made by the e2e script");
    await page.getByTestId("record-button").click();
    await report.until("the running time", async () => (await page.getByTestId("rec-time").count()) === 1);
    const name = await page.getByTestId("rec-name").textContent();
    if (name !== take) throw new Error(`the page records a take named ${name}`);
    const seconds = async () => Number((await page.getByTestId("rec-time").textContent())?.split(":").pop());
    const before = await seconds();
    await page.waitForTimeout(3500);
    const passed = (await seconds()) - before;
    if (passed < 2 || passed > 6) throw new Error(`in 3.5 s the running time went on by ${passed.toFixed(1)} s`);
    await report.shot("recording dark");
  }, { needed: true });
  await report.step("it stops and stands in the list", async () => {
    await page.getByTestId("record-button").click();
    const row = page.locator(`[data-testid="take-row"][data-take="${take}"]`);
    await report.until(`a row for ${take} in state "complete"`, async () => {
      if ((await row.count()) === 0) return { ok: false, rows: await page.getByTestId("take-row").count() };
      const state = await row.getAttribute("data-state");
      return { ok: state === "complete", state };
    });
    const text = (await row.textContent()) ?? "";
    if (!text.includes("7B")) throw new Error(`the row does not show the slate 7B: ${text}`);
  }, { needed: true });
}

async function replay(page, report, take) {
  await report.step("the take says how it becomes files", async () => {
    const row = page.locator(`[data-testid="take-row"][data-take="${take}"]`);
    await row.getByTestId("export-button").click();
    await row.locator("select").selectOption("unity");
    const line = (await row.getByTestId("export-command").textContent()) ?? "";
    if (!line.startsWith(`posefuse export ${take} --preset unity`)) throw new Error(`the command is ${JSON.stringify(line)}`);
    await row.getByText("Close").click();
  });
  await report.step("the take is replayed, with a banner that says so", async () => {
    await page.locator(`[data-testid="take-row"][data-take="${take}"]`).getByTestId("replay-button").click();
    const banner = (await page.getByTestId("replay-banner").textContent()) ?? "";
    if (!banner.includes(take)) throw new Error(`the banner says ${JSON.stringify(banner)}`);
    await report.until("a person in the replay", async () => {
      const trouble = await page.getByTestId("replay-trouble").allTextContents();
      const state = await attribute(page, "replay-bar", "data-state");
      const people = await drawn(page, "people");
      return { ok: people >= 1 && trouble.length === 0, people, state, trouble };
    });
    await report.shot("replay dark");
  });
  await report.step("seek and pause", async () => {
    const at = async () => Number((await page.getByTestId("replay-time").textContent())?.split("/")[0]?.split(":").pop());
    await page.getByTestId("play").click();
    await report.until("the state paused", async () => {
      const state = await attribute(page, "replay-bar", "data-state");
      return { ok: state === "paused" || state === "ended", state };
    });
    await page.getByTestId("seek").fill("1");
    await page.waitForTimeout(1500);
    const seconds = await at();
    if (Math.abs(seconds - 1) > 0.11) throw new Error(`paused and set to 1 s, it stands at ${seconds} s`);
    if ((await drawn(page, "people")) < 1) throw new Error("nobody is drawn after seeking to 1 s in a paused take");
    await page.getByTestId("speed").selectOption("2");
    await page.getByTestId("play").click();
    await report.until("the take's end at double speed", async () => {
      const state = await attribute(page, "replay-bar", "data-state");
      return { ok: state === "ended", state, at: await at() };
    });
  });
  await report.step("and back to the live room", async () => {
    await page.getByTestId("back-to-live").click();
    if ((await page.getByTestId("replay-banner").count()) > 0) throw new Error("the replay banner is still there");
    await report.until("a live person again", async () => {
      const people = await drawn(page, "people");
      return { ok: people >= 1, people };
    });
  });
}

async function keyboard(page, report) {
  await report.step("? lists the shortcuts, Escape closes the list", async () => {
    await page.keyboard.press("?");
    await page.getByTestId("help-dialog").waitFor({ state: "visible", timeout: 3000 });
    await report.shot("help dark");
    await page.keyboard.press("Escape");
    await page.getByTestId("help-dialog").waitFor({ state: "hidden", timeout: 3000 });
  });
  await report.step("shortcuts work, but not while a name is typed", async () => {
    await page.keyboard.press("w");
    await report.until("W to show raw skeletons", () => pressed(page, "toggle-raw"), 3000);
    await page.keyboard.press("w");
    await report.until("W to hide raw skeletons", async () => !(await pressed(page, "toggle-raw")), 3000);
    await page.getByTestId("take-name").fill("");
    await page.getByTestId("take-name").focus();
    await page.keyboard.type("row");
    if (await pressed(page, "toggle-raw")) throw new Error("W typed into the name of a take switched raw skeletons on");
    if ((await page.getByTestId("rec-time").count()) > 0) throw new Error("R typed into the name of a take started recording");
    await page.getByTestId("take-name").fill("");
    await page.getByTestId("stage").focus();
  });
  await report.step("Tab reaches record, calibrate and the 3D view, with a visible focus", async () => {
    await page.evaluate(() => document.activeElement?.blur());
    const seen = new Set();
    for (let i = 0; i < 80; i++) {
      await page.keyboard.press("Tab");
      const focus = await page.evaluate(() => {
        const element = document.activeElement;
        const style = element && getComputedStyle(element);
        return { id: element?.dataset?.testid ?? "", outline: style ? parseFloat(style.outlineWidth) : 0, kind: style?.outlineStyle };
      });
      if (!focus.id) continue;
      if (!seen.has(focus.id) && (focus.kind === "none" || focus.outline < 1)) throw new Error(`${focus.id} has the focus but shows no outline`);
      seen.add(focus.id);
    }
    for (const wanted of ["record-button", "calibrate-button", "stage", "toggle-raw", "take-name", "person-chip", "theme"]) {
      if (!seen.has(wanted)) throw new Error(`Tab never reached ${wanted}; it reached ${[...seen].join(", ")}`);
    }
  });
  await report.step("K opens calibration, Escape closes it", async () => {
    await page.getByTestId("stage").focus();
    await page.keyboard.press("k");
    await page.getByTestId("calibrate-panel").waitFor({ timeout: 3000 });
    await page.keyboard.press("Escape");
    await page.getByTestId("calibrate-panel").waitFor({ state: "detached", timeout: 3000 });
  });
}

async function appearance(page, report) {
  await report.step("the light theme", async () => {
    const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
    if ((await theme()) !== "dark") throw new Error("a browser that prefers dark was not given the dark theme");
    await page.getByTestId("theme").click();
    if ((await theme()) !== "light") throw new Error("the theme button does not change to light");
    await page.waitForTimeout(800);
    await report.shot("live light");
  });
  await report.step("nothing is cut off at 1024 and 800 pixels", async () => {
    for (const [width, height] of [[1024, 768], [800, 900]]) {
      await page.setViewportSize({ width, height });
      await page.waitForTimeout(600);
      const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      if (over > 0) throw new Error(`at ${width} px the page is ${over} px too wide`);
      await report.shot(`live light ${width}`);
    }
    await page.setViewportSize({ width: 1440, height: 900 });
  });
}

/** The browser's network is cut rather than the server stopped: whoever started the server still needs it. */
async function serverGone(page, report) {
  await report.step("a server that goes away is announced, and found again", async () => {
    await page.context().route("**/posefuse.v1.Room/**", (route) => route.abort("connectionrefused"));
    await page.evaluate(() => dispatchEvent(new Event("posefuse:retry")));
    await page.getByTestId("offline").waitFor({ timeout: 10_000 });
    await report.shot("server gone light");
    await page.context().unroute("**/posefuse.v1.Room/**");
    await report.until("the banner to go and a person to come back", async () => {
      const state = await attribute(page, "connection", "data-state");
      const people = await drawn(page, "people");
      return { ok: state === "online" && people >= 1, state, people };
    }, 20_000);
    report.forgiveNetwork();
  });
}
