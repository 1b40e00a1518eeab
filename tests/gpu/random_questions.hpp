#pragma once
// Random questions of every kind about random worlds, each answer held to the oracle: the body of all random
// tests, short and long.

#include <optional>

#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {

/// The same seed makes the same world and the same questions.
struct RandomWorld {
  std::uint64_t seed = 0;
  std::uint32_t entities = 0;
  double radius_m = 0.0;  ///< SceneOptions::radius_m
};

class RandomQuestions : public DatabaseTest {
 protected:
  static constexpr std::uint32_t batch = 500;

  /// In three versions, the last of which is asked: entities are deleted, changed and made anew in between.
  void fill(const RandomWorld& world);

  /// Asks `count` questions in batches, each with a window of its own: an instant, or a millisecond to a
  /// second, from the version's time on or some seconds later. The short form of a test asks about a third.
  /// The capacity is set here. Stops at the first failure.
  Tally ask(const AnyQueryOptions& wanted, std::size_t count);
  /// Rays that run side by side, eight after eight; the last of a batch are fewer.
  Tally ask_neighbours(const RayQueryOptions& wanted, std::size_t count);

  const oracle::World& everything() const { return *everything_; }
  Random& random() { return random_; }
  const SceneOptions& scene() const { return scene_; }

 private:
  struct Window {
    WorldTime first{};
    double length_s = 0.0;
  };
  Window random_window();
  ElementScene elements_in(const Window& window) const {
    return {everything_->entities(), scene_, window.first, window.length_s};
  }
  /// `fill(query, window)`: every element of a batch.
  template <class Fill>
  Tally ask_batches(KindCase& query, std::size_t count, Fill fill);

  Random random_{0};
  SceneOptions scene_;
  std::optional<oracle::World> everything_;
};

/// A world that shows nothing, or in which everything is hit, proves nothing: fails the test unless a fifth
/// to four fifths of the questions hit, and unless the oracle left open no more than that share.
void expect_telling(const Tally& tally, double max_too_close);

}  // namespace rtstdb::test
