#include <algorithm>

#include "runtime/buses/bus.hpp"

namespace hil::buses {

#define BUS(folder) BusType folder##_type();
#include "runtime/buses/table.def"
#undef BUS

const std::vector<BusType>& bus_types() {
#define BUS(folder) folder##_type(),
  static const std::vector<BusType> types{
#include "runtime/buses/table.def"
  };
#undef BUS
  return types;
}

const std::vector<config::BusSectionType>& section_types() {
  static const std::vector<config::BusSectionType> types = [] {
    std::vector<config::BusSectionType> all;
    for (const BusType& type : bus_types())
      all.push_back(type.section);
    return all;
  }();
  return types;
}

const BusType& type_of(const config::BusSection& section) {
  return *std::ranges::find_if(bus_types(),
                               [&](const BusType& type) { return type.section.key == section.type->key; });
}

std::vector<contribution::BusGroup> empty_groups() {
  std::vector<contribution::BusGroup> groups;
  for (const BusType& type : bus_types()) {
    groups.push_back({.list_key = type.section.key,
                      .title = type.title,
                      .name_key = type.section.name_key,
                      .columns = type.columns,
                      .buses = {}});
  }
  return groups;
}

}  // namespace hil::buses
