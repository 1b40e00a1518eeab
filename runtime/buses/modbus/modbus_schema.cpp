#include "runtime/buses/modbus/modbus_schema.hpp"

#include "runtime/config/shared_schemas.hpp"

namespace hil::buses::modbus {

using namespace config;

Schema modbus_schema() {
  return Schema::record({
      Field::needed("unit", Schema::name(), "The unit's name. Its signals begin with modbus.NAME."),
      Field::with_default("role", Schema::one_of({"client", "server"}), "client",
                          "client: hil sends requests to the unit. server: hil is the unit."),
      Field::needed("device", Schema::text(), "HOST:PORT. The port auto is a free one."),
      Field::needed("registers", Schema::file(), "The register map."),
      Field::needed("rate", rate_schema(),
                    "The rate at which registers are written and read. It divides the base rate."),
      Field::with_default("timeout", duration_schema(1e-3, 3600.0), "500 ms",
                          "The longest time until a reply."),
      Field::optional("max_age", duration_schema(1e-3),
                      "The age beyond which a value that is read is not fresh. Left out: 1 s as a client, no "
                      "limit as a server."),
      Field::with_default("start_timeout", duration_schema(1e-3, 3600.0), "2 s",
                          "The longest time in which the run tries to reach the unit at its start.")
          .renamed_from("start_limit"),
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
      may_be_lost_field(
          "The unit: it does not answer for longer than max_age; as a server: no client is connected "
          "for longer than max_age."),
      optional_field("a register that hil reads, or that clients of the server write,"),
      Field::optional("priority", thread_priority_schema(),
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
      optional_field("the register, which hil reads or clients of the server write,"),
      Field::optional("about", Schema::text(), "A sentence about the register."),
  });
  return Schema::record({Field::needed("registers", Schema::list(entry, 1, 65536), "The registers.")});
}

}  // namespace hil::buses::modbus
