// Decodes every message of an MCAP file and prints what it found as JSON.
// Usage: read_bag.mjs indexed|streaming FILE
// The one wants the index of a file that was finished; the other reads from the beginning, as far as it goes.

import { open, readFile } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const decompressHandlers = {
  zstd: (data, size) => decompress(data, new Uint8Array(Number(size))),
};

async function* indexedMessages(path, schemas, channels) {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const data = new Uint8Array(Number(length));
      await file.read(data, 0, data.length, Number(offset));
      return data;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for (const [id, schema] of reader.schemasById) schemas.set(id, schema);
  for (const [id, channel] of reader.channelsById) channels.set(id, channel);
  yield* reader.readMessages();
  await file.close();
}

async function* streamedMessages(path, schemas, channels) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(await readFile(path));
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    else if (record.type === "Channel") channels.set(record.id, record);
    else if (record.type === "Message") yield record;
  }
}

// All that a message holds, in the order of its definition.
function* leaves(value) {
  if (typeof value === "bigint") yield Number(value);
  else if (typeof value === "number") yield Number.isFinite(value) ? value : String(value);
  else if (typeof value !== "object") yield value;
  else for (const part of ArrayBuffer.isView(value) ? value : Object.values(value)) yield* leaves(part);
}

const [mode, path] = process.argv.slice(2);
const schemas = new Map();
const channels = new Map();
const decoders = new Map();
const topics = {};
const messages = mode === "indexed" ? indexedMessages : streamedMessages;
for await (const message of messages(path, schemas, channels)) {
  const channel = channels.get(message.channelId);
  const schema = schemas.get(channel.schemaId);
  if (!decoders.has(schema.id)) {
    if (schema.encoding !== "ros2msg") throw new Error(`${schema.name}: encoding ${schema.encoding}`);
    const definition = new TextDecoder().decode(schema.data);
    decoders.set(schema.id, new MessageReader(parse(definition, { ros2: true })));
  }
  const decoded = decoders.get(schema.id).readMessage(message.data);
  const topic = (topics[channel.topic] ??= { type: schema.name, logTimes: [], messages: [] });
  topic.logTimes.push(String(message.logTime));
  topic.messages.push([...leaves(decoded)]);
}
process.stdout.write(JSON.stringify(topics));
