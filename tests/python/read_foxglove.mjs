// Foxglove's own client on a server of ours: takes every channel for a while, decodes by the schemas that the server
// advertises, and prints what it got as JSON.
//
// node read_foxglove.mjs NODE_MODULES URL SECONDS SUB-PROTOCOL
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [modules, url, seconds, protocol] = process.argv.slice(2);
const require = createRequire(pathToFileURL(`${modules}/`));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const { createFileRegistry, fromBinary, toJson } = await import(pathToFileURL(`${modules}/@bufbuild/protobuf/dist/esm/index.js`));
const { FileDescriptorSetSchema } = await import(pathToFileURL(`${modules}/@bufbuild/protobuf/dist/esm/wkt/index.js`));

const found = { server: null, protocol: null, topics: {}, messages: [], times: [], statuses: [], errors: [] };
const readers = new Map();
const socket = new WebSocket(url, [protocol]);
const client = new FoxgloveClient({ ws: socket });
socket.on("open", () => (found.protocol = socket.protocol));
client.on("serverInfo", (info) => (found.server = info));
client.on("status", (status) => found.statuses.push(status));
client.on("error", (error) => found.errors.push(String(error)));
client.on("time", ({ timestamp }) => found.times.push(String(timestamp)));
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const files = createFileRegistry(fromBinary(FileDescriptorSetSchema, Buffer.from(channel.schema, "base64")));
    const schema = files.getMessage(channel.schemaName);
    found.topics[channel.topic] = channel.schemaName;
    readers.set(client.subscribe(channel.id), { topic: channel.topic, schema, files });
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, schema, files } = readers.get(subscriptionId);
  const message = toJson(schema, fromBinary(schema, new Uint8Array(data.buffer, data.byteOffset, data.byteLength)), { registry: files });
  found.messages.push({ topic, time: String(timestamp), message });
});
setTimeout(() => {
  client.close();
  console.log(JSON.stringify(found));
}, 1000 * Number(seconds));
