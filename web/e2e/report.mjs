// Runs the steps one after another, prints each, and gathers what the browser itself complained of.

import { join } from "node:path";

/** A failed step that makes the later ones pointless. */
export class Stop extends Error {}

export class Report {
  failed = false;
  #stopped = false;
  #page = null;
  #foreign = [];
  #complaints = [];
  #shots = 0;

  constructor(opts) {
    this.opts = opts;
  }

  /** Notes every request off the page's origin, and every error in the console. */
  watch(page) {
    this.#page = page;
    const origin = this.opts.url.origin;
    const local = (url) => url.startsWith(origin + "/") || /^(data|blob|about):/.test(url);
    page.context().on("request", (request) => local(request.url()) || this.#foreign.push(request.url()));
    page.on("websocket", (socket) => this.#foreign.push(socket.url()));
    page.on("console", (message) => message.type() === "error" && this.#complaints.push(message.text()));
    page.on("pageerror", (error) => this.#complaints.push(error.stack ?? error.message));
  }

  /** Waits until `check` gives something true; says what it last gave when it never does. */
  async until(what, check, ms = 15_000) {
    const end = Date.now() + ms;
    let last;
    for (;;) {
      last = await check();
      if (last === true || (last && last.ok)) return last;
      if (Date.now() > end) throw new Error(`waited ${ms / 1000} s for ${what}; last seen: ${JSON.stringify(last)}`);
      await new Promise((resolve) => setTimeout(resolve, 150));
    }
  }

  async step(name, run, { needed = false } = {}) {
    if (this.#stopped) return console.log(`skip  ${name}`);
    const start = Date.now();
    try {
      await run();
      console.log(`ok    ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
    } catch (error) {
      this.failed = true;
      this.#stopped ||= needed;
      console.log(`FAIL  ${name}\n      ${String(error.message).replaceAll("\n", "\n      ")}`);
      await this.shot(`failed ${name}`).catch(() => undefined);
    }
  }

  /** Drops the console's words about connections that a check itself has cut. */
  forgiveNetwork() {
    this.#complaints = this.#complaints.filter((text) => !text.includes("ERR_CONNECTION_REFUSED"));
  }

  async shot(name) {
    this.#shots += 1;
    const file = `${String(this.#shots).padStart(2, "0")}-${name.replaceAll(/[^a-z0-9]+/gi, "-").toLowerCase()}.png`;
    await this.#page.screenshot({ path: join(this.opts.out, file) });
  }

  finish() {
    const list = (title, items) => {
      if (items.length === 0) return console.log(`ok    ${title}`);
      this.failed = true;
      console.log(`FAIL  ${title}; found ${items.length}:\n      ${[...new Set(items)].slice(0, 10).join("\n      ")}`);
    };
    list("no request left the origin", this.#foreign);
    list("no error in the browser's console", this.#complaints);
    console.log(this.failed ? "e2e failed" : "e2e passed", `- screenshots in ${this.opts.out}`);
  }
}
