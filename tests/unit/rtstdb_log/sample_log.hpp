#pragma once
// A whole log in memory, written by a seed, to be damaged.

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
  int moves_at_the_end = 0;  ///< behind a checkpoint, and at the time of the version that it has
};

struct SampleLog {
  Contents contents;
  History history;
  Version latest = 0;
  std::string latest_in_lines;
};

SampleLog make_sample(const SampleOptions& options);
/// Segments and checkpoints older than those it was recovered from.
void take_away_before(const Recovered& recovered, Contents& contents);

/// Where a group lies.
struct GroupPlace {
  std::string file;
  std::uint64_t offset = 0;
  GroupHeader header;
  std::uint64_t bytes = 0;
};
/// All that count, in order.
std::vector<GroupPlace> groups_of(const Contents& contents);

}  // namespace rtstdb::log::test
