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
constexpr double max_duration_s = 7.0 * 24.0 * 3600.0;
constexpr double min_duration_s = 1e-9;

Schema size() {
  return Schema::quantity(Quantity::length_m, 1e-6, max_coordinate_m);
}
Schema duration(double minimum_s, double maximum_s = max_duration_s) {
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
      "Whether the run may pass although it is lost (otherwise exit code 4). " + subject);
}

Schema vector3(Quantity quantity, double largest) {
  return Schema::list(Schema::quantity(quantity, -largest, largest), 3, 3);
}

Schema realtime_schema() {
  return Schema::record({
      Field::with_default(
          "scheduler", Schema::one_of({"fifo", "other"}), "fifo",
          "The Linux scheduling class of the base thread. What the machine refuses is reported as degraded."),
      Field::with_default("priority", Schema::integer(2, highest_priority), "60",
                          "The priority of the base thread under fifo. The database's engine thread has the "
                          "same priority, the GPU "
                          "driver's threads two less, task threads one less and lower, never below 1."),
      Field::with_default("lock_memory", Schema::boolean(), "true",
                          "Whether all memory of the program stays in RAM."),
      Field::with_default("cpus", Schema::list(Schema::integer(0, 1023), 0, 1024), "[]",
                          "The processors that the base thread and the task threads may run on. Empty: all."),
      Field::with_default("max_lost", Schema::quantity(Quantity::share, 0.0, 1.0), "5 %",
                          "The largest permitted share of given-up ticks, of each task's releases that were "
                          "skipped, aborted or left without a result of the database, and of each CAN bus's "
                          "outputs that were not sent. Above it the run's timing is broken (exit code 3)."),
      Field::optional("watchdog", duration(1e-3),
                      "The run ends, with outputs in their safe state, when the base thread completes no "
                      "tick for this time. Left out: the longer of 100 ms and 50 base periods."),
  });
}

Schema shape_schema() {
  return Schema::exactly_one({
      Field::optional("box", Schema::list(size(), 3, 3), "The full sizes along x, y and z."),
      Field::optional("cylinder",
                      Schema::record({Field::needed("radius", size(), "The radius."),
                                      Field::needed("height", size(), "The full height, along z.")}),
                      "A cylinder along z."),
      Field::optional("sphere", Schema::record_or("radius", {Field::needed("radius", size(), "The radius.")}),
                      "A sphere."),
      Field::optional("rectangle", Schema::list(size(), 2, 2),
                      "The full sizes along x and y of a flat rectangle at z = 0."),
      Field::optional(
          "file",
          Schema::record_or(
              "path",
              {Field::needed("path", Schema::file(), "The path of the mesh: obj, stl, ply, gltf or glb."),
               Field::with_default("scale", Schema::number(min_scale, max_scale), "1",
                                   "Metres per unit of the file. For millimetres: 0.001.")}),
          "A mesh from a file."),
  });
}

Schema rotation_schema() {
  return Schema::record({
      Field::optional("yaw", angle(), "The rotation about z, applied last."),
      Field::optional("pitch", angle(), "The rotation about y, applied second."),
      Field::optional("roll", angle(), "The rotation about x, applied first."),
      Field::optional("quaternion", Schema::list(Schema::number(-1.0, 1.0), 4, 4),
                      "The rotation as a unit quaternion [w, x, y, z], in place of the three angles."),
  });
}

Schema entity_schema() {
  return Schema::record({
      Field::needed("name", Schema::name(), "The entity's name, unique in the world."),
      Field::needed("shape", shape_schema(), "The form and size of the entity."),
      Field::with_default("position", vector3(Quantity::length_m, max_coordinate_m), "[0 m, 0 m, 0 m]",
                          "The position of the shape's origin in the world."),
      Field::with_default("rotation", rotation_schema(), "{}", "The rotation of the entity. Left out: none."),
      Field::with_default("velocity", vector3(Quantity::speed_mps, max_speed_mps), "[0 m/s, 0 m/s, 0 m/s]",
                          "The constant velocity in the world frame."),
      Field::with_default("angular_velocity", vector3(Quantity::angular_rate_radps, max_angular_rate_radps),
                          "[0 deg/s, 0 deg/s, 0 deg/s]",
                          "The constant angular velocity about the axes of the world frame."),
      Field::with_default("scale", Schema::number(min_scale, max_scale), "1",
                          "A factor on the shape's size."),
      Field::with_default("mask", Schema::list(Schema::name(), 1, Layers::capacity), "[static]",
                          "The layers of the entity. A query names the layers that it sees."),
  });
}

