#include "runtime/modules/region_crossings.hpp"

#include <utility>

namespace hil::modules {

RegionCrossings::RegionCrossings(rtstdb::Database& database, const rtstdb::Region& region,
                                 const std::string& name, const std::string& caller, EventLog& events)
    : lost_(events.add_kind(caller + ": {} crossings of " + name + " were lost", 0)) {
  auto query = database.watch(rtstdb::StandingRegion{.region = region}, {.name = name});
  if (!query) throw RefusedByDatabase(caller, query.error());
  query_ = std::move(query).value();
}

}  // namespace hil::modules
