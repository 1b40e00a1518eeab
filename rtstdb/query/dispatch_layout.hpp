#pragma once
// How the places of a dispatch are shared out to workgroups (place_of_invocation in shaders/common/places.glsl).

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

/// A workgroup of every search has so many invocations.
inline constexpr std::uint32_t places_per_group = 64;

/// From `first` to before `end`.
struct PlaceRange {
  std::uint32_t first = 0, end = 0;
};

struct DispatchLayout {
  std::uint32_t per_group = places_per_group;  ///< the other invocations of a group have nothing to do
  std::uint32_t groups = 0;
};

/// Neighbours stay together by so many: a subgroup, on lavapipe with 256 bits.
inline constexpr std::uint32_t neighbours = 8;

/// A batch is divided into multiples of this, unless a chunk is halted: fewer would leave a processor with nothing to do, or lanes of a subgroup. `processors`: of a
/// software device; else none.
constexpr std::uint32_t fewest_places(std::uint32_t processors) noexcept {
  return processors == 0 ? places_per_group : std::min(neighbours * processors, places_per_group);
}

/// A software device gives each group to one of its `processors`, so a small batch takes groups enough for all of them, and none
/// gets much more than another. Other devices (none) get full groups.
constexpr DispatchLayout spread_out(std::uint32_t places, std::uint32_t processors) noexcept {
  const auto divided_up = [](std::uint32_t a, std::uint32_t b) { return a / b + (a % b != 0 ? 1 : 0); };
  const std::uint32_t full = divided_up(places, places_per_group);
  if (processors == 0 || full == 0) return {places_per_group, full};
  const std::uint32_t turns = divided_up(full, processors);
  const std::uint32_t each = divided_up(divided_up(places, turns), processors);
  const std::uint32_t per_group = std::min(divided_up(each, neighbours) * neighbours, places_per_group);
  return {per_group, divided_up(places, per_group)};
}

/// `dispatch(args, groups)` piece by piece, none of more than `max_groups`; `args.first` is where each begins.
template <class Args, class Dispatch>
void in_pieces(const DispatchLayout& spread, std::uint32_t max_groups, Args args,
               Dispatch dispatch) noexcept {
  for (std::uint32_t left = spread.groups; left > 0;) {
    const std::uint32_t some = std::min(left, max_groups);
    dispatch(args, some);
    args.first += some * spread.per_group;
    left -= some;
  }
}

/// Those that are asked again by one_a_group: as many are done at a time as one.
constexpr std::uint32_t groups_at_once(std::uint32_t processors) noexcept {
  return processors == 0 ? places_per_group : processors;
}

/// Those that are asked again: each may take as long as a batch.
constexpr DispatchLayout one_a_group(std::uint32_t places) noexcept {
  return {1, places};
}

}  // namespace rtstdb::query
