// The language of scenario files and register map files. The sentences become the documentation
// (schema_markdown.hpp).

#include <limits>
#include <utility>

#include "runtime/config/scenario.hpp"
#include "runtime/config/world_limits.hpp"

namespace hil::config {
namespace {

constexpr double any_low = -std::numeric_limits<double>::infinity();
constexpr double any_high = std::numeric_limits<double>::infinity();
constexpr double longest_s = 7.0 * 24.0 * 3600.0;
constexpr double shortest_s = 1e-9;

Schema size() {
  return Schema::quantity(Quantity::length_m, 1e-6, farthest_m);
}
Schema duration(double minimum_s, double maximum_s = longest_s) {
  return Schema::quantity(Quantity::duration_s, minimum_s, maximum_s);
}
Schema rate() {
  return Schema::quantity(Quantity::frequency_hz, 1e-4, 1e5);
}
Schema angle() {
  return Schema::quantity(Quantity::angle_rad, -1000.0, 1000.0);
}
/// 99 is for threads of the kernel, which everything waits for.
constexpr int highest_priority = 98;

Schema thread_priority() {
  return Schema::integer(1, highest_priority);
}

/// `subject`: a sentence that says what is lost, and when.
Field may_be_lost(const std::string& subject) {
  return Field::with_default(
      "may_be_lost", Schema::boolean(), "false",
      "Whether it may be lost without making the run fail with exit code 4. " + subject);
}

Schema vector3(Quantity quantity, double largest) {
  return Schema::list(Schema::quantity(quantity, -largest, largest), 3, 3);
}

Schema realtime_schema() {
  return Schema::record({
      Field::with_default(
          "scheduler", Schema::one_of({"fifo", "other"}), "fifo",
          "The Linux scheduling class of the base thread; what the machine refuses is reported as degraded."),
      Field::with_default("priority", Schema::integer(2, highest_priority), "60",
                          "The priority under fifo. The database's thread has the same, the GPU driver's "
                          "threads lie two below, and the tasks' threads from one below on, never below 1."),
      Field::with_default("lock_memory", Schema::boolean(), "true", "Keep all memory of the program in RAM."),
      Field::with_default("cpus", Schema::list(Schema::integer(0, 1023), 0, 1024), "[]",
                          "The processors the base thread may run on; none listed: any."),
      Field::with_default(
          "max_lost", Schema::quantity(Quantity::share, 0.0, 1.0), "5 %",
          "The largest share of the base ticks that may be given up, of each task's releases that may be "
          "skipped, aborted or left without an answer from the world, and of each CAN bus's outputs that "
          "may stay unsent; above it the run's timing is broken (exit code 3)."),
      Field::optional("watchdog", duration(1e-3),
                      "A base thread that makes no tick for so long ends the run, outputs in their safe "
                      "state; left out: the longer of 100 ms and 50 base periods."),
  });
}

Schema shape_schema() {
  return Schema::exactly_one({
      Field::optional("box", Schema::list(size(), 3, 3), "The full sizes along x, y and z."),
      Field::optional("cylinder",
                      Schema::record({Field::needed("radius", size(), "The radius."),
                                      Field::needed("height", size(), "The full height, along z.")}),
                      "An upright cylinder."),
      Field::optional("sphere", Schema::record_or("radius", {Field::needed("radius", size(), "The radius.")}),
                      "A sphere."),
      Field::optional("rectangle", Schema::list(size(), 2, 2),
                      "The full sizes along x and y of a flat sheet in z = 0."),
      Field::optional(
          "file",
          Schema::record_or("path",
                            {Field::needed("path", Schema::file(), "A mesh: obj, stl, ply, gltf or glb."),
                             Field::with_default("scale", Schema::number(smallest_scale, largest_scale), "1",
                                                 "Metres per unit of the file (millimetres: 0.001).")}),
          "A mesh from a file."),
  });
}

Schema rotation_schema() {
  return Schema::record({
      Field::optional("yaw", angle(), "The turn about z, done last."),
      Field::optional("pitch", angle(), "The turn about y, done second."),
      Field::optional("roll", angle(), "The turn about x, done first."),
      Field::optional("quaternion", Schema::list(Schema::number(-1.0, 1.0), 4, 4),
                      "The rotation as a unit quaternion [w, x, y, z], in place of the three angles."),
  });
}

Schema entity_schema() {
  return Schema::record({
      Field::needed("name", Schema::name(), "The entity's name, unique in the world."),
      Field::needed("shape", shape_schema(), "What it looks like."),
      Field::with_default("position", vector3(Quantity::length_m, farthest_m), "[0 m, 0 m, 0 m]",
                          "Where the shape's origin is, in the world."),
      Field::with_default("rotation", rotation_schema(), "{}", "How it is turned; left out: not at all."),
      Field::with_default("velocity", vector3(Quantity::speed_mps, fastest_mps), "[0 m/s, 0 m/s, 0 m/s]",
                          "Its velocity in the world, kept for the whole run."),
      Field::with_default("angular_velocity", vector3(Quantity::angular_rate_radps, fastest_turn_radps),
                          "[0 deg/s, 0 deg/s, 0 deg/s]",
                          "Its turning about the world's axes, kept for the whole run."),
      Field::with_default("scale", Schema::number(smallest_scale, largest_scale), "1",
                          "A factor on the shape's size."),
      Field::with_default("mask", Schema::list(Schema::name(), 1, Layers::capacity), "[static]",
                          "The layers the entity belongs to; a query names the layers it sees."),
  });
}

Schema world_schema() {
  return Schema::record({
      Field::with_default("gpu", Schema::text(), "auto",
                          "The Vulkan device: a part of its name, its index, or auto."),
      Field::with_default("max_entities", Schema::integer(1, 1 << 20), "4096",
                          "Room for so many entities at once."),
      Field::with_default("max_geometries", Schema::integer(1, 1 << 16), "1024",
                          "Room for so many different shapes; equal ones share one."),
      Field::with_default("retained_changes", Schema::integer(1, 1 << 26), "65536",
                          "So many written rows are kept for readers of older versions."),
      Field::with_default("queue_capacity", Schema::integer(1, 1 << 16), "256",
                          "So many transactions may wait at once."),
      Field::with_default(
          "chunk", duration(0.0, 1.0), "1 ms",
          "Large batches of queries are divided into parts of about this length, and an urgent "
          "transaction waits for two of them; 0 ms: they are not divided. Time can be kept free "
          "for hard transactions only when it is shorter than their deadlines."),
      Field::with_default(
          "durability", Schema::one_of({"volatile", "async", "group", "sync"}), "async",
          "How surely the world's history is on disk, in the run's folder: not at all; soon, and "
          "the run waits for nothing; before an outcome is given; before others can read it."),
      Field::with_default("flush_interval", duration(0.0, 60.0), "10 ms",
                          "Under async, commits wait so long for others to be written with them."),
      Field::with_default("log_ring_bytes", Schema::integer(min_log_ring_bytes, max_log_ring_bytes),
                          "16777216",
                          "Memory that commits wait in for the disk. When it is full, async goes on without "
                          "recording, which the report tells, and the others refuse to write."),
      Field::with_default("layers", Schema::list(Schema::name(), 0, Layers::capacity), "[]",
                          "The names of the layers; when any are listed, a body can be in no other. When "
                          "none are, the layers "
                          "are those that bodies are in."),
      Field::with_default("entities", Schema::list(entity_schema()), "[]",
                          "What is there from the first tick on."),
  });
}

Schema task_schema() {
  return Schema::record({
      Field::needed("module", Schema::name(), "The name of this instance; its signals begin with it."),
      Field::needed("type", Schema::name(), "The kind of module."),
      Field::needed("rate", rate(), "How often it runs; has to divide the base rate."),
      Field::with_default(
          "offset", duration(0.0), "0 ms",
          "By how much its runs are shifted; a multiple of the base period, less than the task's period."),
      Field::optional("deadline", duration(shortest_s),
                      "By when, from its release on, a run has to be done; left out: one period of the task. "
                      "On a thread of "
                      "its own a multiple of the base period: its results appear then."),
      Field::optional("budget", duration(shortest_s),
                      "The processor time one run may take; left out: no limit."),
      Field::with_default("overrun", Schema::one_of({"skip", "queue", "abort"}), "skip",
                          "What happens to a release that comes while the task still runs."),
      Field::with_default("warmup", Schema::integer(0, 1'000'000), "0",
                          "So many first runs are counted apart."),
      Field::optional("thread", Schema::name(), "A thread of its own, by name; left out: the base thread."),
      Field::with_default("parameters", Schema::any(), "{}", "What the kind of module asks for."),
      Field::with_default("inputs", Schema::map(Schema::signal()), "{}",
                          "The signal that feeds each input port."),
  });
}

Schema sent_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("period", duration(shortest_s),
                          "How often it is sent, a multiple of the bus's period; left out: GenMsgCycleTime "
                          "of the DBC file, and "
                          "where that is not given one period of the bus."),
          Field::with_default(
              "offset", duration(0.0), "0 ms",
              "By how much its sending is shifted; a multiple of the bus's period, less than the message's."),
          Field::optional("counter", Schema::name(), "Its signal that counts the frames."),
          Field::optional("checksum", Schema::name(),
                          "Its signal that carries the checksum (CRC-8 SAE J1850)."),
          Field::with_default(
              "signals", Schema::map(Schema::text()), "{}",
              "What each of its signals carries: a signal of the run, a number, or a value name of "
              "the DBC file; others: their start value (GenSigStartValue), and where there is none "
              "their safe value."),
          Field::with_default(
              "safe", Schema::map(Schema::text()), "{}",
              "What its signals carry in the safe state, a number or a value name; others: zero."),
      });
}

