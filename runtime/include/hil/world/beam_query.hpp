#pragma once
// The beams of a scanner as one prepared query: rays if they do not diverge, else cones with covered
// fractions.
//
// Threads: prepare at setup; all else in the tick, without allocation. The query belongs to one transaction
// at a time.

#include <cstdint>
#include <memory>
#include <string>

#include <hil/world/beam_return.hpp>
#include <rtstdb/database.hpp>

namespace hil::modules {

struct BeamQueryOptions {
  std::string name{};
  std::uint32_t capacity = 0;                       ///< beams in a batch
  double divergence_rad = 0.0;                      ///< full opening angle; 0: rays
  std::uint32_t returns_per_beam = 1;               ///< a ray has one
  rtstdb::ConeMode mode = rtstdb::ConeMode::exact;  ///< of beams that diverge
  /// Rays meet entities at their poses at the version's time (RayQueryOptions). Cones ignore this: the caller
  /// gives all of them one time.
  bool ignore_motion = false;
};

class BeamQuery {
 public:
  /// Errors: those of Database::prepare.
  static rtstdb::Result<std::unique_ptr<BeamQuery>> prepare(rtstdb::Database& database,
                                                            const BeamQueryOptions& options);

  /// The largest number of beams in a batch.
  static std::uint32_t max_capacity(double divergence_rad) noexcept;

  /// Sets a beam, given as the ray along its axis; lambda_min has to be 0.
  void set(std::uint32_t beam, const rtstdb::Ray& ray) noexcept;
  /// Adds the first `count` beams to a transaction that is being declared.
  void add_to(rtstdb::Transaction& transaction, std::uint32_t count) noexcept;

  std::uint32_t returns_per_beam() const noexcept { return returns_per_beam_; }
  /// A return of the last transaction. The returns of a beam are in the order of their ranges; those after a
  /// miss are misses.
  BeamReturn at(std::uint32_t beam, std::uint32_t ordinal) const noexcept;
  /// Whether a part of a beam may have reached entities that were not searched (ConeReturn::overflow).
  bool overflowed(std::uint32_t beam) const noexcept;

 private:
  BeamQuery() = default;

  std::unique_ptr<rtstdb::RayQuery> rays_;  // or cones_
  std::unique_ptr<rtstdb::ConeQuery> cones_;
  float divergence_rad_ = 0.0f;
  std::uint32_t returns_per_beam_ = 1;
};

}  // namespace hil::modules
