#pragma once
// What the database's log does not hold of a run's world: the names of entities and layers, distance fields,
// and what a module records of itself. It is written as world.json before the first tick, so that a history
// can be read even of a run that was killed.
//
// Units: nanoseconds of run time, which is world time. Threads: plain data.

#include <cstdint>
#include <string>
#include <vector>

#include <hil/record.hpp>

#include "runtime/contract/plugin_identity.hpp"

namespace hil::contribution {

/// Named as in the scenario: "house_1", "traffic.ego".
struct NamedEntity {
  std::string name;
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
};

/// A distance field of a geometry (rtstdb/field.hpp).
struct FieldRecord {
  std::uint32_t geometry = 0;
  double error_m = 0.0;
  double cell_m = 0.0;
  std::string sign;
  std::uint64_t max_bytes = 0;
};

struct WorldRecord {
  std::string scenario;
  std::string database_id;  ///< of the log that the names belong to, in hexadecimal; empty: there is no log
  std::int64_t period_ns = 0;  ///< of the base rate
  std::vector<plugins::PluginIdentity> plugins;
  std::vector<std::string> layers;  ///< by bit of the masks
  std::vector<NamedEntity> entities;
  std::vector<FieldRecord> fields;
  std::vector<ModuleRecord> modules;
};

}  // namespace hil::contribution
