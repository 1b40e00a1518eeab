#pragma once
// Counts the returns of a scanner by entity and by their order in the beam, for the report's tables.
//
// Threads: add in the tick, without allocation; contribute after the run.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include <hil/contribution.hpp>
#include <hil/world/beam_return.hpp>
#include <rtstdb/limits.hpp>

namespace hil::modules {

class ReturnStatistics {
 public:
  /// Entities with a row of their own; the returns of further ones are counted together.
  static constexpr std::size_t max_entities = 64;

  struct Counts {
    std::uint64_t returns = 0;
    std::uint64_t detected = 0;
    // Of the detected returns:
    double nearest_m = std::numeric_limits<double>::infinity();
    double farthest_m = 0.0;
    double dimmest_per_m2 = std::numeric_limits<double>::infinity();
    double brightest_per_m2 = 0.0;
    float smallest_fraction = std::numeric_limits<float>::infinity();
  };

  /// `detection`: empty if the receiver did not detect the return.
  void add(const BeamReturn& beam_return, std::uint32_t ordinal,
           const std::optional<Detection>& detection) noexcept;
  /// A beam whose search reached the limits of the device.
  void add_incomplete_beam() noexcept { ++incomplete_beams_; }
  /// A beam that may have reached entities that were not searched (ConeReturn::overflow).
  void add_overflowed_beam() noexcept { ++overflowed_beams_; }

  /// Adds a section with the tables, and events for incomplete and overflowed beams.
  void contribute(const std::string& scanner, const std::function<std::string(rtstdb::EntityId)>& name_of,
                  contribution::Contribution& report) const;

 private:
  struct OfEntity {
    rtstdb::EntityId entity;
    Counts counts;
  };
  Counts& counts_of(rtstdb::EntityId entity) noexcept;

  std::array<OfEntity, max_entities> entities_{};
  std::size_t entity_count_ = 0;
  std::size_t last_ = 0;  // the entity of the last return: neighbouring beams meet the same one
  Counts others_;
  std::array<Counts, rtstdb::max_returns_per_cone> by_ordinal_{};
  std::uint64_t incomplete_beams_ = 0, overflowed_beams_ = 0;
};

}  // namespace hil::modules