Schema received_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("timeout", duration(0.0),
                          "After so long without a frame its signals read their safe values, a multiplexed "
                          "one after so long "
                          "without a value of its own; 0 ms: never; left out: three cycle times "
                          "(GenMsgCycleTime) of the DBC "
                          "file, and where that is not given never."),
          Field::optional("counter", Schema::name(), "Its signal that counts the frames; gaps are counted."),
          Field::optional("checksum", Schema::name(),
                          "Its signal that carries the checksum, which is verified."),
          Field::with_default("safe", Schema::map(Schema::text()), "{}",
                              "What its signals read before the first frame and after the last, a number or "
                              "a value name; others: "
                              "zero."),
      });
}

Schema can_schema() {
  return Schema::record({
      Field::needed("bus", Schema::name(), "The bus's name; its signals begin with can.NAME."),
      Field::with_default("device", Schema::text(), "virtual",
                          "virtual, or socketcan:INTERFACE for an interface of the kernel."),
      Field::needed("database", Schema::file(), "The DBC file."),
      Field::needed("rate", rate(), "How often frames are taken in and sent; has to divide the base rate."),
      Field::with_default("bit_rate", Schema::integer(1'000, 20'000'000), "500000",
                          "Bits per second, for the bus load."),
      Field::optional("priority", thread_priority(),
                      "The real-time priority of its thread; left out: an ordinary thread."),
      Field::with_default("send", Schema::list(sent_schema()), "[]", "The messages the run sends."),
      Field::with_default("receive", Schema::list(received_schema()), "[]", "The messages the run reads."),
      Field::optional("faults",
                      Schema::record({
                          Field::with_default("drop", Schema::number(0.0, 1.0), "0",
                                              "The probability that a frame is lost."),
                          Field::with_default("corrupt", Schema::number(0.0, 1.0), "0",
                                              "The probability that a bit of a frame flips."),
                          Field::with_default("delay", duration(0.0, 60.0), "0 ms",
                                              "By how much frames are delayed; under clock: virtual up to "
                                              "the bus's next exchange after it, so by whole "
                                              "periods of its rate."),
                      }),
                      "What a virtual bus does to frames."),
      may_be_lost("The bus: its interface goes down or away, or its controller goes bus-off."),
  });
}

Schema modbus_schema() {
  return Schema::record({
      Field::needed("unit", Schema::name(), "The unit's name; its signals begin with modbus.NAME."),
      Field::with_default("role", Schema::one_of({"client", "server"}), "client",
                          "client: hil asks the unit; server: hil is the unit."),
      Field::needed("device", Schema::text(), "HOST:PORT; the port auto takes a free one."),
      Field::needed("registers", Schema::file(), "The register map."),
      Field::needed("rate", rate(), "How often registers are written and read; has to divide the base rate."),
      Field::with_default("timeout", duration(1e-3, 3600.0), "500 ms", "How long a reply may take."),
      Field::optional("max_age", duration(1e-3),
                      "How old a value read may grow; left out: 1 s as a client, any age as a server."),
      Field::with_default("start_limit", duration(1e-3, 3600.0), "2 s",
                          "How long the run tries to reach the unit at its start."),
      Field::with_default("unit_id", Schema::integer(0, 255), "1", "The unit identifier in each request."),
      Field::with_default(
          "max_gap", Schema::integer(0, 1998), "0",
          "As a client: the largest number of addresses of no register that one request may read along "
          "between two registers. A request that the unit refuses with exception 2 is split at its gaps."),
      Field::with_default("max_clients", Schema::integer(1, 1000), "64",
                          "As a server: the number of clients that are served at once. One more takes the "
                          "place of the client that was idle for the longest time, at least 1 s, or is "
                          "refused."),
      Field::optional("run_time", Schema::name(),
                      "A register that the run's time in milliseconds is written to."),
      Field::optional("heartbeat", Schema::name(), "A register that is counted up in each cycle."),
      may_be_lost("The unit: it does not answer for longer than max_age; as a server: no client is connected "
                  "for longer than max_age."),
      Field::optional("priority", thread_priority(),
                      "The real-time priority of its thread; left out: an ordinary thread."),
      Field::with_default(
          "write", Schema::map(Schema::text()), "{}",
          "What each register is written from: a signal of the run, or a number. As a client, "
          "hil writes no other register."),
      Field::with_default("read", Schema::list(Schema::name()), "[]",
                          "As a client: the registers that are read and become signals; none listed: all of "
                          "the map that are not written. As a server: all that clients write are signals."),
  });
}

Schema process_schema() {
  return Schema::record({
      Field::with_default("enabled", Schema::boolean(), "true", "false: the run does not start it."),
      Field::needed(
          "command", Schema::list(Schema::text(), 1, 1000),
          "The program and its words; {can.BUS} and {modbus.UNIT} stand for the addresses of this run."),
      Field::with_default(
          "safe_on_exit", Schema::boolean(), "true",
          "Outputs go to their safe values, and the run ends, when it ends before the run does."),
      may_be_lost("The process: with safe_on_exit: false, it ends before the run does."),
      Field::with_default(
          "free_running", Schema::boolean(), "false",
          "Under clock: virtual, true permits a process that can not keep step with the run: its "
          "command has none of {clock}, {can.BUS} and {modbus.UNIT} of a unit with run_time."),
      Field::with_default(
          "start_timeout", duration(1e-3, 3600.0), "5 s",
          "How long it may take, by the wall clock, until it has connected to the virtual buses of "
          "its command."),
  });
}

Schema expectation_schema() {
  const Schema response = Schema::record({
      Field::needed("request", Schema::signal(),
                    "Each change of this signal asks for an answer; of one on a CAN bus, each frame."),
      Field::needed("reply", Schema::signal(),
                    "The signal that answers, by taking the value that the request had."),
      Field::needed("within", duration(shortest_s), "The time the answer may take."),
      Field::with_default(
          "at_least", Schema::integer(1, 1'000'000'000), "1",
          "The least number of requests that have to be judged; with fewer the expectation is not "
          "checked."),
  });
  return Schema::exactly_one(
      {
          Field::optional("never", Schema::text(), "A condition that holds in no tick."),
          Field::optional("always", Schema::text(), "A condition that holds in every tick."),
          Field::optional("eventually", Schema::text(), "A condition that holds in some tick."),
          Field::optional("response", response, "One signal answers another in time."),
      },
      {
          Field::needed("name", Schema::text(), "What the report calls it."),
          Field::optional("by", duration(0.0),
                          "With eventually: the run time by which the condition has to have held."),
          Field::with_default(
              "coverage", Schema::quantity(Quantity::share, 0.0, 1.0), "95 %",
              "The least share of the ticks it covers on which it has to be evaluated, and on one of them "
              "at least; below it the expectation is not checked, and the run does not pass."),
      });
}

}  // namespace

Schema scenario_schema() {
  return Schema::record({
      Field::needed("scenario", Schema::text(), "The scenario's name."),
      Field::optional("about", Schema::text(), "What it is about."),
      Field::with_default("base_rate", Schema::quantity(Quantity::frequency_hz, 1.0, 20e3), "1 kHz",
                          "The rate of the base tick; its period has to be a whole number of nanoseconds."),
      Field::with_default("duration", duration(1e-6), "10 s",
                          "How long a run takes; a multiple of the base period."),
      Field::with_default(
          "clock", Schema::one_of({"realtime", "virtual"}), "realtime",
          "realtime keeps to the clock on the wall; virtual goes as fast as it can, with the same results."),
      Field::with_default("seed", Schema::integer(0, std::numeric_limits<std::int64_t>::max()), "1",
                          "The seed of everything random in the run."),
      Field::with_default("realtime", realtime_schema(), "{}", "How the base thread is scheduled."),
      Field::with_default("world", world_schema(), "{}", "The shared world."),
      Field::with_default("tasks", Schema::list(task_schema()), "[]",
                          "The modules, in the order in which they run."),
      Field::with_default("can", Schema::list(can_schema()), "[]", "The CAN buses."),
      Field::with_default("modbus", Schema::list(modbus_schema()), "[]", "The Modbus units."),
      Field::optional("dut", process_schema(),
                      "The device under test, as a process of its own; left out: a real one is attached."),
      Field::with_default("processes", Schema::map(process_schema()), "{}",
                          "Other programs that the run starts and watches."),
      Field::with_default("expectations", Schema::list(expectation_schema()), "[]",
                          "What has to hold for the run to pass."),
  });
}

Schema register_map_schema() {
  const Schema entry = Schema::record({
      Field::needed("name", Schema::name(), "The register's name."),
      Field::needed("table", Schema::one_of({"coil", "discrete_input", "holding", "input"}),
                    "Where it lies."),
      Field::needed("address", Schema::integer(0, 65535), "As in the protocol, from 0 (40001 is holding 0)."),
      Field::needed("type", Schema::one_of({"bool", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"}),
                    "What it holds; the wider ones take two or four registers."),
      Field::with_default("word_order", Schema::one_of({"ABCD", "CDAB", "BADC", "DCBA"}), "ABCD",
                          "How the bytes of a value lie; A is the most significant."),
      Field::with_default("scale", Schema::number(any_low, any_high), "1", "value = raw * scale + offset."),
      Field::with_default("offset", Schema::number(any_low, any_high), "0", "value = raw * scale + offset."),
      Field::optional("unit", Schema::text(), "The unit of the value."),
      Field::optional("minimum", Schema::number(any_low, any_high), "The least value."),
      Field::optional("maximum", Schema::number(any_low, any_high), "The greatest value."),
      Field::with_default("safe", Schema::number(any_low, any_high), "0", "The value in the safe state."),
      Field::needed("access", Schema::one_of({"read", "write"}), "What hil does with it."),
      Field::optional("about", Schema::text(), "What it means."),
  });
  return Schema::record({Field::needed("registers", Schema::list(entry, 1, 65536), "The registers.")});
}

}  // namespace hil::config
