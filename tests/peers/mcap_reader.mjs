// Prints what MCAP's JavaScript library reads from a file by its index, with all checksums validated.
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { decompress } from "fzstd";
import { open } from "node:fs/promises";

const file = await open(process.argv[2], "r");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: {
    zstd: (data, size) => decompress(new Uint8Array(data), new Uint8Array(Number(size))),
  },
});
const topics = {};
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const found = (topics[channel.topic] ??= {
    type: schema.name,
    encoding: `${schema.encoding} ${channel.messageEncoding}`,
    count: 0,
    bytes: 0,
    times: [],
  });
  found.count += 1;
  found.bytes += message.data.length;
  found.times.push(String(message.logTime));
}
const notes = {};
for await (const metadata of reader.readMetadata()) {
  notes[metadata.name] = Object.fromEntries(metadata.metadata);
}
console.log(JSON.stringify({ profile: reader.header.profile, topics, notes }));
await file.close();