Schema world_schema() {
  return Schema::record({
      Field::with_default("gpu", Schema::text(), "auto",
                          "The Vulkan device: a part of its name, its index in hil doctor, or auto."),
      Field::with_default("max_entities", Schema::integer(1, 1 << 20), "4096",
                          "The largest number of entities at one time."),
      Field::with_default("max_geometries", Schema::integer(1, 1 << 16), "1024",
                          "The largest number of geometries. Equal shapes share one."),
      Field::with_default("retained_changes", Schema::integer(1, 1 << 26), "65536",
                          "The number of written rows that are kept for readers of older versions."),
      Field::with_default("queue_capacity", Schema::integer(1, 1 << 16), "256",
                          "The largest number of waiting transactions."),
      Field::with_default("chunk", duration(0.0, 1.0), "1 ms",
                          "About how long a transaction of higher priority waits for a large batch of "
                          "queries, which is split into chunks. 0 ms: batches are not split. Device time can "
                          "be reserved only for deadlines that are longer than this."),
      Field::with_default("durability", Schema::one_of({"volatile", "async", "group", "sync"}), "async",
                          "When a commit is on disk, in the run's folder. volatile: never; async: soon, and "
                          "the run does not wait; group: before its outcome; sync: before it can be read."),
      Field::with_default("flush_interval", duration(0.0, 60.0), "10 ms",
                          "Under async: how long a commit waits for others that are written with it."),
      Field::with_default(
          "log_ring_bytes", Schema::integer(min_log_ring_bytes, max_log_ring_bytes), "16777216",
          "The size of the memory in which commits wait for the disk. When it is full, async continues "
          "without recording, which the report lists, and group and sync refuse writes."),
      Field::with_default("layers", Schema::list(Schema::name(), 0, Layers::capacity), "[]",
                          "The names of all layers. Empty: the layers that entities and modules name."),
      Field::with_default("entities", Schema::list(entity_schema()), "[]",
                          "The entities that exist from the first tick on."),
  });
}

Schema task_schema() {
  return Schema::record({
      Field::needed("module", Schema::name(), "The name of this instance. Its signals begin with it."),
      Field::needed("type", Schema::name(), "The module type."),
      Field::needed("rate", rate(), "The rate of the task. It divides the base rate."),
      Field::with_default(
          "offset", duration(0.0), "0 ms",
          "The shift of the releases: a multiple of the base period, less than the task's period."),
      Field::optional(
          "deadline", duration(min_duration_s),
          "The time from a release by which the run has to end. Left out: one period of the task. With a "
          "thread of its own: a multiple of the base period, at which the outputs become visible."),
      Field::optional("budget", duration(min_duration_s),
                      "The CPU time that one run may use. Left out: no limit."),
      Field::with_default("overrun", Schema::one_of({"skip", "queue", "abort"}), "skip",
                          "What happens at a release while the task still runs."),
      Field::with_default("warmup", Schema::integer(0, 1'000'000), "0",
                          "The number of first runs that are counted apart."),
      Field::optional("thread", Schema::name(),
                      "The name of the thread that runs the task; tasks with the same name share it. Left "
                      "out: the base thread."),
      Field::with_default("parameters", Schema::any(), "{}", "The parameters of the module type."),
      Field::with_default("inputs", Schema::map(Schema::signal()), "{}",
                          "The signal that feeds each input port."),
  });
}

