#pragma once
// How the places of a dispatch are distributed over workgroups (place_of_invocation in
// shaders/common/places.glsl).

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

/// Invocations in a workgroup of a search.
inline constexpr std::uint32_t places_per_group = 64;

/// The places from `first` to before `end`.
struct PlaceRange {
  std::uint32_t first = 0, end = 0;
};

struct DispatchLayout {
  std::uint32_t per_group = places_per_group;  ///< places per workgroup; its other invocations are idle
  std::uint32_t groups = 0;
};

/// This many neighbouring places stay in one chunk: a subgroup, on lavapipe with 256 bits.
inline constexpr std::uint32_t neighbours = 8;

/// Chunks are multiples of this many places, unless they are halted: with fewer, a processor or lanes of a
/// subgroup would be idle. `processors`: of a software device; else 0.
constexpr std::uint32_t min_places(std::uint32_t processors) noexcept {
  return processors == 0 ? places_per_group : std::min(neighbours * processors, places_per_group);
}

/// A software device runs each group on one of its `processors`, so a small batch is divided into enough
/// groups for all of them, of about the same size. Other devices (0 processors) get full groups.
constexpr DispatchLayout spread_out(std::uint32_t places, std::uint32_t processors) noexcept {
  const auto divided_up = [](std::uint32_t a, std::uint32_t b) { return a / b + (a % b != 0 ? 1 : 0); };
  const std::uint32_t full = divided_up(places, places_per_group);
  if (processors == 0 || full == 0) return {places_per_group, full};
  const std::uint32_t turns = divided_up(full, processors);
  const std::uint32_t each = divided_up(divided_up(places, turns), processors);
  const std::uint32_t per_group = std::min(divided_up(each, neighbours) * neighbours, places_per_group);
  return {per_group, divided_up(places, per_group)};
}

/// Calls `dispatch(args, groups)` piece by piece, with at most `max_groups` groups each; `args.first` is
/// where the piece begins.
template <class Args, class Dispatch>
void in_pieces(const DispatchLayout& layout, std::uint32_t max_groups, Args args,
               Dispatch dispatch) noexcept {
  for (std::uint32_t left = layout.groups; left > 0;) {
    const std::uint32_t some = std::min(left, max_groups);
    dispatch(args, some);
    args.first += some * layout.per_group;
    left -= some;
  }
}

/// Places with a group each (one_a_group): this many take about as long as one.
constexpr std::uint32_t groups_at_once(std::uint32_t processors) noexcept {
  return processors == 0 ? places_per_group : processors;
}

/// For retried places, each of which may take as long as a batch.
constexpr DispatchLayout one_a_group(std::uint32_t places) noexcept {
  return {1, places};
}

}  // namespace rtstdb::query
