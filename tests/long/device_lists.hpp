#pragma once
// The lists of list_history.hpp in a database with a device: a value is a body at its list's place, and a
// list is read by the region there. Who a body is, is known to who made it, so what was read is put into
// words when all have ended; the order of a list's values is that of the versions that their makers were
// told.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "tests/long/list_history.hpp"

namespace hil::stress {

class DeviceLists {
 public:
  static constexpr Key lists = 6;

  /// Empty when there is a database; else why not.
  std::string open();
  /// Clients append and read at once, until each has made so many transactions; then every list is read, and
  /// all is cleared. The same seed gives the same intentions, not the same interleaving.
  std::vector<Recorded> run(std::uint32_t seed, int clients, int transactions_each);

 private:
  class Client;
  void clear();

  std::unique_ptr<rtstdb::Database> database_;
  rtstdb::GeometryId body_;
  std::vector<rtstdb::EntityId> heads_;  ///< by key
  rtstdb::Version empty_since_ = 0;      ///< the version before the clients began
};

}  // namespace hil::stress