Schema sent_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("period", duration(min_duration_s),
                          "The period of sending, a multiple of the bus's period. Left out: GenMsgCycleTime "
                          "of the DBC file, else one period of the bus."),
          Field::with_default(
              "offset", duration(0.0), "0 ms",
              "The shift of sending: a multiple of the bus's period, less than the message's period."),
          Field::optional("counter", Schema::name(), "The signal that counts the frames."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum (CRC-8 SAE J1850)."),
          Field::with_default(
              "signals", Schema::map(Schema::text()), "{}",
              "The source of each signal: a signal of the run, a number, or a value name of the DBC file. "
              "Other signals have their start value (GenSigStartValue), else their safe value."),
          Field::with_default("safe", Schema::map(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

Schema received_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("timeout", duration(0.0),
                          "The age beyond which the signals are not fresh and have their safe values; a "
                          "multiplexed signal by its own last value. 0 ms: no limit. Left out: three times "
                          "GenMsgCycleTime of the DBC file, else no limit."),
          Field::optional("counter", Schema::name(), "The signal that counts the frames. Gaps are counted."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum. It is verified."),
          Field::with_default("safe", Schema::map(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

Schema can_schema() {
  return Schema::record({
      Field::needed("bus", Schema::name(), "The bus's name. Its signals begin with can.NAME."),
      Field::with_default("device", Schema::text(), "virtual",
                          "virtual, or socketcan:INTERFACE for an interface of the kernel."),
      Field::needed("database", Schema::file(), "The DBC file."),
      Field::needed("rate", rate(), "The rate at which frames are read and sent. It divides the base rate."),
      Field::with_default("bit_rate", Schema::integer(1'000, 20'000'000), "500000",
                          "The bit rate in bits per second, for the bus load."),
      Field::optional("priority", thread_priority(),
                      "The real-time priority of the device's thread. Left out: an ordinary thread."),
      Field::with_default("send", Schema::list(sent_schema()), "[]", "The messages the run sends."),
      Field::with_default("receive", Schema::list(received_schema()), "[]", "The messages the run reads."),
      Field::optional("faults",
                      Schema::record({
                          Field::with_default("drop", Schema::number(0.0, 1.0), "0",
                                              "The probability that a frame is lost."),
                          Field::with_default("corrupt", Schema::number(0.0, 1.0), "0",
                                              "The probability that a bit of a frame is inverted."),
                          Field::with_default("delay", duration(0.0, 60.0), "0 ms",
                                              "The delay of each frame. Under clock: virtual, rounded up to "
                                              "whole periods of the bus's rate."),
                      }),
                      "The faults that a virtual bus injects."),
      may_be_lost("The bus: its interface goes down or away, or its controller goes bus-off."),
  });
}

Schema modbus_schema() {
  return Schema::record({
      Field::needed("unit", Schema::name(), "The unit's name. Its signals begin with modbus.NAME."),
      Field::with_default("role", Schema::one_of({"client", "server"}), "client",
                          "client: hil sends requests to the unit. server: hil is the unit."),
      Field::needed("device", Schema::text(), "HOST:PORT. The port auto is a free one."),
      Field::needed("registers", Schema::file(), "The register map."),
      Field::needed("rate", rate(),
                    "The rate at which registers are written and read. It divides the base rate."),
      Field::with_default("timeout", duration(1e-3, 3600.0), "500 ms", "The longest time until a reply."),
      Field::optional("max_age", duration(1e-3),
                      "The age beyond which a value that is read is not fresh. Left out: 1 s as a client, no "
                      "limit as a server."),
      Field::with_default("start_limit", duration(1e-3, 3600.0), "2 s",
                          "The longest time in which the run tries to reach the unit at its start."),
      Field::with_default("unit_id", Schema::integer(0, 255), "1", "The unit identifier in each request."),
      Field::with_default(
          "max_gap", Schema::integer(0, 1998), "0",
          "As a client: the largest number of addresses without a register that one request may read between "
          "two registers. A request that the unit refuses with exception 2 is split at its gaps."),
      Field::with_default("max_clients", Schema::integer(1, 1000), "64",
                          "As a server: the number of clients that are served at once. One more replaces the "
                          "client that was idle for the longest time, at least 1 s, or is refused."),
      Field::optional("run_time", Schema::name(),
                      "The register to which the run time in milliseconds is written."),
      Field::optional("heartbeat", Schema::name(), "The register that is counted up in each cycle."),
      may_be_lost("The unit: it does not answer for longer than max_age; as a server: no client is connected "
                  "for longer than max_age."),
      Field::optional("priority", thread_priority(),
                      "The real-time priority of the device's thread. Left out: an ordinary thread."),
      Field::with_default("write", Schema::map(Schema::text()), "{}",
                          "The source of each register: a signal of the run, or a number. As a client, hil "
                          "writes no other register."),
      Field::with_default(
          "read", Schema::list(Schema::name()), "[]",
          "As a client: the registers that are read and become signals. Empty: all registers of the map that "
          "are not written. As a server, all registers that clients write become signals."),
  });
}

Schema process_schema() {
  return Schema::record({
      Field::with_default("enabled", Schema::boolean(), "true", "false: the run does not start it."),
      Field::needed("command", Schema::list(Schema::text(), 1, 1000),
                    "The program and its arguments. {can.BUS} and {modbus.UNIT} stand for the addresses of "
                    "this run, {clock} for wall or stepped."),
      Field::with_default("safe_on_exit", Schema::boolean(), "true",
                          "Whether outputs go to their safe values and the run ends when the process ends "
                          "before the run does."),
      may_be_lost("The process: with safe_on_exit: false, it ends before the run does."),
      Field::with_default(
          "free_running", Schema::boolean(), "false",
          "true permits, under clock: virtual, a process that can not keep step with the run: its command "
          "has none of {clock}, {can.BUS} and {modbus.UNIT} of a unit with run_time."),
      Field::with_default(
          "start_timeout", duration(1e-3, 3600.0), "5 s",
          "The longest wall-clock time until the process has connected to the virtual buses of its command."),
  });
}

Schema expectation_schema() {
  const Schema response = Schema::record({
      Field::needed(
          "request", Schema::signal(),
          "The signal whose changes are requests. Of a signal on a CAN bus, each frame is a request."),
      Field::needed("reply", Schema::signal(), "The signal that replies by taking the value of the request."),
      Field::needed("within", duration(min_duration_s), "The longest time from a request to its reply."),
      Field::with_default(
          "at_least", Schema::integer(1, 1'000'000'000), "1",
          "The least number of requests that have to be judged. With fewer, the expectation is not checked."),
  });
  return Schema::exactly_one(
      {
          Field::optional("never", Schema::text(), "A condition that is true on no tick."),
          Field::optional("always", Schema::text(), "A condition that is true on every tick."),
          Field::optional("eventually", Schema::text(), "A condition that is true on some tick."),
          Field::optional("response", response, "One signal replies to another in time."),
      },
      {
          Field::needed("name", Schema::text(), "The expectation's name in the report."),
          Field::optional("by", duration(0.0),
                          "With eventually: the run time by which the condition has to be true. Left out: "
                          "the end of the run."),
          Field::with_default(
              "coverage", Schema::quantity(Quantity::share, 0.0, 1.0), "95 %",
              "The least share of its ticks on which the expectation has to be evaluated, and at least one "
              "tick. Below it the expectation is not checked, and the run does not pass."),
      });
}

}  // namespace

Schema scenario_schema() {
  return Schema::record({
      Field::needed("scenario", Schema::text(), "The scenario's name."),
      Field::optional("about", Schema::text(), "A sentence about the scenario."),
      Field::with_default("base_rate", Schema::quantity(Quantity::frequency_hz, 1.0, 20e3), "1 kHz",
                          "The rate of the base tick. Its period is a whole number of nanoseconds."),
      Field::with_default("duration", duration(1e-6), "10 s",
                          "The run time at which the run ends, a multiple of the base period."),
      Field::with_default("clock", Schema::one_of({"realtime", "virtual"}), "realtime",
                          "realtime: ticks follow the wall clock. virtual: ticks follow one another as fast "
                          "as they complete; two runs with one seed have the same results."),
      Field::with_default("seed", Schema::integer(0, std::numeric_limits<std::int64_t>::max()), "1",
                          "The seed of all random numbers of the run."),
      Field::with_default("realtime", realtime_schema(), "{}", "The scheduling of the run's threads."),
      Field::with_default("world", world_schema(), "{}", "The shared world."),
      Field::with_default("tasks", Schema::list(task_schema()), "[]",
                          "The modules, in the order in which they run."),
      Field::with_default("can", Schema::list(can_schema()), "[]", "The CAN buses."),
      Field::with_default("modbus", Schema::list(modbus_schema()), "[]", "The Modbus units."),
      Field::optional("dut", process_schema(),
                      "The device under test, as a process of its own. Left out: a real one is attached."),
      Field::with_default("processes", Schema::map(process_schema()), "{}",
                          "Other programs that the run starts and watches."),
      Field::with_default("expectations", Schema::list(expectation_schema()), "[]",
                          "The claims that have to hold for the run to pass."),
  });
}

Schema register_map_schema() {
  const Schema entry = Schema::record({
      Field::needed("name", Schema::name(), "The register's name."),
      Field::needed("table", Schema::one_of({"coil", "discrete_input", "holding", "input"}),
                    "The kind of register."),
      Field::needed("address", Schema::integer(0, 65535),
                    "The address in the protocol, from 0 (40001 is holding 0)."),
      Field::needed("type", Schema::one_of({"bool", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"}),
                    "The type of the value. Wider types take two or four registers."),
      Field::with_default("word_order", Schema::one_of({"ABCD", "CDAB", "BADC", "DCBA"}), "ABCD",
                          "The order of the bytes of a value. A is the most significant."),
      Field::with_default("scale", Schema::number(any_low, any_high), "1", "value = raw * scale + offset."),
      Field::with_default("offset", Schema::number(any_low, any_high), "0", "value = raw * scale + offset."),
      Field::optional("unit", Schema::text(), "The unit of the value."),
      Field::optional("minimum", Schema::number(any_low, any_high), "The least value."),
      Field::optional("maximum", Schema::number(any_low, any_high), "The greatest value."),
      Field::with_default("safe", Schema::number(any_low, any_high), "0", "The value in the safe state."),
      Field::needed("access", Schema::one_of({"read", "write"}),
                    "write: hil writes the register. read: hil reads it."),
      Field::optional("about", Schema::text(), "A sentence about the register."),
  });
  return Schema::record({Field::needed("registers", Schema::list(entry, 1, 65536), "The registers.")});
}

}  // namespace hil::config
