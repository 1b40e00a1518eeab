#pragma once
// Pairs of bodies that are always moved together, in a database with a device, and readers who ask where they
// are by rays, regions and distances at once: whoever sees one half of a pair in another place than the other
// has seen a version that never was.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

namespace hil::stress {

class CanaryPairs {
 public:
  static constexpr std::uint32_t pairs = 64;
  static constexpr std::uint32_t places = 8;

  struct Seen {
    std::uint64_t questions = 0;     ///< rays, regions and points answered
    std::uint64_t transactions = 0;  ///< that answered them
    std::uint64_t of_the_past = 0;   ///< of these: pinned, or as of a time
    std::uint64_t too_old = 0;       ///< asked for the past and were told that it is gone
    std::uint64_t versions = 0;      ///< made meanwhile
    std::uint64_t came_to_nothing =
        0;                     ///< moves that were refused, missed or cancelled, and must not be seen
    std::uint64_t halves = 0;  ///< or a whole world that was never there in that version
    std::string first_half;
  };

  /// Empty when there is a database; else why not.
  std::string open();
  /// Readers and writers at once, until so many questions have been answered, or until half a pair was seen.
  Seen run(std::uint32_t seed, int readers, int writers, std::uint64_t questions);

 private:
  using Places = std::array<std::uint8_t, pairs>;
  struct Read {
    rtstdb::Version version = 0;
    Places places{};
  };
  struct Move {
    rtstdb::Version version = 0;
    std::uint8_t pair = 0, place = 0;
  };
  /// Holds what was read against the moves, from where the pairs stood before; takes these there.
  void judge(std::vector<Read> reads, std::vector<Move> moves, Seen& seen);
  class Reader;
  class Writer;
  /// On the clock of deadlines.
  static rtstdb::ClockTime now();

  std::unique_ptr<rtstdb::Database> database_;
  rtstdb::GeometryId body_;
  std::vector<rtstdb::EntityId> entities_;  ///< two for each pair
  rtstdb::VersionInfo born_;                ///< the version that has them first
  Places places_{};                         ///< before a run
  std::atomic<std::uint64_t> answered_{0};
  std::atomic<bool> over_{false};
};

}  // namespace hil::stress
