#pragma once
// A random log in memory, for tests that damage it.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "live_world.hpp"
#include "rtstdb/log/format.hpp"

namespace rtstdb::log::test {

using Contents = std::map<std::string, std::vector<std::byte>>;

struct SampleOptions {
  std::uint64_t seed = 1;
  std::uint64_t database_id = 0x0123'4567'89ab'cdef;
  int commits = 30;
  std::uint64_t segment_bytes = 4096;
  bool closed = true;
  bool checkpoints = true;
  int moves_at_the_end = 0;  ///< after a checkpoint, at the time of its version
};

struct SampleLog {
  Contents contents;
  History history;
  Version latest = 0;
  std::string latest_as_text;
};

SampleLog make_sample(const SampleOptions& options);
/// Removes the segments and checkpoints before those used by the recovery.
void remove_before(const Recovered& recovered, Contents& contents);

/// The place of a group.
struct GroupPlace {
  std::string file;
  std::uint64_t offset = 0;
  GroupHeader header;
  std::uint64_t bytes = 0;
};
/// All valid groups, in order.
std::vector<GroupPlace> groups_of(const Contents& contents);

}  // namespace rtstdb::log::test
