// read_recording_test.mjs HIL CROSSING: runs scenarios and reads their recordings with @mcap/core, which
// verifies every CRC and reads by the indexes. Exits with 1 at the first claim that does not hold.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const [hil, crossing] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "hil-recording-"));
const decompressHandlers = { zstd: (buffer, size) => decompress(buffer, new Uint8Array(Number(size))) };
const ms = 1_000_000n;

function run(scenario, out, ...options) {
  const ended = spawnSync(hil, ["run", scenario, "--out", join(folder, out), ...options], { encoding: "utf8" });
  assert.ok(ended.status === 0 || ended.status === 1, ended.stdout + ended.stderr);
  return join(folder, out);
}

class Memory {
  constructor(bytes) {
    this.bytes = bytes;
  }
  async size() {
    return BigInt(this.bytes.length);
  }
  async read(offset, size) {
    return this.bytes.subarray(Number(offset), Number(offset + size));
  }
}

/** The messages by topic, as the indexed reader lists them, and all in their order. */
async function readIndexed(bytes) {
  const reader = await McapIndexedReader.Initialize({ readable: new Memory(bytes), decompressHandlers });
  const topics = new Map();
  const all = [];
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const { topic } = reader.channelsById.get(message.channelId);
    const one = { topic, time: message.logTime, value: JSON.parse(new TextDecoder().decode(message.data)) };
    if (!topics.has(topic)) topics.set(topic, []);
    topics.get(topic).push(one);
    all.push(one);
  }
  return { reader, topics, all };
}

function countStreamed(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  let messages = 0;
  for (let record; (record = reader.nextRecord()); ) messages += record.type === "Message" ? 1 : 0;
  assert.ok(reader.done(), "the streaming reader comes to the end of the file");
  return messages;
}

async function check(out) {
  const bytes = readFileSync(join(out, "recording.mcap"));
  const file = await readIndexed(bytes);
  const report = JSON.parse(readFileSync(join(out, "report.json"), "utf8"));
  assert.equal(report.recording.bytes, bytes.length);
  assert.equal(report.recording.messages, file.all.length);
  assert.equal(Number(file.reader.statistics.messageCount), file.all.length);
  assert.equal(report.recording.dropped, 0);
  assert.equal(countStreamed(bytes), file.all.length);
  for (let i = 1; i < file.all.length; ++i)
    assert.ok(file.all[i - 1].time <= file.all[i].time, "messages come sorted by time");
  for (const channel of file.reader.channelsById.values()) {
    assert.equal(channel.messageEncoding, "json");
    const schema = file.reader.schemasById.get(channel.schemaId);
    assert.equal(schema.encoding, "jsonschema");
    assert.equal(JSON.parse(new TextDecoder().decode(schema.data)).type, "object");
  }
  assert.deepEqual(
    (file.topics.get("/events") ?? []).map((event) => [Number(event.time), event.value.text]),
    report.events.map((event) => [Math.max(event.time_ns, 0), event.text]),
  );
  return { ...file, report };
}

async function checkTank() {
  const scenario = join(folder, "tank.yaml");
  writeFileSync(
    scenario,
    `scenario: tank
clock: virtual
duration: 2 s
recording: true
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters:
      inputs: {inflow: {unit: l/s, initial: 0}}
      states: {level: {initial: 1 m, derivative: (inflow - 1 l/s) / 0.04 m2, min: 0, max: 3 m}}
  - module: plc
    type: block
    rate: 100 Hz
    offset: 3 ms
    inputs: {level: tank.level}
    parameters:
      inputs: {level: mm}
      outputs: {trip: level > 1300 mm}
variables: {half: tank.level / 2}
stimuli:
  - {name: filling, drives: tank.inflow, at: 0.5 s, sequence: [{hold: 9 l/s}]}
faults:
  - {name: lost, signal: tank.level, dropout: 100 %, at: 1 s, for: 100 ms}
expectations:
  - {name: trips, eventually: plc.trip == 1}
`,
  );
  const { topics, reader } = await check(run(scenario, "tank"));
  const level = topics.get("/tank");
  assert.equal(level.length, 2000);
  level.forEach((message, i) => assert.equal(message.time, BigInt(i) * ms));
  // 1 m, minus 1 l/s from 0.04 m2 for half a second: 12.5 mm.
  assert.ok(Math.abs(level[500].value.level - 0.9875) < 1e-9, JSON.stringify(level[500].value));
  const trip = topics.get("/plc");
  assert.equal(trip.length, 200, "a topic has the rate of its task");
  trip.forEach((message, i) => assert.equal(message.time, BigInt(10 * i + 3) * ms));
  const faulted = topics.get("/faults").map((message) => message.value);
  assert.equal(faulted.filter((value) => value["tank.level.faulted"] === null).length, 100);
  assert.equal(faulted.filter((value) => value["fault.lost"] === 1).length, 100);
  assert.equal(topics.get("/variables").length, 2000);
  assert.equal(topics.get("/stimuli")[499].value["tank.inflow"], 0);
  assert.equal(topics.get("/stimuli")[500].value["tank.inflow"], 9);
  const schemas = [...reader.schemasById.values()];
  const schema = JSON.parse(new TextDecoder().decode(schemas.find((one) => one.name === "hil.tank").data));
  assert.equal(schema.properties.level.description, "m");
  const metadata = [];
  for await (const one of reader.readMetadata()) metadata.push(one);
  assert.deepEqual(metadata.map((one) => one.name), ["run", "recording"]);
  assert.equal(metadata[0].metadata.get("scenario"), "tank");
  assert.equal(metadata[0].metadata.get("clock"), "virtual");
  assert.equal(metadata[1].metadata.get("dropped"), "0");
}

/** The frames of a CAN bus are those of its log. */
async function checkCrossing() {
  const out = run(crossing, "crossing", "--set", "clock=virtual", "--set", "duration=1 s", "--set", "recording=true");
  const { topics } = await check(out);
  const logged = readFileSync(join(out, "can-car.log"), "utf8").trim().split("\n");
  const frames = topics.get("/frames/can.car");
  assert.ok(frames.length > 50);
  const lines = frames.map(({ time, value }) => {
    const id = value.id.toString(16).toUpperCase().padStart(value.extended ? 8 : 3, "0");
    const us = String((time / 1000n) % 1_000_000n).padStart(6, "0");
    const seconds = String(time / 1_000_000_000n).padStart(10, "0");
    return [`(${seconds}.${us})`, `${id}#${value.data.toUpperCase()}`];
  });
  assert.deepEqual(
    lines,
    logged.map((line) => line.split(" ")).map(([time, , frame]) => [time, frame]),
  );
  assert.ok(topics.get("/can.car.BrakeCommand").length > 0);
}

try {
  await checkTank();
  await checkCrossing();
  rmSync(folder, { recursive: true });
} catch (error) {
  console.error(error, "\nthe files are in", folder);
  process.exit(1);
}
