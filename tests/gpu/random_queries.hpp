#pragma once
// Fixture of the short and the long random tests: random queries of any kind in a random world, each answer
// compared with the oracle.

#include <optional>

#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {

/// Equal seeds give equal worlds and equal queries.
struct RandomWorld {
  std::uint64_t seed = 0;
  std::uint32_t entities = 0;
  double radius_m = 0.0;  ///< SceneOptions::radius_m
};

class RandomQueries : public DatabaseTest {
 protected:
  static constexpr std::uint32_t batch = 500;

  /// Commits three versions, the last of which is queried: a fifth of the entities is removed, changed and
  /// created in between.
  void fill(const RandomWorld& world);

  /// Runs `count` random elements in batches, until the first failure. Each batch has a random window of
  /// time: an instant, or up to a second, at the version's time or some seconds later. The short form of a
  /// test runs about a third of them.
  Tally run_random(const AnyQueryOptions& options, std::size_t count);
  /// The same with groups of eight neighbouring rays.
  Tally run_neighbours(const RayQueryOptions& options, std::size_t count);

  const oracle::World& oracle_world() const { return *oracle_world_; }
  Random& random() { return random_; }
  const SceneOptions& scene() const { return scene_; }

 private:
  struct Window {
    WorldTime first{};
    double length_s = 0.0;
  };
  Window random_window();
  ElementScene elements_in(const Window& window) const {
    return {oracle_world_->entities(), scene_, window.first, window.length_s};
  }
  /// `fill(query, window)` fills the elements of a batch.
  template <class Fill>
  Tally run_batches(KindCase& query, std::size_t count, Fill fill);

  Random random_{0};
  SceneOptions scene_;
  std::optional<oracle::World> oracle_world_;
};

/// Fails the test unless a fifth to four fifths of the elements hit something, and rounding decides at most
/// the share `max_too_close` of the answers.
void expect_informative(const Tally& tally, double max_too_close);

}  // namespace rtstdb::test
